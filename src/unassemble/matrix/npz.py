"""Sparse matrices of ``scipy.sparse.save_npz``, dense ones of ``numpy.save``; nothing is ever unpickled."""

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import working_dtype


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
