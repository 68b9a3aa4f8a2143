"""Matrix Market files, read strictly.

numpy's text reader does the work, in blocks: the C++ reader of scipy (1.17) takes ``1.5D+02`` for 1.5,
ignores surplus columns, allocates what the header announces, and crashes on a zero byte.
Format: R. Boisvert, R. Pozo, K. Remington, The Matrix Market exchange formats, NISTIR 5935 (1996).
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixError, MatrixFileError
from ..words import count_of

_FIELDS = ("real", "double", "integer", "unsigned-integer", "complex", "pattern")
_SYMMETRIES = ("general", "symmetric", "skew-symmetric", "hermitian")
_DATA = re.compile(r"^[ \t\r]*[^%\s]", re.MULTILINE)  # a line with something in it
_FORTRAN = str.maketrans("Dd", "Ee")  # exponents of double precision


@dataclass(frozen=True)
class _Header:
    name: str  # of the file, for messages
    layout: str
    field: str
    symmetry: str
    rows: int
    columns: int
    count: int  # announced entries
    lines: int  # of the header

    @property
    def width(self) -> int:
        """Numbers on a line."""
        return (2 if self.layout == "coordinate" else 0) + (2 if self.field == "complex" else 1)

    def error(self, what: str) -> MatrixFileError:
        return MatrixFileError(f"{self.name} {what}")


def read_market(stream: BinaryIO, name: str) -> sp.coo_array:
    """Read a Matrix Market file, coordinate or array, of any symmetry.

    Parameters
    ----------
    stream : binary file
        At the banner.
    name : str
        What to call it in messages.

    Returns
    -------
    coo_array of float64 or complex128
        Both triangles where the file holds one. Explicit zeros and duplicates as they stand in a
        coordinate file; zeros of the dense array layout are left out.

    Raises
    ------
    MatrixFileError
        If the file does not keep to the format.
    MatrixError
        If it holds a pattern without numbers.
    """
    text = io.TextIOWrapper(stream, encoding="latin-1")
    try:
        header = _read_header(text, name)
        return _read_coordinates(text, header) if header.layout == "coordinate" else _read_array(text, header)
    finally:
        text.detach()


def _read_header(text: io.TextIOWrapper, name: str) -> _Header:
    banner = text.readline()
    words = banner.lower().split()[1:]
    if len(words) != 4 or words[0] != "matrix" or words[1] not in ("coordinate", "array"):
        raise MatrixFileError(
            f"{name} begins with {_clip(banner)}, but the first line of a Matrix Market file reads "
            "'%%MatrixMarket matrix coordinate real symmetric' or alike"
        )
    _, layout, field, symmetry = words
    if field not in _FIELDS or symmetry not in _SYMMETRIES:
        unknown, known = (field, _FIELDS) if field not in _FIELDS else (symmetry, _SYMMETRIES)
        raise MatrixFileError(f"{name} announces {unknown!r} in its first line, which is none of {', '.join(known)}")
    if field == "pattern":
        raise MatrixError(
            f"{name} holds a pattern only and no numbers (its first line says so): the shape of the mesh is in "
            "the numbers, so write the matrix with its values"
        )
    lines = 1
    for line in iter(text.readline, ""):
        lines += 1
        if _DATA.match(line):
            return _Header(name, layout, field, symmetry, *_sizes(line, layout, symmetry, name), lines)
    raise MatrixFileError(f"{name} ends before the line with the size of the matrix: it is truncated")


def _sizes(line: str, layout: str, symmetry: str, name: str) -> tuple[int, int, int]:
    words = line.split()
    parts = "rows, columns and entries" if layout == "coordinate" else "rows and columns"
    if len(words) != (3 if layout == "coordinate" else 2) or not all(re.fullmatch(r"\+?\d{1,18}", w) for w in words):
        raise MatrixFileError(f"{name} gives its size as {_clip(line)} instead of the numbers of {parts}")
    rows, columns = int(words[0]), int(words[1])
    if symmetry != "general" and rows != columns:
        raise MatrixFileError(f"{name} announces a {symmetry} matrix of {rows} rows and {columns} columns")
    if layout == "coordinate":
        return rows, columns, int(words[2])
    triangle = {"general": rows * columns, "skew-symmetric": rows * (rows - 1) // 2}
    return rows, columns, triangle.get(symmetry, rows * (rows + 1) // 2)


def _read_coordinates(text: io.TextIOWrapper, header: _Header) -> sp.coo_array:
    index = np.int32 if max(header.rows, header.columns) < 2**31 else np.int64
    parts: list[tuple[NDArray, NDArray, NDArray]] = []
    seen = 0
    for block in _blocks(text, header):
        _check_indices(block, header, seen)
        # float64 held the indices without loss: they are at most 10^18 by the header and exact below 2^53
        parts.append((block[:, 0].astype(index) - 1, block[:, 1].astype(index) - 1, _values(block[:, 2:], header)))
        seen += len(block)
    _check_count(seen, header)
    if not parts:
        return sp.coo_array((header.rows, header.columns))
    i, j, values = (np.concatenate(column) for column in zip(*parts, strict=True))
    return _mirrored(i, j, values, header)


def _check_indices(block: NDArray, header: _Header, seen: int) -> None:
    i, j = block[:, 0], block[:, 1]
    good = (i >= 1) & (i <= header.rows) & (j >= 1) & (j <= header.columns) & (i == np.floor(i)) & (j == np.floor(j))
    if not good.all():
        k = int(np.argmin(good))
        raise header.error(
            f"puts its entry number {seen + k + 1} at row {i[k]:.15g}, column {j[k]:.15g} of a matrix of {header.rows} "
            f"rows and {header.columns} columns, where both count from 1"
        )


def _mirrored(i: NDArray, j: NDArray, values: NDArray, header: _Header) -> sp.coo_array:
    shape = (header.rows, header.columns)
    if header.symmetry == "general":
        return sp.coo_array((values, (i, j)), shape=shape)
    _check_one_triangle(i, j, header)
    off = i != j
    other = {"skew-symmetric": np.negative, "hermitian": np.conjugate}.get(header.symmetry, np.array)(values[off])
    places = np.concatenate([i, j[off]]), np.concatenate([j, i[off]])
    return sp.coo_array((np.concatenate([values, other]), places), shape=shape)


def _check_one_triangle(i: NDArray, j: NDArray, header: _Header) -> None:
    """Refuse a pair stored on both sides: mirrored, it would count twice."""
    above = i < j
    below = i > j
    if header.rows >= 2**31 or not (above.any() and below.any()):  # keys of larger orders would overflow
        return
    key = np.minimum(i, j).astype(np.int64) * header.rows + np.maximum(i, j)
    both = np.intersect1d(key[above], key[below])
    if len(both):
        row, column = divmod(int(both[0]), header.rows)
        raise header.error(
            f"is announced as {header.symmetry} but holds the transpose of row {row + 1}, column {column + 1} as well: "
            "keep one triangle, or write 'general' in its first line"
        )


def _read_array(text: io.TextIOWrapper, header: _Header) -> sp.coo_array:
    parts = []
    seen = 0
    for block in _blocks(text, header):
        parts.append(_values(block, header))
        seen += len(block)
        if seen > header.count:
            break
    _check_count(seen, header)
    values = np.concatenate(parts) if parts else np.empty(0)
    k = np.flatnonzero(values)
    if header.symmetry == "general":
        j, i = np.divmod(k, max(header.rows, 1))
    else:  # columns of the lower triangle are rows of the upper one
        columns, rows = np.triu_indices(header.rows, 1 if header.symmetry == "skew-symmetric" else 0)
        i, j = rows[k], columns[k]
    return _mirrored(i, j, values[k], header)


def _values(columns: NDArray, header: _Header) -> NDArray:
    if header.field != "complex":
        return columns[:, 0].copy()
    values = np.empty(len(columns), dtype=np.complex128)
    values.real, values.imag = columns.T
    return values


def _check_count(seen: int, header: _Header) -> None:
    announced = count_of(header.count, "entry", "entries")
    if seen < header.count:
        raise header.error(f"announces {announced} and holds {seen}: it is truncated")
    if seen > header.count:
        raise header.error(f"announces {announced} and holds more: its size line is wrong")


def _blocks(text: io.TextIOWrapper, header: _Header) -> Iterator[NDArray[np.float64]]:
    """The numbers, as tables of `header.width` columns; stops beyond the announced count."""
    line = header.lines
    seen = 0
    size = 1 << 18  # characters; larger blocks are slower
    while seen <= header.count and (block := text.read(size)):
        block += text.readline()
        if _DATA.search(block):
            lines = (block.translate(_FORTRAN) if "D" in block or "d" in block else block).split("\n")
            try:
                table = _table(lines, header.width)
            except ValueError:
                raise _bad_line(block.split("\n"), lines, line, header) from None
            seen += len(table)
            yield table
        line += block.count("\n")


def _table(lines: list[str], width: int) -> NDArray[np.float64]:
    table = np.loadtxt(lines, comments="%", ndmin=2, encoding=None)
    if table.shape[1] != width:
        raise ValueError(f"{table.shape[1]} columns")
    return table


def _bad_line(shown: list[str], lines: list[str], line: int, header: _Header) -> MatrixFileError:
    """Find the first line that cannot be read, by bisection."""
    good, bad = 0, len(lines)  # the first `good` lines can be read, the first `bad` cannot
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if _readable(lines[:middle], header.width) else (good, middle)
    entry = "a number" if header.field != "complex" else "a real and an imaginary part"
    if header.layout == "coordinate":
        entry = f"a row, a column and {entry}"
    text = _clip(shown[bad - 1])
    return header.error(f"reads {text} in line {line + bad} instead of {entry}: it is truncated or damaged")


def _readable(lines: list[str], width: int) -> bool:
    if not _DATA.search("\n".join(lines)):
        return True
    try:
        _table(lines, width)
    except ValueError:
        return False
    return True


def _clip(line: str) -> str:
    line = line.strip()
    return repr(line if len(line) <= 60 else line[:57] + "...")
