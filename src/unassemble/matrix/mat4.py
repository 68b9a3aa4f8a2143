"""Sparse variables of MATLAB files of version 4.

Format: MathWorks, MAT-File Format, level 4. A sparse variable is a dense table of row, column and value (and
imaginary part), with the size of the matrix in its last line.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .variable import Variable

_PRECISIONS = ("f8", "f4", "i4", "i2", "u2", "u1")
_SPARSE = 2


def read_mat4(content: bytes) -> list[Variable]:
    """Find all variables; read the sparse ones.

    Raises
    ------
    ValueError
        If a header makes no sense, or announces more than there is.
    """
    variables = []
    at = 0
    while at < len(content):
        variable, at = _variable(content, at)
        variables.append(variable)
    return variables


def _variable(content: bytes, at: int) -> tuple[Variable, int]:
    order = "<" if struct.unpack_from("<I", content, at)[0] < 1000 else ">"
    kind, rows, columns, imaginary, length = struct.unpack_from(order + "5i", content, at)
    machine, precision, storage = kind // 1000, kind // 10 % 100, kind % 10
    if machine not in (0, 1) or precision >= len(_PRECISIONS) or min(rows, columns, length) < 0:
        raise ValueError("the header of a variable makes no sense")
    dtype = np.dtype(order + _PRECISIONS[precision])
    count = rows * columns * (2 if imaginary else 1)
    start = at + 20 + length
    end = start + count * dtype.itemsize
    if end > len(content):
        raise ValueError("a variable ends beyond the file")
    name = content[at + 20 : start].split(b"\0")[0].decode("latin-1")
    if storage != _SPARSE:
        return Variable(name, (rows, columns)), end
    table = np.frombuffer(content, dtype, rows * columns, start).reshape((rows, columns), order="F")
    A = _sparse(table.astype(np.float64, copy=False))
    return Variable(name, A.shape, sparse=A), end


def _sparse(table: NDArray[np.float64]) -> Any:
    if table.shape[0] < 1 or table.shape[1] not in (3, 4):
        raise ValueError("a sparse variable is not a table of rows, columns and values")
    places = table[:, :2]
    if not ((places >= 0) & (places < 2**53) & (places == np.floor(places))).all():
        raise ValueError("a row or column of a sparse variable is no integer")
    i, j = places[:-1].T.astype(np.int64) - 1
    values = table[:-1, 2] + 1j * table[:-1, 3] if table.shape[1] == 4 else table[:-1, 2]
    return sp.coo_array((values, (i, j)), shape=(int(places[-1, 0]), int(places[-1, 1])))
