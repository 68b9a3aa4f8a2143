"""Binary files: scipy's ``.npz``, numpy's ``.npy``, and MATLAB's of versions 4 to 7.3; nothing is ever unpickled."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows, working_dtype


def read_npz(stream: BinaryIO, name: str) -> Any:
    """Read what ``scipy.sparse.save_npz`` has written, as stored; index arrays are still to be checked.

    `name` is what to call the file in messages.

    Raises
    ------
    MatrixFileError
        If it holds no sparse matrix, or Python objects.
    ValueError
        If arrays do not belong together.
    """
    with np.load(stream, allow_pickle=False) as archive:
        held = archive.files
    if {"points", "node_status"} <= set(held):
        raise MatrixFileError(
            f"{name} is a mesh (as `recover` writes it), and a matrix is asked for: name the matrix's file"
        )
    if "format" not in held:
        what = ", ".join(repr(key[:40]) for key in held[:5]) + ", ..." * (len(held) > 5) or "nothing"
        raise MatrixFileError(f"{name} holds no sparse matrix ({what}): save one with scipy.sparse.save_npz")
    stream.seek(0)
    return _without_objects(sp.load_npz, stream, name)


def read_npy(stream: BinaryIO, name: str) -> sp.coo_array:
    """Read a dense array of ``numpy.save``; its zeros are absent entries.

    Raises
    ------
    MatrixFileError
        If it holds Python objects, or no matrix of numbers.
    """
    dense = _without_objects(np.load, stream, name)  # which does not unpickle unless told
    if dense.ndim != 2 or dense.dtype.kind not in "biufc":
        what = f"an array of type {dense.dtype} with {dense.ndim} dimensions"
        raise MatrixFileError(f"{name} holds {what}, and a matrix of numbers has two")
    return sp.coo_array(dense.astype(working_dtype(dense.dtype), copy=False))


def _without_objects(load: Any, stream: BinaryIO, name: str) -> Any:
    try:
        return load(stream)
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise MatrixFileError(f"{name} holds Python objects, which are never loaded") from error
        raise


def read_mat(stream: BinaryIO, name: str, variable: str | None = None, *, dense: bool = False) -> Any:
    """Read the sparse variable of a MATLAB file of versions 4 to 7; its index arrays are still to be checked.

    Parameters
    ----------
    stream : binary file
    name : str
        What to call it in messages.
    variable : str, optional
        Which one, such as ``"A"`` or ``"Problem.A"``; needed where several are sparse and square.
    dense : bool
        Whether full matrices are taken as well: version 4, where they are the rule.

    Raises
    ------
    MatrixFileError
        If there is no sparse variable, or the choice is open.
    ValueError, and others of scipy's
        If the file is truncated or damaged.
    """
    from scipy.io import loadmat, whosmat

    shapes = {key: (shape, kind) for key, shape, kind in whosmat(stream)}
    stream.seek(0)
    wanted = [key for key, (_, kind) in shapes.items() if dense or kind in ("sparse", "logical", "struct")]
    found: dict[str, Any] = {}
    for key, value in loadmat(stream, variable_names=wanted).items():
        if sp.issparse(value):
            found[key] = value.astype(bool) if shapes[key][1] == "logical" else value
        elif dense and np.ndim(value) == 2 and value.dtype.kind in "biufc" and min(value.shape) > 1:
            found[key] = sp.coo_array(value)
        elif isinstance(value, np.ndarray) and value.dtype.names and value.shape == (1, 1):
            fields = {f"{key}.{field}": value[field][0, 0] for field in value.dtype.names}
            found |= {field: A for field, A in fields.items() if sp.issparse(A)}
    return _chosen(found, {key: shape for key, (shape, _) in shapes.items()}, name, variable)


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
