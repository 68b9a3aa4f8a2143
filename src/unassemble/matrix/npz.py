"""Sparse matrices of ``scipy.sparse.save_npz``; nothing is ever unpickled."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixFileError
from .canonical import refuse_mostly_empty, working_dtype

_INTEGERS, _NUMBERS = "iu", "biufc"


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
    with np.load(stream, allow_pickle=False) as archive:
        return _Arrays(archive, name).matrix()


class _Arrays:
    """The arrays of one archive, checked as they are taken."""

    def __init__(self, archive: Any, name: str):
        self._archive = archive
        self._name = name

    def matrix(self) -> Any:
        storage = self._storage()
        shape = self._shape()
        if storage == "dia":
            return sp.dia_array((self._data(2), self._take("offsets", _INTEGERS, 1)), shape=shape)
        data = self._data(3 if storage == "bsr" else 1)
        refuse_mostly_empty(shape[0], data.size)  # before an index pointer of that length is unpacked
        if storage == "coo":
            return sp.coo_array((data, self._coordinates()), shape=shape)
        arrays = data, self._take("indices", _INTEGERS, 1), self._take("indptr", _INTEGERS, 1)
        return {"csr": sp.csr_array, "csc": sp.csc_array, "bsr": sp.bsr_array}[storage](arrays, shape=shape)

    def _storage(self) -> str:
        names = self._archive.files
        if "format" not in names:
            raise self._error(f"holds no sparse matrix ({_listed(names)}): save one with scipy.sparse.save_npz")
        value = self._take("format", "SU", 0).item()
        storage = value.decode("ascii", "replace") if isinstance(value, bytes) else value
        if storage not in ("coo", "csr", "csc", "bsr", "dia"):
            raise self._error(f"stores a matrix in the unknown format {storage[:40]!r}: save it as csr")
        return str(storage)

    def _shape(self) -> tuple[int, int]:
        shape = self._take("shape", _INTEGERS, 1)
        if len(shape) != 2 or shape.min() < 0:
            raise self._error(f"gives the shape of its matrix as {shape[:5].tolist()} instead of rows and columns")
        return int(shape[0]), int(shape[1])

    def _data(self, ndim: int) -> NDArray:
        data = self._take("data", _NUMBERS, ndim)
        return data.astype(working_dtype(data.dtype), copy=False)  # scipy lacks half precision and foreign byte orders

    def _coordinates(self) -> tuple[NDArray, NDArray]:
        if "coords" in self._archive.files:
            coordinates = self._take("coords", _INTEGERS, 2)
            if len(coordinates) != 2:
                raise self._error(f"holds a sparse array of {len(coordinates)} dimensions, and a matrix has two")
            return coordinates[0], coordinates[1]
        return self._take("row", _INTEGERS, 1), self._take("col", _INTEGERS, 1)

    def _take(self, key: str, kinds: str, ndim: int) -> NDArray:
        if key not in self._archive.files:
            raise self._error(f"has no array {key!r}, which a sparse matrix needs: save it with scipy.sparse.save_npz")
        try:
            array = self._archive[key]
        except ValueError as error:
            if "allow_pickle" in str(error):
                raise self._error(f"has Python objects in its array {key!r}, which are never loaded") from error
            raise
        if not isinstance(array, np.ndarray) or array.dtype.kind not in kinds or array.ndim != ndim:
            held = f"{array.ndim}-dimensional {array.dtype}" if isinstance(array, np.ndarray) else "no array"
            raise self._error(f"has in {key!r} {held}, which is no part of a sparse matrix of numbers")
        return array

    def _error(self, what: str) -> MatrixFileError:
        return MatrixFileError(f"{self._name} {what}")


def _listed(names: list[str]) -> str:
    if not names:
        return "it is an empty archive"
    return "only " + ", ".join(repr(n[:40]) for n in names[:5]) + (", ..." if len(names) > 5 else "")
