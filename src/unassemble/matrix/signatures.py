"""What a file is, by its first bytes rather than by its name."""

from __future__ import annotations

HEAD = 1024  # bytes that tell

_MARKET = b"%%matrixmarket"
_UTF8_MARK = b"\xef\xbb\xbf"

# What people hand over by mistake: (offset, bytes there, what it is and what to do).
_FOREIGN: tuple[tuple[int, bytes, str], ...] = (
    (0, b"\x93NUMPY", "is a dense NumPy array (.npy): save the matrix with scipy.sparse.save_npz"),
    (0, b"\xff\xfe", "is text in the encoding UTF-16: save it as ASCII or UTF-8"),
    (0, b"\xfe\xff", "is text in the encoding UTF-16: save it as ASCII or UTF-8"),
    (0, b"BZh", "is compressed by bzip2: unpack it first, or use gzip"),
    (0, b"\xfd7zXZ", "is compressed by xz: unpack it first, or use gzip"),
    (0, b"\x28\xb5\x2f\xfd", "is compressed by zstd: unpack it first, or use gzip"),
    (0, b"7z\xbc\xaf", "is a 7z archive: unpack it and pass the matrix file in it"),
    (257, b"ustar", "is a tar archive: unpack it and pass the .mtx file in it"),
    (0, b"version https://git-lfs", "is only a Git LFS pointer: fetch the file itself with 'git lfs pull'"),
    (0, b"$MeshFormat", "is a Gmsh mesh, not a matrix"),
    (0, b"# vtk", "is a VTK mesh, not a matrix"),
)
_HDF5 = b"\x89HDF\r\n\x1a\n"


def kind_of(head: bytes) -> str | None:
    """Which reader a file belongs to: ``"market"``, ``"gzip"``, ``"npz"``, ``"mat"`` or None."""
    if head.removeprefix(_UTF8_MARK).lstrip()[: len(_MARKET)].lower() == _MARKET:
        return "market"
    if head.startswith(b"\x1f\x8b"):
        return "gzip"
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return "npz"
    if not _is_hdf5(head) and _is_mat5(head):
        return "mat"
    return None


def foreign(head: bytes) -> str:
    """What a file is that no reader takes, and what to do, to follow the name of the file."""
    if not head:
        return "is empty"
    if _is_hdf5(head):
        return (
            "is an HDF5 file (MATLAB writes these as version 7.3), which cannot be read here: in MATLAB, "
            "save the matrix again with save('file.mat', 'A', '-v7')"
        )
    for offset, magic, sentence in _FOREIGN:
        if head[offset : offset + len(magic)] == magic:
            return sentence
    if _is_pickle(head):
        return "is a Python pickle, which can run any code and is never loaded: save with scipy.sparse.save_npz"
    if b"\0" in head:
        return "is a binary file of unknown format, not Matrix Market, .npz or .mat"
    text = head.lstrip()
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


def _is_pickle(head: bytes) -> bool:
    binary = head[:1] == b"\x80" and head[1:2] in (b"\x02", b"\x03", b"\x04", b"\x05")
    return binary or head.startswith((b"ccopy_reg\n", b"(dp0\n", b"(lp0\n", b"cscipy.sparse"))
