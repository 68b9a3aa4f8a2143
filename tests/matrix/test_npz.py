"""Matrices of scipy.sparse.save_npz, and archives that are none."""

from __future__ import annotations

import io
import pickle
import zipfile
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, strategies as st

from unassemble.errors import InputError, MatrixFileError
from unassemble.matrix import read_matrix

CSR: dict[str, Any] = {
    "format": "csr",
    "shape": [2, 2],
    "data": np.array([1.0, 0.0, 3.0]),
    "indices": np.array([1, 0, 1]),
    "indptr": np.array([0, 1, 3]),
}
COO: dict[str, Any] = {"format": "coo", "shape": [2, 2], "data": np.ones(2), "row": [0, 1], "col": [1, 0]}
DIA: dict[str, Any] = {"format": "dia", "shape": [2, 2], "data": np.ones((1, 2)), "offsets": [0]}


def archive(arrays: dict[str, Any]) -> io.BytesIO:
    content = io.BytesIO()
    np.savez(content, **arrays)
    return io.BytesIO(content.getvalue())


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("array", [False, True])
@pytest.mark.parametrize("storage", ["coo", "csr", "csc", "bsr"])
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(-4, 4)), max_size=20))
def test_round_trip_keeps_zeros_and_sums(
    storage: str, array: bool, compressed: bool, entries: list[tuple[int, int, int]]
) -> None:
    i, j, v = np.array(entries, dtype=np.int64).reshape(-1, 3).T
    make = sp.coo_array if array else sp.coo_matrix
    A = make((v / 2, (i, j)), shape=(6, 6))
    A = A if storage == "coo" else A.asformat(storage)
    content = io.BytesIO()
    sp.save_npz(content, A, compressed=compressed)
    B = read_matrix(io.BytesIO(content.getvalue()))
    assert (B.toarray() == A.toarray()).all()
    assert B.has_canonical_format
    structure = set(zip(*(index.tolist() for index in A.tocoo().coords), strict=True))
    assert structure == set(zip(*(index.tolist() for index in B.tocoo().coords), strict=True))


def test_zeros_of_diagonal_storage_are_padding() -> None:
    content = io.BytesIO()
    sp.save_npz(content, sp.dia_array((np.array([[1.0, 0.0, 2.0]]), [0]), shape=(3, 3)))
    assert read_matrix(io.BytesIO(content.getvalue())).nnz == 2


@pytest.mark.parametrize("kind", ["<f4", ">f8", "<i8", "|u1", "<c8", "|b1"])
def test_types_of_entries(kind: str) -> None:
    A = read_matrix(archive(CSR | {"data": np.array([1, 0, 3]).astype(kind)}))
    expected = {"c": np.complex128, "b": np.bool_}.get(np.dtype(kind).kind, np.float64)
    assert A.dtype == expected
    assert A.data.tolist() == np.array([1, 0, 3]).astype(kind).tolist()
    assert A.indices.tolist() == [1, 0, 1]


@pytest.mark.parametrize("coordinates", ["coords", "row"])
def test_both_ways_of_coordinates(coordinates: str) -> None:
    arrays = COO if coordinates == "row" else {k: v for k, v in COO.items() if k not in ("row", "col")}
    arrays = arrays | ({"coords": np.array([[0, 1], [1, 0]])} if coordinates == "coords" else {})
    assert read_matrix(archive(arrays)).toarray().tolist() == [[0, 1], [1, 0]]


@pytest.mark.parametrize("key", sorted(CSR))
def test_missing_array(key: str, refused) -> None:
    arrays = {k: v for k, v in CSR.items() if k != key}
    refused(MatrixFileError, (), read_matrix, archive(arrays))


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        (CSR | {"format": "lil"}, ()),
        (CSR | {"format": 3}, ()),
        (CSR | {"shape": [2]}, ()),
        (CSR | {"shape": [2, -2]}, ()),
        (CSR | {"data": np.array(["a", "b", "c"])}, ()),
        (CSR | {"data": np.array([{}, 1, 2], dtype=object)}, ("damaged", "Object arrays")),
        (CSR | {"data": np.ones(2)}, "damaged"),
        (CSR | {"indices": np.array([0, 7, 1])}, "damaged"),
        (CSR | {"indices": np.array([0, -1, 1])}, "damaged"),
        (CSR | {"indptr": np.array([0, 3])}, "damaged"),
        (CSR | {"indptr": np.array([0, 9, 3])}, "damaged"),
        (CSR | {"indptr": np.array([0, 3, 0])}, "damaged"),
        (CSR | {"indptr": np.array([1, 1, 3])}, "damaged"),
        (CSR | {"indptr": np.array([0, 1, 2**40])}, "damaged"),
        (CSR | {"format": "csc", "indices": np.array([0, 7, 1])}, "damaged"),
        (CSR | {"format": "bsr", "data": np.ones((3, 1, 1)), "indices": np.array([0, 7, 1])}, "damaged"),
        (CSR | {"format": "bsr", "data": np.ones((3, 0, 1))}, "damaged"),
        (COO | {"row": [0, 5]}, "damaged"),
        (COO | {"row": [0]}, "damaged"),
        (DIA | {"offsets": [0, 0]}, "damaged"),
        ({"points": np.ones((3, 2)), "triangles": np.array([[0, 1, 2]])}, ("'points'", "'triangles'")),
        ({}, "nothing"),
    ],
)
def test_wrong_arrays(arrays: dict[str, Any], words: tuple[str, ...] | str, refused) -> None:
    refused(MatrixFileError, words, read_matrix, archive(arrays))


def test_zip_without_arrays(refused) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        file.writestr("A.mtx", "%%MatrixMarket")
    refused(MatrixFileError, "'A.mtx'", read_matrix, io.BytesIO(content.getvalue()))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_truncated(share: float, refused) -> None:
    content = archive(CSR).getvalue()
    refused(MatrixFileError, "truncated", read_matrix, io.BytesIO(content[: int(share * len(content))]))


def test_header_that_announces_terabytes(refused) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        for key, value in CSR.items():
            array = io.BytesIO()
            np.save(array, np.asarray(value))
            data = array.getvalue()
            if key == "data":
                data = data.replace(b"(3,), }" + 12 * b" ", b"(3000000000000,), }")
                assert b"000000" in data
            file.writestr(f"{key}.npy", data)
    refused(MatrixFileError, (), read_matrix, io.BytesIO(content.getvalue()))


class Bomb:
    """Ruins the test that unpickles it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, ("raise SystemExit('unpickled')",)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickles_are_never_loaded(protocol: int, refused) -> None:
    refused(MatrixFileError, (), read_matrix, io.BytesIO(pickle.dumps(Bomb(), protocol)))


def test_pickles_in_archives_are_never_loaded(refused) -> None:
    arrays = CSR | {"data": np.array([Bomb()] * 3, dtype=object)}
    refused(MatrixFileError, "Object arrays", read_matrix, archive(arrays))


def test_no_variables_to_choose_from(refused) -> None:
    refused(InputError, ".mat", read_matrix, archive(CSR), variable="A")
