"""Sparse matrices of ``scipy.sparse.save_npz``, dense ones of ``numpy.save``; nothing is ever unpickled."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixFileError
from .canonical import refuse_mostly_empty, working_dtype

_INTEGERS, _NUMBERS = "iu", "biufc"
_STORAGES = {"coo": sp.coo_array, "csr": sp.csr_array, "csc": sp.csc_array, "bsr": sp.bsr_array, "dia": sp.dia_array}


def read_npz(stream: BinaryIO, name: str) -> Any:
    """Read what ``scipy.sparse.save_npz`` has written.

    Parameters
    ----------
    stream : binary file
        Seekable, at its beginning.
    name : str
        What to call it in messages.

    Returns
    -------
    coo_array, csr_array, csc_array, bsr_array or dia_array
        As stored; its index arrays are still to be checked.

    Raises
    ------
    MatrixFileError
        If an array is missing, of a wrong type, or holds Python objects.
    MatrixError
        If there are far more rows than entries.
    """
    try:
        with np.load(stream, allow_pickle=False) as archive:
            return _matrix(archive)
    except _ArchiveError as error:
        raise MatrixFileError(f"{name} {error}") from error


def read_npy(stream: BinaryIO, name: str) -> Any:
    """Read a dense array of ``numpy.save``; its zeros are absent entries.

    Raises
    ------
    MatrixFileError
        If it holds Python objects, or no matrix of numbers.
    """
    try:
        dense = np.load(stream, allow_pickle=False)
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise MatrixFileError(f"{name} holds Python objects, which are never loaded") from error
        raise
    return from_dense(dense, name)


def from_dense(dense: NDArray, name: str) -> sp.coo_array:
    """A dense matrix without its zeros.

    Raises
    ------
    MatrixFileError
        If it is no matrix of numbers.
    """
    if dense.ndim != 2 or dense.dtype.kind not in _NUMBERS:
        what = "an array of numbers" if dense.dtype.kind in _NUMBERS else f"an array of type {dense.dtype}"
        raise MatrixFileError(f"{name} holds {what} with {dense.ndim} dimensions, and a matrix of numbers has two")
    return sp.coo_array(dense.astype(working_dtype(dense.dtype), copy=False))


class _ArchiveError(Exception):
    """What is wrong with an archive, to follow its name."""


def _matrix(archive: Any) -> Any:
    if "format" not in archive.files:
        if {"points", "node_status"} <= set(archive.files):
            raise _ArchiveError("is a mesh (as `recover` writes it), and a matrix is asked for: name the matrix's file")
        names = ", ".join(repr(key[:40]) for key in archive.files[:5]) + ", ..." * (len(archive.files) > 5)
        what = f"only {names}" if names else "it is an empty archive"
        raise _ArchiveError(f"holds no sparse matrix ({what}): save one with scipy.sparse.save_npz")
    value = _array(archive, "format", "SU", 0).item()
    storage = value.decode("ascii", "replace") if isinstance(value, bytes) else value
    if storage not in _STORAGES:
        raise _ArchiveError(f"stores a matrix in the unknown format {storage[:40]!r}: save it as csr")
    shape = _array(archive, "shape", _INTEGERS, 1).tolist()
    if len(shape) != 2 or min(shape) < 0:
        raise _ArchiveError(f"gives the shape of its matrix as {shape[:5]} instead of rows and columns")
    data = _array(archive, "data", _NUMBERS, {"bsr": 3, "dia": 2}.get(storage, 1))
    data = data.astype(working_dtype(data.dtype), copy=False)  # scipy lacks half precision and foreign byte orders
    if storage == "dia":
        return sp.dia_array((data, _array(archive, "offsets", _INTEGERS, 1)), shape=shape)
    refuse_mostly_empty(shape[0], data.size)  # before an index pointer of that length is unpacked
    if "coords" in archive.files:
        coordinates = tuple(_array(archive, "coords", _INTEGERS, 2))
        if len(coordinates) != 2:
            raise _ArchiveError(f"holds a sparse array of {len(coordinates)} dimensions, and a matrix has two")
        return sp.coo_array((data, coordinates), shape=shape)
    keys = ("row", "col") if storage == "coo" else ("indices", "indptr")
    first, second = (_array(archive, key, _INTEGERS, 1) for key in keys)
    arrays = (data, (first, second)) if storage == "coo" else (data, first, second)
    return _STORAGES[storage](arrays, shape=shape)


def _array(archive: Any, key: str, kinds: str, ndim: int) -> NDArray:
    if key not in archive.files:
        raise _ArchiveError(f"has no array {key!r}, which a sparse matrix needs: save it with scipy.sparse.save_npz")
    try:
        array = archive[key]
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise _ArchiveError(f"has Python objects in its array {key!r}, which are never loaded") from error
        raise
    if not isinstance(array, np.ndarray) or array.dtype.kind not in kinds or array.ndim != ndim:
        held = f"{array.ndim}-dimensional {array.dtype}" if isinstance(array, np.ndarray) else "no array"
        raise _ArchiveError(f"has in {key!r} {held}, which is no part of a sparse matrix of numbers")
    return array
