"""MATLAB's files of versions 5 to 7.

The reader of scipy (1.17) ends the process by a segmentation fault on some damaged ones; the one here looks at every
length before it believes it. Format: MathWorks, MAT-File Format (the document of that name, level 5). A file is a row
of data elements, each with a tag of type and length; a variable is an element that holds elements.
"""

import struct
import zlib
from collections.abc import Iterator
from enum import IntEnum
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}

_Element = tuple[int, memoryview]  # type and content


class _Type(IntEnum):
    """Of data elements that are no numbers; and classes of arrays, and flags of theirs, that matter here."""

    MATRIX, COMPRESSED = 14, 15
    STRUCT, SPARSE = 2, 5
    LOGICAL, COMPLEX = 0x200, 0x800


def variables(content: bytes) -> Iterator[tuple[str, tuple[int, ...], Any]]:
    """Name, shape and, where it is sparse, the value of each variable of a file.

    Raises ValueError, zlib.error, struct.error if the file is truncated or damaged.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise ValueError("the header does not tell the order of bytes")
    for kind, data in _elements(memoryview(content)[128:], order):
        if kind == _Type.COMPRESSED:
            kind, data = next(_elements(memoryview(zlib.decompress(data)), order))
        if kind == _Type.MATRIX:
            yield from _variables(data, order)


def _elements(content: memoryview, order: str) -> Iterator[_Element]:
    """The data elements in a stretch of bytes."""
    at = 0
    while at < len(content):
        word, size = struct.unpack(order + "2I", content[at : at + 8])
        start, end = at + 8, at + 8 + size
        at = end if word == _Type.COMPRESSED else end + -size % 8
        if word >> 16:  # a small one, in the tag itself
            start, end, at = start - 4, start - 4 + (word >> 16), start
            if end > at:
                raise ValueError("a small data element is too long")
        if end > len(content):
            raise ValueError("a data element ends beyond the file")
        yield word & 0xFFFF if word >> 16 else word, content[start:end]


def _variables(data: memoryview, order: str, called: str = "") -> Iterator[tuple[str, tuple[int, ...], Any]]:
    """Name, shape and, where it is sparse, the value of a variable, and of the fields of one that is a structure."""
    elements = _elements(data, order)
    flags, shape, name = _numbers(elements, order), tuple(_numbers(elements, order).tolist()), _text(elements)
    kind, name = int(flags[0]) & 0xFF, called or name
    yield name, shape, _sparse(elements, order, shape, int(flags[0])) if kind == _Type.SPARSE else None
    if kind != _Type.STRUCT or shape != (1, 1):
        return
    width, names = _numbers(elements, order), _text(elements)
    if len(width) != 1 or width[0] < 1 or len(names) % width[0]:
        raise ValueError("the names of the fields of a structure have no length")
    for k in range(0, len(names), int(width[0])):
        kind, field = next(elements, (0, data))
        if kind != _Type.MATRIX:
            raise ValueError("a field of a structure is no array")
        if len(field):
            one = next(_variables(field, order, f"{name}.{names[k : k + int(width[0])].split(chr(0))[0]}"))
            yield from [one] if one[2] is not None else []


def _numbers(elements: Iterator[_Element], order: str) -> NDArray:
    """The next element as an array of numbers."""
    kind, data = next(elements, (0, memoryview(b"")))
    if kind not in _NUMBERS:
        raise ValueError(f"a data element of type {kind} is found in the place of numbers")
    return np.frombuffer(data, order + _NUMBERS[kind]).astype(_NUMBERS[kind], copy=False)


def _text(elements: Iterator[_Element]) -> str:
    return bytes(next(elements, (0, b""))[1]).decode("latin-1")


def _sparse(elements: Iterator[_Element], order: str, shape: tuple[int, ...], flags: int) -> Any:
    rows, starts = _numbers(elements, order), _numbers(elements, order)
    # What a logical matrix stores is true; MATLAB announces its bytes as doubles.
    values = np.ones(len(rows), dtype=bool) if flags & _Type.LOGICAL else _numbers(elements, order)
    if flags & _Type.COMPLEX:
        values = values + 1j * _numbers(elements, order)
    if rows.dtype.kind == "f" or starts.dtype.kind == "f":
        raise ValueError("the indices of a sparse variable are not integers")
    if len(starts) != shape[1] + 1 or not 0 <= starts[-1] <= min(len(rows), len(values)):
        raise ValueError("the arrays of a sparse variable do not belong together")
    rows, starts = (one.astype(np.int32 if one.dtype.itemsize <= 4 else np.int64) for one in (rows, starts))
    n_stored = int(starts[-1])  # more places may be reserved
    return sp.csc_array((values[:n_stored], rows[:n_stored], starts), shape=shape)
