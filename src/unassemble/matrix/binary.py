"""Binary files: scipy's ``.npz``, numpy's ``.npy``, MATLAB's of versions 4 to 7.3; nothing is ever unpickled.

The reader of scipy (1.17) ends the process by a segmentation fault on some damaged MATLAB files of version 5; the one
here looks at every length before it believes it, and unpacks nothing but what may hold a sparse matrix. Format:
MathWorks, MAT-File Format (the document of that name, level 5). A file is a row of data elements, each with a tag of
type and length; a variable is an element that holds elements.
"""

import struct
import zlib
from collections.abc import Iterator
from enum import IntEnum
from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows, working_dtype

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}

_Element = tuple[int, memoryview]  # type and content


class _Type(IntEnum):
    """Of data elements that are no numbers; and classes of arrays, and flags of theirs, that matter here."""

    MATRIX, COMPRESSED = 14, 15
    STRUCT, SPARSE = 2, 5
    LOGICAL, COMPLEX = 0x200, 0x800


def read_npz(stream: BinaryIO, name: str) -> Any:
    """Read what ``scipy.sparse.save_npz`` has written, as stored; index arrays are still to be checked.

    `name` is what to call the file in messages.

    Raises MatrixFileError if it holds no sparse matrix, or Python objects; ValueError if arrays do not belong together.
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

    Raises MatrixFileError if it holds Python objects, or no matrix of numbers.
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


def read_mat(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file of versions 5 to 7; its index arrays are still to be checked.

    `name` is what to call the file in messages, and `variable` which one to read, such as ``"A"`` or ``"Problem.A"``;
    it is needed where several are sparse and square.

    Raises MatrixFileError if there is no sparse variable, or the choice is open; ValueError, zlib.error, struct.error
    if the file is truncated or damaged.
    """
    content = stream.read()
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise ValueError("the header does not tell the order of bytes")
    found: dict[str, Any] = {}
    others: dict[str, tuple[int, ...]] = {}
    for kind, data in _elements(memoryview(content)[128:], order):
        if kind == _Type.COMPRESSED:
            kind, data = _unpacked(data, order)
        if kind == _Type.MATRIX:
            for key, shape, A in _variables(data, order):
                others[key] = shape
                if A is not None:
                    found[key] = A
    return _chosen(found, others, name, variable)


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


def _unpacked(data: memoryview, order: str) -> _Element:
    """The element in a compressed one; only its beginning, where that shows that it is of no use."""
    enough = 4096  # bytes
    beginning = zlib.decompressobj().decompress(data, enough)
    # Two tags come before the flags.
    if len(beginning) < enough or beginning[16 if order == "<" else 19] in (_Type.STRUCT, _Type.SPARSE):
        return next(_elements(memoryview(zlib.decompress(data)), order))
    (kind,) = struct.unpack(order + "I", beginning[:4])
    return kind, memoryview(beginning)[8:]


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


def read_mat4(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read a matrix from a MATLAB file of version 4, dense or sparse; as :func:`read_mat`."""
    from scipy.io import loadmat

    held = {key: value for key, value in loadmat(stream).items() if not key.startswith("__")}
    found = {
        key: sp.coo_array(value)
        for key, value in held.items()
        if sp.issparse(value) or (value.ndim == 2 and value.dtype.kind in "biufc" and min(value.shape) > 1)
    }
    return _chosen(found, {key: value.shape for key, value in held.items()}, name, variable)


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
