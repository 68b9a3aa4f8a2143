"""MATLAB files of versions 5 to 7, written by scipy."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.io.matlab
import scipy.sparse as sp
from hypothesis import given, strategies as st

from unassemble.errors import MatrixFileError
from unassemble.matrix import read_matrix

A = sp.csc_array(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1e-300]]))
VERSIONS = [{}, {"do_compression": True}]
SAMPLES = Path(scipy.io.matlab.__file__).parent / "tests" / "data"  # written by several versions of MATLAB


def mat(variables: dict[str, Any], **options: Any) -> io.BytesIO:
    content = io.BytesIO()
    scipy.io.savemat(content, variables, **options)
    return io.BytesIO(content.getvalue())


@pytest.mark.parametrize("options", VERSIONS)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(-4, 4)), max_size=20))
def test_round_trip_keeps_zeros_and_sums(options: dict[str, Any], entries: list[tuple[int, int, int]]) -> None:
    i, j, v = np.array(entries, dtype=np.int64).reshape(-1, 3).T
    B = sp.coo_array((v / 2, (i, j)), shape=(6, 6)).tocsc()
    C = read_matrix(mat({"x": 3.0, "B": B, "text": "yes"}, **options))
    assert (C.toarray() == B.toarray()).all()
    assert C.nnz == B.nnz
    assert C.has_canonical_format


@pytest.mark.parametrize("options", VERSIONS)
def test_types_of_entries(options: dict[str, Any]) -> None:
    B = read_matrix(mat({"B": A * (1 + 2j)}, **options))
    assert B.dtype == np.complex128
    assert (B.toarray() == (A * (1 + 2j)).toarray()).all()


@pytest.mark.parametrize("options", VERSIONS)
def test_logical_is_a_pattern(options: dict[str, Any]) -> None:
    assert read_matrix(mat({"B": A.astype(bool)}, **options)).dtype == np.bool_


@pytest.mark.parametrize("options", VERSIONS)
def test_suitesparse_problem_with_its_zeros(options: dict[str, Any]) -> None:
    zeros = sp.csc_array(([1.0, 1.0], ([0, 2], [2, 0])), shape=(3, 3))
    problem = {
        "title": "a mesh",
        "A": A,
        "Zeros": zeros,
        "b": sp.csc_array(np.ones((3, 1))),
        "id": 7.0,
        "aux": {"c": A},
    }
    B = read_matrix(mat({"Problem": problem}, **options))
    assert (B.toarray() == A.toarray()).all()
    assert B.nnz == A.nnz + 2
    assert 2 in B.indices[: B.indptr[1]]
    assert read_matrix(mat({"Problem": problem}, **options), variable="Problem.b").shape == (3, 1)


def test_choice_of_variable(refused) -> None:
    variables = {"A": A, "B": 2 * A, "rectangle": A[:2], "dense": np.eye(3)}
    message = refused(MatrixFileError, ("'A'", "'B'", "`variable=NAME`"), read_matrix, mat(variables))
    assert "dense" not in message
    assert read_matrix(mat(variables), variable="B")[0, 0] == 4
    refused(MatrixFileError, ("'C'", "'A' of size 3 x 3"), read_matrix, mat(variables), variable="C")
    refused(MatrixFileError, "'dense'", read_matrix, mat(variables), variable="dense")


def test_only_square_one_is_chosen() -> None:
    assert read_matrix(mat({"r": A[:2], "B": A, "s": A[:, :1]})).shape == (3, 3)
    assert read_matrix(mat({"r": A[:2]})).shape == (2, 3)


@pytest.mark.parametrize("options", VERSIONS)
@pytest.mark.parametrize("variables", [{"B": np.eye(3), "t": "text"}, {}])
def test_no_sparse_variable(variables: dict[str, Any], options: dict[str, Any], refused) -> None:
    words = "'B' of size 3 x 3" if variables else "nothing"
    refused(MatrixFileError, ("no sparse variable", words), read_matrix, mat(variables, **options))


@pytest.mark.parametrize("options", VERSIONS)
@pytest.mark.parametrize("cut", [1, 9, 20, 60])
def test_truncated(options: dict[str, Any], cut: int, refused) -> None:
    content = mat({"B": A}, **options).getvalue()
    refused(MatrixFileError, "truncated", read_matrix, io.BytesIO(content[:-cut]))


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<2I", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def by_hand(starts: list[int], rows: list[int], *, kind: int = 5, shape: tuple[int, int] = (2, 2)) -> io.BytesIO:
    """A version 5 file with one sparse variable of the given arrays."""
    parts = element(6, struct.pack("<2I", 5, 9)) + element(5, struct.pack("<2i", *shape)) + element(1, b"B")
    parts += element(kind, np.array(rows, "<i4").tobytes()) + element(5, np.array(starts, "<i4").tobytes())
    parts += element(9, np.ones(len(rows)).tobytes())
    return io.BytesIO(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element(14, parts))


def test_reserved_places_are_not_entries() -> None:
    assert read_matrix(by_hand([0, 1, 2], [1, 0, 77])).toarray().tolist() == [[0, 1], [1, 0]]


@pytest.mark.parametrize(
    "content",
    [
        by_hand([0, 1, 9], [1, 0]),
        by_hand([0, 1], [1, 0]),
        by_hand([0, 1, 2, 2], [1, 0]),
        by_hand([0, 1, -1], [1, 0]),
        by_hand([0, 2, 1], [1, 0]),
        by_hand([1, 1, 2], [1, 0]),
        by_hand([0, 1, 2], [1, 7]),
        by_hand([0, 1, 2], [1, -1]),
        by_hand([0, 1, 2], [1, 0], kind=9),
        by_hand([0, 1, 2], [1, 0], kind=14),
        by_hand([0, 1, 2], [1, 0], shape=(-2, 2)),
    ],
)
def test_damaged_arrays(content: io.BytesIO, refused) -> None:
    refused(MatrixFileError, "damaged", read_matrix, io.BytesIO(content.getvalue()))


def structure(width: int, names: bytes, *fields: bytes) -> io.BytesIO:
    """A version 5 file with one structure."""
    parts = element(6, struct.pack("<2I", 2, 0)) + element(5, struct.pack("<2i", 1, 1)) + element(1, b"S")
    parts += element(5, struct.pack("<i", width)) + element(1, names) + b"".join(fields)
    return io.BytesIO(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element(14, parts))


def test_empty_fields_and_elements_of_other_types_are_passed_over(refused) -> None:
    content = structure(4, b"A\0\0\0B\0\0\0", element(14, b""), element(14, b"")).getvalue()
    refused(MatrixFileError, "'S' of size 1 x 1", read_matrix, io.BytesIO(content + element(9, bytes(8))))
    assert read_matrix(io.BytesIO(content + by_hand([0, 1, 2], [1, 0]).getvalue()[128:])).shape == (2, 2)


@pytest.mark.parametrize(
    "content",
    [
        structure(0, b""),
        structure(3, b"A\0\0\0"),
        structure(4, b"A\0\0\0", element(9, bytes(8))),
        structure(4, b"A\0\0\0"),
        structure(4, b"A\0\0\0", struct.pack("<2I", 9 << 16 | 14, 0)),
    ],
)
def test_damaged_structures(content: io.BytesIO, refused) -> None:
    refused(MatrixFileError, "damaged", read_matrix, content)


def test_large_dense_variables_are_not_unpacked(refused) -> None:
    noise = np.random.default_rng(0).normal(size=(300, 300))
    content = mat({"first": noise, "B": A, "last": noise}, do_compression=True)
    assert (read_matrix(content).toarray() == A.toarray()).all()
    content = mat({"first": noise}, do_compression=True)
    refused(MatrixFileError, "'first' of size 300 x 300", read_matrix, content)


@pytest.mark.parametrize("path", sorted(SAMPLES.glob("testsparse*_[567]*.mat")), ids=lambda path: path.stem)
def test_files_of_matlab_agree_with_scipy(path: Path) -> None:
    for name, B in scipy.io.loadmat(path).items():
        if sp.issparse(B):
            C = read_matrix(path, variable=name)
            assert (C.toarray() == B.toarray()).all()
            assert C.nnz == B.nnz


def test_logical_file_of_matlab() -> None:
    path = SAMPLES / "logical_sparse.mat"
    if not path.exists():
        pytest.skip("scipy is installed without its tests")
    B = read_matrix(path)
    assert B.dtype == np.bool_
    assert (B.toarray() == (scipy.io.loadmat(path)["sp_log_5_4"].toarray() != 0)).all()
