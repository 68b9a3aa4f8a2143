"""Sparse variables of MATLAB files of versions 5 to 7.

Format: MathWorks, MAT-File Format (the document of that name, level 5). A file is a row of data elements, each
with a tag of type and length; a variable is an element that holds elements.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}


class _Element(IntEnum):
    """Types of data elements that are no numbers."""

    MATRIX = 14
    COMPRESSED = 15


class _Array(IntEnum):
    """Classes of arrays."""

    STRUCT = 2
    SPARSE = 5


class _Flag(IntFlag):
    LOGICAL = 2
    COMPLEX = 8


@dataclass(frozen=True, eq=False)
class Variable:
    """A variable of a MATLAB file."""

    name: str
    shape: tuple[int, ...]
    sparse: Any = None  # the value of a sparse variable, its index arrays still to be checked
    fields: tuple[Variable, ...] = ()  # of a structure with one element


def read_mat5(content: bytes) -> list[Variable]:
    """Find all variables; read the sparse ones, and those in structures of one element.

    Raises
    ------
    ValueError
        If the header makes no sense, or an element does not fit into the one that holds it.
    zlib.error
        If a compressed one is damaged.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise ValueError("the header does not tell the order of bytes")
    elements = _Elements(content, order, 128)
    variables = []
    while not elements.exhausted:
        kind, data = elements.take()
        if kind == _Element.COMPRESSED:
            kind, data = _unpacked(data, order)
        if kind == _Element.MATRIX:
            variables.append(_variable(_Elements(data, order)))
    return variables


class _Elements:
    """The data elements in a stretch of bytes, taken one by one."""

    def __init__(self, content: bytes | memoryview, order: str, start: int = 0):
        self._content = memoryview(content)
        self._at = start
        self.order = order

    @property
    def exhausted(self) -> bool:
        return self._at >= len(self._content)

    def take(self) -> tuple[int, memoryview]:
        """Type and content of the next element."""
        tag = self._slice(self._at, 8)
        word, size = struct.unpack(self.order + "2I", tag)
        if word >> 16:  # a small one, in the tag itself
            self._at += 8
            if word >> 16 > 4:
                raise ValueError("a small data element is too long")
            return word & 0xFFFF, tag[4 : 4 + (word >> 16)]
        data = self._slice(self._at + 8, size)
        padding = 0 if word == _Element.COMPRESSED else -size % 8
        self._at += 8 + size + padding
        return word, data

    def numbers(self) -> NDArray:
        """The next element as an array of numbers."""
        kind, data = self.take()
        if kind not in _NUMBERS:
            raise ValueError(f"a data element of type {kind} is found in the place of numbers")
        return np.frombuffer(data, self.order + _NUMBERS[kind]).astype(_NUMBERS[kind], copy=False)

    def text(self) -> str:
        """The next element as characters."""
        return bytes(self.take()[1]).decode("utf-8", "replace")

    def _slice(self, start: int, size: int) -> memoryview:
        if start + size > len(self._content):
            raise ValueError("a data element ends beyond the file")
        return self._content[start : start + size]


def _unpacked(data: memoryview, order: str) -> tuple[int, memoryview]:
    """The element in a compressed one; only its beginning, where that shows that it is of no use."""
    enough = 4096  # bytes
    beginning = zlib.decompressobj().decompress(data, enough)
    if len(beginning) < enough or _array_class(beginning, order) in (_Array.STRUCT, _Array.SPARSE):
        return _Elements(zlib.decompress(data), order).take()
    (kind,) = struct.unpack(order + "I", beginning[:4])
    return kind, memoryview(beginning)[8:]


def _array_class(beginning: bytes, order: str) -> int:
    """Class of an array from the beginning of its element: two tags come before the flags."""
    (flags,) = struct.unpack(order + "I", beginning[16:20])
    return int(flags & 0xFF)


def _variable(elements: _Elements) -> Variable:
    if elements.exhausted:  # an empty field of a structure
        return Variable("", (0, 0))
    flags = int(elements.numbers()[0])
    shape = tuple(int(size) for size in elements.numbers())
    name = elements.text()
    if flags & 0xFF == _Array.SPARSE and len(shape) == 2:
        return Variable(name, shape, sparse=_sparse(elements, shape, flags >> 8))
    if flags & 0xFF == _Array.STRUCT and shape == (1, 1):
        return Variable(name, shape, fields=tuple(_fields(elements)))
    return Variable(name, shape)


def _sparse(elements: _Elements, shape: tuple[int, ...], flags: int) -> Any:
    rows, starts = elements.numbers(), elements.numbers()
    # What a logical matrix stores is true; MATLAB announces its bytes as doubles.
    values = np.ones(len(rows), dtype=bool) if flags & _Flag.LOGICAL else elements.numbers()
    if flags & _Flag.COMPLEX:
        values = values + 1j * elements.numbers()
    if len(starts) != shape[1] + 1 or not 0 <= starts[-1] <= min(len(rows), len(values)):
        raise ValueError("the arrays of a sparse variable do not belong together")
    n_stored = int(starts[-1])  # more places may be reserved
    return sp.csc_array((values[:n_stored], _signed(rows[:n_stored]), _signed(starts)), shape=shape)


def _signed(index: NDArray) -> NDArray:
    """An index array in one of the types that scipy works with."""
    if index.dtype.kind not in "iu":
        raise ValueError("the indices of a sparse variable are not integers")
    return index.astype(np.int32 if index.dtype.itemsize <= 4 else np.int64, copy=False)


def _fields(elements: _Elements) -> list[Variable]:
    length = elements.numbers()
    names = bytes(elements.take()[1])
    if len(length) != 1 or length[0] < 1 or len(names) % length[0]:
        raise ValueError("the names of the fields of a structure have no length")
    width = int(length[0])
    fields = []
    for start in range(0, len(names), width):
        kind, data = elements.take()
        if kind != _Element.MATRIX:
            raise ValueError("a field of a structure is no array")
        value = _variable(_Elements(data, elements.order))
        name = names[start : start + width].split(b"\0")[0].decode("utf-8", "replace")
        fields.append(Variable(name, value.shape, value.sparse, value.fields))
    return fields
