"""MATLAB's files of versions 5 to 7.3, and which of their variables is the matrix."""

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows
from .mat5 import variables


def read_mat(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file of versions 5 to 7; its index arrays are still to be checked.

    `name` is what to call the file in messages, and `variable` which one to read, such as ``"A"`` or ``"Problem.A"``;
    it is needed where several are sparse and square.

    Raises MatrixFileError if there is no sparse variable, or the choice is open; ValueError, zlib.error, struct.error
    if the file is truncated or damaged.
    """
    held = list(variables(stream.read()))
    found = {key: A for key, _, A in held if A is not None}
    return _chosen(found, {key: shape for key, shape, _ in held}, name, variable)


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


def _chosen(found: dict[str, Any], others: dict[str, tuple[int, ...]], name: str, variable: str | None) -> Any:
    """The variable that is asked for, or the only square one.

    The SuiteSparse collection keeps explicit zeros, which MATLAB cannot store, as the pattern ``Problem.Zeros``; they
    are put back into ``Problem.A``.
    """
    for key in [key for key in found if key.endswith(".A")]:
        zeros = found.pop(f"{key[:-1]}Zeros", None)
        if zeros is not None and zeros.shape == found[key].shape:
            A, zeros = canonical(found[key]), canonical(zeros)
            rows = np.concatenate([entry_rows(A), entry_rows(zeros)])
            data = np.concatenate([A.data, np.zeros(zeros.nnz, dtype=A.dtype)])
            found[key] = sp.coo_array((data, (rows, np.concatenate([A.indices, zeros.indices]))), shape=A.shape)
    sizes = {key: A.shape for key, A in found.items()} or others
    shown = [f"{key[:40]!r} of size {' x '.join(map(str, shape[:4]))}" for key, shape in list(sizes.items())[:6]]
    held = ", ".join(shown) + ", ..." * (len(sizes) > 6) or "nothing"
    if variable is not None:
        if variable not in found:
            raise MatrixFileError(f"{name} has no sparse variable {variable!r}: it holds {held}")
        return found[variable]
    candidates = [A for A in found.values() if A.shape[0] == A.shape[1]] or list(found.values())
    if not candidates:
        raise MatrixFileError(f"{name} holds no sparse variable (it holds {held}): make one by sparse(A) and save it")
    if len(candidates) > 1:
        raise MatrixFileError(f"{name} holds several sparse variables ({held}): choose one by `variable=NAME`")
    return candidates[0]
