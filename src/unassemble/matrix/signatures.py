"""What a file is, by its first bytes rather than by its name."""

import re

HEAD = 1024  # bytes that tell

_MARKET = b"%%matrixmarket"
_UTF8_MARK = b"\xef\xbb\xbf"

# What people hand over by mistake: (offset, bytes there, what it is and what to do).
_PICKLE = "is a Python pickle, which can run any code and is never loaded: save with scipy.sparse.save_npz"
_UTF16 = "is text in the encoding UTF-16: save it as ASCII or UTF-8"
_PACKED = "is compressed, or an archive: unpack it and pass the matrix file in it (compressed by gzip, if need be)"
_FOREIGN: tuple[tuple[int, bytes | tuple[bytes, ...], str], ...] = (
    (0, (b"\xff\xfe", b"\xfe\xff"), _UTF16),
    (0, (b"BZh", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf"), _PACKED),  # bzip2, xz, zstd, 7z
    (257, b"ustar", _PACKED),
    (0, b"version https://git-lfs", "is only a Git LFS pointer: fetch the file itself with 'git lfs pull'"),
    (0, (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"), _PICKLE),
    (0, (b"ccopy_reg\n", b"(dp0\n", b"(lp0\n", b"cscipy.sparse"), _PICKLE),
)
# Two row and column numbers and an entry, after comments at most.
_TRIPLET = re.compile(
    rb"\s*(?:[%#][^\n]*\n\s*)*[+]?\d+(?:\.\d*)?(?:[eE][+]?\d+)?[ \t,;]+[+]?\d+(?:\.\d*)?(?:[eE][+]?\d+)?[ \t,;]+"
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?[ \t]*\r?(?:\n|$)"
)
_HDF5 = b"\x89HDF\r\n\x1a\n"


def kind_of(head: bytes) -> str | None:
    """Which reader a file belongs to; None for none.

    ``"market"``, ``"gzip"``, ``"npz"``, ``"npy"``, ``"mat"`` (MATLAB 5 to 7), ``"hdf5"`` (MATLAB 7.3) or ``"triplets"``
    (lines of row, column and entry).
    """
    text = head.removeprefix(_UTF8_MARK)
    signs = {
        "market": text.lstrip()[: len(_MARKET)].lower() == _MARKET,
        "gzip": head.startswith(b"\x1f\x8b"),
        "npz": head.startswith((b"PK\x03\x04", b"PK\x05\x06")),
        "npy": head.startswith(b"\x93NUMPY"),
        "hdf5": head.startswith((_HDF5, b"MATLAB 7.3")) or head[512 : 512 + len(_HDF5)] == _HDF5,
        "mat": head.startswith(b"MATLAB 5") or head[124:128] in (b"\x00\x01IM", b"\x01\x00MI"),
        "triplets": _TRIPLET.match(text) is not None,
    }
    return next((kind for kind, shown in signs.items() if shown), None)


def foreign(head: bytes, suffix: str = "") -> str:
    """What a file is that no reader takes, and what to do, to follow the name of the file.

    Meshes are told by their names, where `suffix` is that of a mesh format; else it is empty.
    """
    if not head.strip():
        return "is empty, or holds nothing but blanks"
    for offset, magic, sentence in _FOREIGN:
        if head[offset:].startswith(magic):
            return sentence
    if suffix:
        return f"is a mesh ({suffix}), and a matrix is asked for: name the file of the matrix that was assembled on it"
    if b"\0" in head:
        return "is a binary file of unknown format, not Matrix Market, .npz, .npy or .mat (version 5 or later)"
    text = head.removeprefix(_UTF8_MARK).lstrip()
    if text[:5].lower() in (b"<!doc", b"<html", b"<?xml"):
        return "is a web page or XML, not a matrix: the download may have failed"
    first = text.splitlines()[0][:40].decode("ascii", "backslashreplace")
    return f"begins with {first!r} and not with '%%MatrixMarket': save it as Matrix Market, .npz (scipy) or .mat"
