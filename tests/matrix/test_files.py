"""Paths, standard input, and files that are no matrices."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import pickle
import sys
import tarfile
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from hypothesis import example, given, strategies as st

from handmade import lake, solid
from unassemble.errors import InputError, MatrixFileError, OutputError, UnassembleError
from unassemble.formats import FORMATS
from unassemble.matrix import check_matrix, load, read_matrix

A = sp.csr_array(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.0]]))


def market() -> bytes:
    content = io.BytesIO()
    scipy.io.mmwrite(content, A)
    return content.getvalue()


def gzipped(content: bytes) -> bytes:
    """Without the time, by which test processes would know different tests."""
    return gzip.compress(content, mtime=0)


def npz() -> bytes:
    content = io.BytesIO()
    sp.save_npz(content, A)
    return content.getvalue()


def mat(**options: Any) -> bytes:
    content = io.BytesIO()
    scipy.io.savemat(content, {"A": A.tocsc()}, **options)
    return content.getvalue()


def npy() -> bytes:
    content = io.BytesIO()
    np.save(content, A.toarray())
    return content.getvalue()


def tar() -> bytes:
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as file:
        file.addfile(tarfile.TarInfo("A/A.mtx"))
    return content.getvalue()


VALID = {
    "A.mtx": market(),
    "A.mtx.gz": gzipped(market()),
    "A.mtx.gz.gz": gzipped(gzipped(market())),
    "A.npz": npz(),
    "A.npz.gz": gzipped(npz()),
    "A.mat": mat(),
    "compressed.mat": mat(do_compression=True),
}


@pytest.mark.parametrize("name", sorted(VALID))
@pytest.mark.parametrize("as_path", [str, Path, os.fsencode])
def test_paths_of_every_type(name: str, as_path: Any, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(VALID[name])
    B = read_matrix(as_path(path))
    assert isinstance(B, sp.csr_array)
    assert (B.toarray() == A.toarray()).all()


@pytest.mark.parametrize("name", sorted(VALID))
def test_content_decides_and_not_the_name(name: str, tmp_path: Path) -> None:
    for other in ("A", "A.mtx", "A.npz", "A.mtx.gz", "A.txt", "A.png"):
        path = tmp_path / other
        path.write_bytes(VALID[name])
        assert (read_matrix(path).toarray() == A.toarray()).all()


@pytest.mark.parametrize("name", sorted(VALID))
def test_standard_input(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(VALID[name])))
    assert (read_matrix("-").toarray() == A.toarray()).all()


@pytest.mark.parametrize("name", sorted(VALID))
def test_pipes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    inlet, outlet = os.pipe()
    os.write(outlet, VALID[name])
    os.close(outlet)
    with open(inlet) as stdin:  # noqa: PTH123
        monkeypatch.setattr(sys, "stdin", stdin)
        assert (read_matrix("-").toarray() == A.toarray()).all()


def test_open_files(tmp_path: Path) -> None:
    (tmp_path / "A.mtx").write_bytes(VALID["A.mtx"])
    with (tmp_path / "A.mtx").open("rb") as file:
        assert (read_matrix(file).toarray() == A.toarray()).all()
    with (tmp_path / "A.mtx").open() as file:
        assert (read_matrix(file).toarray() == A.toarray()).all()
    stream = io.BytesIO(b"before" + VALID["A.npz"])
    stream.seek(6)
    assert (read_matrix(stream).toarray() == A.toarray()).all()


def test_text_from_standard_input_without_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(VALID["A.mtx"].decode()))
    assert read_matrix("-").nnz == A.nnz


def test_standard_input_that_fails(monkeypatch: pytest.MonkeyPatch, refused) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    refused(MatrixFileError, ("standard input", "empty"), read_matrix, "-")
    monkeypatch.setattr(sys, "stdin", io.StringIO("hello"))
    refused(MatrixFileError, ("standard input", "'hello'"), read_matrix, "-")
    monkeypatch.setattr(sys, "stdin", None)
    refused(MatrixFileError, ("standard input", "closed"), read_matrix, "-")

    def fail(*_: Any) -> bytes:
        raise OSError(5, "input/output error")

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(closed=False, seekable=lambda: False, read=fail))
    refused(MatrixFileError, ("standard input", "input/output error"), read_matrix, "-")


def test_endless_device(refused) -> None:
    if not Path("/dev/zero").exists():
        pytest.skip("no such device")
    refused(MatrixFileError, "binary file", read_matrix, "/dev/zero")


def test_paths_that_cannot_be_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused) -> None:
    refused(MatrixFileError, ("none.mtx", "cannot be opened: no such file"), read_matrix, tmp_path / "none.mtx")
    refused(MatrixFileError, "directory", read_matrix, tmp_path)
    refused(MatrixFileError, "cannot be opened", read_matrix, "")
    refused(MatrixFileError, "cannot be opened", read_matrix, "a\0b")
    refused(MatrixFileError, "cannot be opened", read_matrix, "n" * 300)
    (tmp_path / "A.mtx").write_bytes(VALID["A.mtx"])
    refused(MatrixFileError, "cannot be opened", read_matrix, tmp_path / "A.mtx" / "B.mtx")
    refused(InputError, "path", read_matrix, 7)
    monkeypatch.setattr(Path, "open", _forbidden)
    refused(MatrixFileError, "permission", read_matrix, tmp_path / "A.mtx")


def _forbidden(*_: Any, **__: Any) -> None:
    raise PermissionError(13, "Permission denied")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b" \n\t\n", "blanks"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "binary"),
        (b"\xff\xd8\xff\xe0" + bytes(100), "binary"),
        (b"%PDF-1.5\n%\xd0\xd4", "%%MatrixMarket"),
        (b"<!DOCTYPE html>\n<html>", "web page"),
        (b"\n <html><body>404", "web page"),
        (b'<?xml version="1.0"?><svg>', "XML"),
        (b"hello world\nthis is text", ("'hello world'", "%%MatrixMarket")),
        ("größe".encode("latin-1"), "%%MatrixMarket"),
        (b"%MatrixMarket matrix", "%%MatrixMarket"),
        (b"\x7fELF\x02\x01\x01" + bytes(100), "binary"),
        (bytes(2000), "binary"),
        (pickle.dumps(A), "pickle"),
        (pickle.dumps(A, 0), "pickle"),
        (tar(), "an archive"),
        (gzipped(tar()), "an archive"),
        (gzipped(b""), "is empty"),
        (gzipped(b"hello"), "'hello'"),
        (bz2.compress(market()), "compressed"),
        (lzma.compress(market()), "compressed"),
        (b"7z\xbc\xaf\x27\x1c" + bytes(9), "an archive"),
        (market().decode().encode("utf-16"), "UTF-16"),
        (b"\xfe\xff" + market().decode().encode("utf-16-be"), "UTF-16"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1", "git lfs pull"),
        (gzipped(market())[:-12], "truncated"),
        (gzipped(market())[:15], "truncated"),
        (gzipped(market())[:30] + b"\xff\xff" + gzipped(market())[32:], "damaged"),
        (gzipped(market())[:-8] + bytes(8), "damaged"),
        (b"\x1f\x8b", "damaged"),
        (b"\x1f\x8bnot gzip at all", "damaged"),
    ],
)
def test_foreign_and_damaged_files(content: bytes, words: tuple[str, ...] | str, tmp_path: Path, refused) -> None:
    path = tmp_path / "A.mtx"
    path.write_bytes(content)
    message = refused(MatrixFileError, words, read_matrix, path)
    assert str(path) in message


# Lines of numbers have no first word.
WORDLESS = (".avs", ".ugrid", ".svg")


@pytest.mark.parametrize(
    "suffix", [suffix for suffix, held in FORMATS.items() if held.name and not held.cannot and suffix not in WORDLESS]
)
def test_meshes_of_every_format_are_told_from_matrices(suffix, tmp_path, refused) -> None:
    kinds = FORMATS[suffix].cells
    mesh = lake() if "triangle" in kinds else solid("tetra" if "tetra" in kinds else "hexahedron")
    with suppress(OutputError):  # a package may be missing
        mesh.save(tmp_path / f"A{suffix}")
        refused(MatrixFileError, "is a mesh (", read_matrix, tmp_path / f"A{suffix}")


def test_variable_belongs_to_mat_files(refused) -> None:
    refused(InputError, ("Matrix Market", ".mat"), read_matrix, io.BytesIO(market()), variable="A")


def test_file_is_left_open_and_errors_have_causes() -> None:
    stream = io.BytesIO(market())
    read_matrix(stream)
    assert not stream.closed
    with pytest.raises(MatrixFileError) as caught:
        read_matrix(io.BytesIO(npz()[:40]))
    assert caught.value.__cause__ is not None


def test_too_large_for_the_memory(monkeypatch: pytest.MonkeyPatch, refused) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise MemoryError

    monkeypatch.setattr(np, "loadtxt", fail)
    refused(MatrixFileError, "more memory", read_matrix, io.BytesIO(market()))


def test_file_that_fails_while_it_is_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, refused) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise OSError(5, "input/output error")

    (tmp_path / "A.mtx").write_bytes(market())
    monkeypatch.setattr(np, "loadtxt", fail)
    refused(MatrixFileError, ("A.mtx", "input/output error"), read_matrix, tmp_path / "A.mtx")


def test_load_takes_files_and_matrices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "A.mtx").write_bytes(market())
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(market())))
    for source in (tmp_path / "A.mtx", str(tmp_path / "A.mtx"), io.BytesIO(market()), "-", A, A.toarray()):
        matrix = load(source)
        assert matrix.edges.tolist() == [[0, 1], [1, 2]]
        assert matrix.entries.tolist() == [-1.0, -0.5]
    assert load(io.BytesIO(mat()), variable="A", drop_zeros=0.4).n == 3


def _door(content: bytes) -> None:
    with suppress(UnassembleError):
        check_matrix(read_matrix(io.BytesIO(content)))


@given(st.binary(max_size=400))
@example(b"PK\x05\x06" + bytes(18))
def test_any_bytes_are_read_or_refused(content: bytes) -> None:
    _door(content)


STARTS = (
    b"PK\x03\x04",
    b"\x1f\x8b\x08",
    b"MATLAB 5".ljust(126) + b"IM",
    b"\2\0\0\0\1\0\0\0\3\0\0\0\0\0\0\0\2\0\0\0B\0",
    b"%%MatrixMarket ",
)


@given(st.sampled_from(STARTS), st.binary(max_size=400))
def test_any_bytes_after_a_good_start(start: bytes, content: bytes) -> None:
    _door(start + content)


@given(
    st.sampled_from(sorted(VALID)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 30), st.binary(max_size=8)), min_size=1, max_size=4),
)
def test_damaged_files_are_read_or_refused(name: str, damage: list[tuple[float, int, bytes]]) -> None:
    content = VALID[name]
    for where, cut, insert in damage:
        at = int(where * len(content))
        content = content[:at] + insert + content[at + cut :]
    _door(content)
    if name.endswith(".gz"):
        return
    _door(gzipped(content))
