"""What a file is, by its first bytes rather than by its name."""

from __future__ import annotations

import re
import struct

HEAD = 1024  # bytes that tell

_MARKET = b"%%matrixmarket"
_UTF8_MARK = b"\xef\xbb\xbf"

# What people hand over by mistake: (offset, bytes there, what it is and what to do).
_FOREIGN: tuple[tuple[int, bytes, str], ...] = (
    (0, b"\xff\xfe", "is text in the encoding UTF-16: save it as ASCII or UTF-8"),
    (0, b"\xfe\xff", "is text in the encoding UTF-16: save it as ASCII or UTF-8"),
    (0, b"BZh", "is compressed by bzip2: unpack it first, or use gzip"),
    (0, b"\xfd7zXZ", "is compressed by xz: unpack it first, or use gzip"),
    (0, b"\x28\xb5\x2f\xfd", "is compressed by zstd: unpack it first, or use gzip"),
    (0, b"7z\xbc\xaf", "is a 7z archive: unpack it and pass the matrix file in it"),
    (257, b"ustar", "is a tar archive: unpack it and pass the .mtx file in it"),
    (0, b"version https://git-lfs", "is only a Git LFS pointer: fetch the file itself with 'git lfs pull'"),
)
# Two row and column numbers and an entry, after comments at most.
_TRIPLET = re.compile(
    rb"\s*(?:[%#][^\n]*\n\s*)*[+]?\d+(?:\.\d*)?(?:[eE][+]?\d+)?[ \t,;]+[+]?\d+(?:\.\d*)?(?:[eE][+]?\d+)?[ \t,;]+"
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?[ \t]*\r?(?:\n|$)"
)
_HDF5 = b"\x89HDF\r\n\x1a\n"


def kind_of(head: bytes) -> str | None:
    """Which reader a file belongs to; None for none.

    ``"market"``, ``"gzip"``, ``"npz"``, ``"npy"``, ``"mat"`` (MATLAB 5 to 7), ``"mat4"``, ``"hdf5"`` (MATLAB 7.3) or
    ``"triplets"`` (lines of row, column and entry).
    """
    if head.removeprefix(_UTF8_MARK).lstrip()[: len(_MARKET)].lower() == _MARKET:
        return "market"
    if head.startswith(b"\x1f\x8b"):
        return "gzip"
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return "npz"
    if head.startswith(b"\x93NUMPY"):
        return "npy"
    if _is_hdf5(head):
        return "hdf5"
    if _is_mat5(head):
        return "mat"
    if _is_mat4(head):
        return "mat4"
    return "triplets" if _TRIPLET.match(head.removeprefix(_UTF8_MARK)) else None


def foreign(head: bytes, suffix: str = "") -> str:
    """What a file is that no reader takes, and what to do, to follow the name of the file.

    Meshes are told by their names, where `suffix` is that of a mesh format; else it is empty.
    """
    if not head:
        return "is empty"
    for offset, magic, sentence in _FOREIGN:
        if head[offset : offset + len(magic)] == magic:
            return sentence
    if _is_pickle(head):
        return "is a Python pickle, which can run any code and is never loaded: save with scipy.sparse.save_npz"
    if suffix:
        return f"is a mesh ({suffix}), and a matrix is asked for: name the file of the matrix that was assembled on it"
    if b"\0" in head or _is_hdf5(head):
        return "is a binary file of unknown format, not Matrix Market, .npz, .npy or .mat"
    text = head.removeprefix(_UTF8_MARK).lstrip()
    if not text:
        return "holds nothing but blanks"
    if text[:5].lower() in (b"<!doc", b"<html", b"<?xml"):
        return "is a web page or XML, not a matrix: the download may have failed"
    first = text.splitlines()[0][:40].decode("ascii", "backslashreplace")
    return f"begins with {first!r} and not with '%%MatrixMarket': save it as Matrix Market, .npz (scipy) or .mat"


def _is_hdf5(head: bytes) -> bool:
    return head.startswith((_HDF5, b"MATLAB 7.3")) or head[512 : 512 + len(_HDF5)] == _HDF5


def _is_mat5(head: bytes) -> bool:
    return head.startswith(b"MATLAB 5") or head[124:128] in (b"\x00\x01IM", b"\x01\x00MI")


def _is_mat4(head: bytes) -> bool:
    """Whether the first header of a MATLAB file of version 4 makes sense: type, sizes, and the length of a name."""
    if len(head) < 21:
        return False
    for order in "<>":
        kind, rows, columns, complex_, length = struct.unpack(order + "5i", head[:20])
        machine, zero, number, layout = kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10
        sensible = machine == (order == ">") and not zero and number <= 5 and layout <= 2 and complex_ in (0, 1)
        if sensible and rows >= 0 <= columns and 1 < length < 64 and head[20:21].isalpha():
            return True
    return False


def _is_pickle(head: bytes) -> bool:
    binary = head[:1] == b"\x80" and head[1:2] in (b"\x02", b"\x03", b"\x04", b"\x05")
    return binary or head.startswith((b"ccopy_reg\n", b"(dp0\n", b"(lp0\n", b"cscipy.sparse"))
