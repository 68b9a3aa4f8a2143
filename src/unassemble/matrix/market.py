"""Matrix Market, read strictly.

numpy's text reader does the work, in blocks: the C++ reader of scipy (1.17) takes ``1.5D+02`` for 1.5,
ignores surplus columns, allocates what the header announces, and crashes on a zero byte.
Format: R. Boisvert, R. Pozo, K. Remington, The Matrix Market exchange formats, NISTIR 5935 (1996).
"""

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
    """Read a Matrix Market file, coordinate or array, of any symmetry, float64 or complex128.

    Both triangles where the file holds one. Explicit zeros and duplicates as they stand in a coordinate file; zeros of
    the dense array layout are left out. `name` is what to call the file in messages.

    Raises MatrixFileError if the file does not keep to the format; MatrixError if it holds a pattern without numbers.
    """
    text = io.TextIOWrapper(stream, encoding="latin-1")
    try:
        header = _read_header(text, name)
        table = np.concatenate([np.empty((0, header.width)), *_blocks(text, header)])
    finally:
        text.detach()
    if len(table) != header.count:
        what = f"{len(table)}: it is truncated" if len(table) < header.count else "more: its size line is wrong"
        raise header.error(f"announces {count_of(header.count, 'entry', 'entries')} and holds {what}")
    values = table[:, -1]
    if header.field == "complex":
        values = np.ascontiguousarray(table[:, -2:]).view(np.complex128)[:, 0]
    if header.layout == "coordinate":
        return _mirrored(*_places(table, header), values, header)
    k = np.flatnonzero(values)
    if header.symmetry == "general":
        j, i = np.divmod(k, max(header.rows, 1))
    else:  # columns of the lower triangle are rows of the upper one
        i, j = (one[k] for one in np.triu_indices(header.rows, int(header.symmetry == "skew-symmetric"))[::-1])
    return _mirrored(i, j, values[k], header)


def _read_header(text: io.TextIOWrapper, name: str) -> _Header:
    banner = text.readline()
    words = banner.lower().split()[1:]
    known = (("matrix",), ("coordinate", "array"), _FIELDS, _SYMMETRIES)
    if len(words) != 4 or not all(word in some for word, some in zip(words, known, strict=True)):
        raise MatrixFileError(
            f"{name} begins with {_clip(banner)}, but the first line of a Matrix Market file reads "
            "'%%MatrixMarket matrix coordinate real symmetric' or alike"
        )
    _, layout, field, symmetry = words
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


def _blocks(text: io.TextIOWrapper, header: _Header) -> Iterator[NDArray[np.float64]]:
    """The numbers, as tables of `header.width` columns; stops beyond the announced count."""
    line, seen, size = header.lines, 0, 1 << 18  # characters; larger blocks are slower
    while seen <= header.count and (block := text.read(size)):
        block += text.readline()
        if _DATA.search(block):
            lines = (block.translate(_FORTRAN) if "D" in block or "d" in block else block).split("\n")
            table = _table(lines, header.width)
            if table is None:
                bad = next(k for k, one in enumerate(lines) if _DATA.match(one) and _table([one], header.width) is None)
                entry = "a number" if header.field != "complex" else "a real and an imaginary part"
                entry = f"a row, a column and {entry}" if header.layout == "coordinate" else entry
                said = f"reads {_clip(block.split(chr(10))[bad])} in line {line + bad + 1} instead of {entry}"
                raise header.error(f"{said}: it is truncated or damaged")
            seen += len(table)
            yield table
        line += block.count("\n")


def _table(lines: list[str], width: int) -> NDArray[np.float64] | None:
    """So many numbers in each of some lines; None where other things are."""
    try:
        table = np.loadtxt(lines, comments="%", ndmin=2, encoding=None)
    except ValueError:
        return None
    return table if table.shape[1] == width else None


def _places(table: NDArray, header: _Header) -> tuple[NDArray, NDArray]:
    """Rows and columns, from 0; float64 holds those up to 2^53 without loss."""
    i, j = table[:, 0], table[:, 1]
    good = (i >= 1) & (i <= header.rows) & (j >= 1) & (j <= header.columns) & (i == np.floor(i)) & (j == np.floor(j))
    if not good.all():
        k = int(np.argmin(good))
        raise header.error(
            f"puts its entry number {k + 1} at row {i[k]:.15g}, column {j[k]:.15g} of a matrix of {header.rows} "
            f"rows and {header.columns} columns, where both count from 1"
        )
    index = np.int32 if max(header.rows, header.columns) < 2**31 else np.int64
    return i.astype(index) - 1, j.astype(index) - 1


def _mirrored(i: NDArray, j: NDArray, values: NDArray, header: _Header) -> sp.coo_array:
    """Both triangles; a pair stored on both sides is refused, since it would count twice."""
    shape = (header.rows, header.columns)
    if header.symmetry == "general":
        return sp.coo_array((values, (i, j)), shape=shape)
    above, below = i < j, i > j
    if above.any() and below.any() and header.rows < 2**31:  # keys of larger orders would overflow
        key = np.minimum(i, j).astype(np.int64) * header.rows + np.maximum(i, j)
        both = np.intersect1d(key[above], key[below])
        if len(both):
            row, column = divmod(int(both[0]), header.rows)
            raise header.error(
                f"is announced as {header.symmetry} but holds the transpose of row {row + 1}, column {column + 1} as "
                "well: keep one triangle, or write 'general' in its first line"
            )
    off = above | below
    other = {"skew-symmetric": np.negative, "hermitian": np.conjugate}.get(header.symmetry, np.array)(values[off])
    places = np.concatenate([i, j[off]]), np.concatenate([j, i[off]])
    return sp.coo_array((np.concatenate([values, other]), places), shape=shape)


def _clip(line: str) -> str:
    line = line.strip()
    return repr(line if len(line) <= 60 else line[:57] + "...")
