"""MATLAB files of versions 4 to 7.3, SuiteSparse's ``Problem.A`` included.

The reader of scipy (1.17) ends the process by a segmentation fault on some damaged files of version 5; the one here
looks at every length before it believes it, and unpacks nothing but what may hold a sparse matrix.
"""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows
from .mat5 import Variable, read_mat5


def read_mat(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file.

    The SuiteSparse collection keeps explicit zeros, which MATLAB cannot store, as the pattern
    ``Problem.Zeros``; they are put back into ``Problem.A``.

    Parameters
    ----------
    stream : binary file
    name : str
        What to call it in messages.
    variable : str, optional
        Which one, such as ``"A"`` or ``"Problem.A"``; needed where several are sparse and square.

    Returns
    -------
    scipy sparse array
        Its index arrays are still to be checked.

    Raises
    ------
    MatrixFileError
        If there is no sparse variable, or the choice is open.
    ValueError
        If the file is truncated or damaged, in a few words.
    """
    variables = read_mat5(stream.read())
    others = {v.name: v.shape for v in variables}
    return _chosen(dict(_sparse_variables(variables)), others, name, variable)


def read_mat4(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read a matrix from a MATLAB file of version 4, dense or sparse; as :func:`read_mat`."""
    from scipy.io import loadmat

    held = {key: value for key, value in loadmat(stream).items() if not key.startswith("__")}
    found = {key: sp.coo_array(value) for key, value in held.items() if _is_matrix(value)}
    return _chosen(found, {key: np.shape(value) for key, value in held.items()}, name, variable)


def read_mat73(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file of version 7.3, which is HDF5; as :func:`read_mat`.

    A sparse variable is a group with the data sets ``ir``, ``jc`` and ``data``, and the number of rows as the
    attribute ``MATLAB_sparse``; empty ones lack some of these. Structures are groups of variables.
    """
    import h5py

    found: dict[str, Any] = {}
    others: dict[str, tuple[int, ...]] = {}

    def visit(key: str, item: Any) -> None:
        if key.startswith("#"):  # where MATLAB keeps what is referred to
            return
        if "MATLAB_sparse" in item.attrs:
            found[key.replace("/", ".")] = _sparse_group(item)
        elif isinstance(item, h5py.Dataset) and not item.parent.attrs.get("MATLAB_sparse"):
            others[key.replace("/", ".")] = item.shape[::-1]

    with h5py.File(stream, "r") as file:
        file.visititems(visit)
        for key in [key for key in found if key.endswith(".A") and f"{key[:-1]}Zeros" in found]:
            found[key] = _with_zeros(found[key], found.pop(f"{key[:-1]}Zeros"))
    return _chosen(found, others, name, variable)


def _sparse_group(group: Any) -> Any:
    rows, columns = int(group.attrs["MATLAB_sparse"]), len(group["jc"]) - 1
    if "data" not in group or "ir" not in group:
        return sp.csc_array((rows, columns))
    values = group["data"][()]
    if values.dtype.names:  # complex ones
        values = values["real"] + 1j * values["imag"]
    if group.attrs.get("MATLAB_class") == b"logical":
        values = values.astype(bool)
    index = np.int32 if max(rows, columns, len(values)) < 2**31 else np.int64
    return sp.csc_array((values, group["ir"][()].astype(index), group["jc"][()].astype(index)), shape=(rows, columns))


def _is_matrix(value: Any) -> bool:
    dense = isinstance(value, np.ndarray) and value.ndim == 2 and value.dtype.kind in "biufc" and min(value.shape) > 1
    return bool(sp.issparse(value) or dense)


def _chosen(found: dict[str, Any], others: dict[str, tuple[int, ...]], name: str, variable: str | None) -> Any:
    """The variable that is asked for, or the only square one."""
    held = _listed({key: A.shape for key, A in found.items()} or others)
    if variable is not None:
        if variable not in found:
            raise MatrixFileError(f"{name} has no sparse variable {variable!r}: it holds {held}")
        return found[variable]
    square = [A for A in found.values() if A.shape[0] == A.shape[1]]
    candidates = square or list(found.values())
    if not candidates:
        raise MatrixFileError(f"{name} holds no sparse variable (it holds {held}): make one by sparse(A) and save it")
    if len(candidates) > 1:
        raise MatrixFileError(f"{name} holds several sparse variables ({held}): choose one by `variable=NAME`")
    return candidates[0]


def _sparse_variables(variables: list[Variable]) -> list[tuple[str, Any]]:
    found = []
    for v in variables:
        if v.sparse is not None:
            found.append((v.name, v.sparse))
        sparse = {f.name: f.sparse for f in v.fields if f.sparse is not None}
        zeros = sparse.pop("Zeros", None) if "A" in sparse else None
        if zeros is not None and zeros.shape == sparse["A"].shape:
            sparse["A"] = _with_zeros(sparse["A"], zeros)
        found += [(f"{v.name}.{key}", A) for key, A in sparse.items()]
    return found


def _with_zeros(A: Any, zeros: Any) -> Any:
    """A with the pattern of `zeros` stored as explicit zeros."""
    A, zeros = canonical(A), canonical(zeros)
    rows = np.concatenate([entry_rows(A), entry_rows(zeros)])
    data = np.concatenate([A.data, np.zeros(zeros.nnz, dtype=A.dtype)])
    return sp.coo_array((data, (rows, np.concatenate([A.indices, zeros.indices]))), shape=A.shape)


def _listed(sizes: dict[str, tuple[int, ...]]) -> str:
    shown = [f"{key[:40]!r} of size {' x '.join(map(str, shape[:4]))}" for key, shape in list(sizes.items())[:6]]
    return (", ".join(shown) + (", ..." if len(sizes) > 6 else "")) or "nothing"
