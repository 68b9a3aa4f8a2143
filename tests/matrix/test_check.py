"""The checks at the door: every matrix becomes a weighted graph, or one sentence says why not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, strategies as st

from unassemble.errors import InputError, MatrixError
from unassemble.matrix import OperatorMatrix, check_matrix

FORMATS = ["coo", "csr", "csc", "bsr", "dia", "dok", "lil"]
PATH = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.0]])


def with_zero(value: float = 0.0) -> sp.coo_array:
    """PATH with both entries between rows 0 and 2 stored."""
    A = sp.coo_array(PATH)
    i, j = np.append(A.row, [0, 2]), np.append(A.col, [2, 0])
    return sp.coo_array((np.append(A.data, [value, value]), (i, j)), shape=(3, 3))


def assert_path(matrix: OperatorMatrix) -> None:
    assert matrix.n == 3
    assert matrix.edges.dtype == np.int64
    assert matrix.edges.tolist() == [[0, 1], [1, 2]]
    assert matrix.entries.dtype == matrix.diagonal.dtype == np.float64
    assert matrix.entries.tolist() == [-1.0, -0.5]
    assert matrix.diagonal.tolist() == [2.0, 2.0, 1.0]
    assert matrix.asymmetry == 0
    assert matrix.warnings == ()
    assert matrix.row_size.tolist() == [1.0, 1.0, 0.5]


@pytest.mark.parametrize("storage", FORMATS)
@pytest.mark.parametrize("make", [sp.coo_array, sp.coo_matrix])
def test_every_storage(storage: str, make: Any) -> None:
    A = make(PATH)
    assert_path(check_matrix(A.tobsr((1, 1)) if storage == "bsr" else A.asformat(storage)))


def test_zeros_in_blocks_are_structure() -> None:
    A = sp.coo_array(PATH).tobsr((3, 3))
    assert check_matrix(A).edges.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert check_matrix(A, drop_zeros=0).edges.tolist() == [[0, 1], [1, 2]]


@pytest.mark.parametrize("make", [np.array, np.asfortranarray, np.ndarray.tolist])
def test_dense(make: Any) -> None:
    assert_path(check_matrix(make(PATH)))


@pytest.mark.parametrize("kind", ["f2", "f4", ">f8", "g"])
def test_types_of_floating_point(kind: str) -> None:
    assert_path(check_matrix(PATH.astype(kind)))
    if kind in ("f4", "g"):  # scipy stores no others
        assert_path(check_matrix(sp.csr_array(PATH.astype(kind))))


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int64, np.uint64])
def test_types_of_integers(kind: type) -> None:
    A = np.array([[0, 3], [3, 1]], dtype=kind)
    for B in (A, sp.csr_array(A), sp.coo_array(A)):
        matrix = check_matrix(B)
        assert matrix.entries.tolist() == [3.0]
        assert matrix.diagonal.tolist() == [0.0, 1.0]


def test_integers_do_not_overflow() -> None:
    big = 2**62
    A = sp.coo_array((np.array([big, big, big, big, -big]), ([0, 0, 1, 1, 0], [1, 1, 0, 0, 0])), shape=(2, 2))
    assert check_matrix(A).entries.tolist() == [2.0**63]


@pytest.mark.parametrize("storage", ["coo", "csr", "csc", "bsr", "dok", "lil"])
@pytest.mark.parametrize("value", [0.0, -0.0])
def test_explicit_zeros_are_structure(storage: str, value: float) -> None:
    A = with_zero(value).asformat(storage)
    assert A.nnz == 9
    matrix = check_matrix(A)
    assert matrix.edges.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert matrix.entries.tolist() == [-1.0, 0.0, -0.5]


@pytest.mark.parametrize("storage", ["dia", "dense"])
def test_zeros_are_padding_where_every_place_is_stored(storage: str) -> None:
    A = with_zero()
    assert check_matrix(A.todia() if storage == "dia" else A.toarray()).edges.tolist() == [[0, 1], [1, 2]]


@pytest.mark.parametrize("storage", ["coo", "csr", "csc"])
def test_duplicates_are_summed_and_may_cancel(storage: str) -> None:
    i, j = [0, 0, 1, 1, 0, 2, 2, 0], [1, 1, 0, 0, 2, 0, 0, 2]
    v = [1.0, 2.0, 3.0, 0.0, 4.0, 1.0, -1.0, -4.0]
    if storage == "coo":
        A = sp.coo_array((v, (i, j)), shape=(3, 3))
    else:  # compressed, with the duplicates left in
        order = np.argsort(i, kind="stable")
        pointer = np.searchsorted(np.sort(i), np.arange(4))
        A = sp.csr_array((np.array(v)[order], np.array(j)[order], pointer), shape=(3, 3))
        A = A.T if storage == "csc" else A
    before = A.copy()
    matrix = check_matrix(A)
    assert matrix.edges.tolist() == [[0, 1], [0, 2]]
    assert matrix.entries.tolist() == [3.0, 0.0]
    assert A.nnz == before.nnz == 8
    assert (A.data == before.data).all()


def test_argument_is_not_changed_nor_needs_to_be_writable() -> None:
    A = sp.csr_array(PATH)
    A.indices = A.indices[[1, 0, 4, 2, 3, 6, 5]]
    A.data = A.data[[1, 0, 4, 2, 3, 6, 5]]
    copies = [a.copy() for a in (A.data, A.indices, A.indptr)]
    for array in (A.data, A.indices, A.indptr):
        array.flags.writeable = False
    assert_path(check_matrix(A))
    assert all((a == b).all() for a, b in zip((A.data, A.indices, A.indptr), copies, strict=True))


def test_reserved_places_are_not_entries() -> None:
    A = sp.csr_array(PATH)
    A.data, A.indices = np.append(A.data, [np.nan, 7.0]), np.append(A.indices, np.array([0, 99], A.indices.dtype))
    assert_path(check_matrix(A))


def test_isolated_rows_are_allowed() -> None:
    A = sp.block_diag([sp.csr_array(PATH), sp.csr_array((2, 2))]).tocsr()
    matrix = check_matrix(A)
    assert matrix.n == 5
    assert matrix.row_size.tolist() == [1.0, 1.0, 0.5, 0.0, 0.0]


@pytest.mark.parametrize(
    ("A", "words"),
    [
        (np.ones(3), ("two dimensions", "1")),
        (np.ones((2, 2, 2)), ("two dimensions", "3")),
        (np.float64(3), ("two dimensions", "0")),
        (sp.coo_array(np.ones(3)), "two dimensions"),
        (np.ones((2, 3)), ("not square", "2 rows", "3 columns")),
        (sp.csr_array((4, 3)), ("not square", "4 rows", "3 columns")),
        (np.empty((0, 0)), ("empty", "0 rows")),
        (sp.csr_array((0, 0)), "empty"),
        (PATH != 0, ("pattern", "bool", "no numbers")),
        (sp.csr_array(PATH != 0), ("pattern", "bool")),
        (PATH.astype(object), ("object", "numbers")),
        (np.array([["a", "b"], ["b", "a"]]), "numbers"),
        (None, "NoneType"),
        ([[1, 2], [3]], "list"),
        (np.diag([1.0, 2.0, 3.0]), ("diagonal", "lumped mass matrix")),
        (sp.csr_array((3, 3)), "diagonal"),
        (np.ones((1, 1)), "diagonal"),
        (sp.csr_array(([0.0, 0.0], ([0, 1], [1, 0])), shape=(2, 2)), ("off-diagonal entry is zero",)),
    ],
)
def test_refused(A: Any, words: tuple[str, ...] | str, refused) -> None:
    refused(MatrixError, words, check_matrix, A)


def test_sparse_objects(refused) -> None:
    A = sp.csr_array(PATH)
    A.data = A.data.astype(object)
    refused(MatrixError, ("object", "matrix of numbers"), check_matrix, A)


def test_coordinates_of_different_lengths(refused) -> None:
    A = sp.coo_array(PATH)
    A.data = A.data[:-1]
    refused(MatrixError, ("damaged", "length"), check_matrix, A)


def test_real_part_of_complex_matrices() -> None:
    A = PATH.astype(complex)
    assert check_matrix(A).warnings == ()
    assert_path(check_matrix(sp.csr_array(PATH.astype("c8"))))
    A[1, 2] += 3j
    matrix = check_matrix(sp.csc_array(A))
    assert matrix.entries.tolist() == [-1.0, -0.5]
    assert "row 1, column 2, for one, is -0.5+3j" in matrix.warnings[0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("storage", ["dense", "csr", "csc", "coo", "dia"])
def test_not_finite_names_the_first_place(value: float, storage: str, refused) -> None:
    A = PATH.copy()
    A[1, 2] = A[2, 1] = A[2, 2] = value
    B = A if storage == "dense" else sp.coo_array(A).asformat(storage)
    refused(MatrixError, ("row 1, column 2", str(value), "2 more"), check_matrix, B)
    A[2, 1], A[1, 2] = 0, 0
    message = refused(MatrixError, ("row 2, column 2", str(value)), check_matrix, A)
    assert "more" not in message


def test_sum_beyond_the_range_is_infinite(refused) -> None:
    A = sp.coo_array(([1e308, 1e308, 1.0], ([0, 0, 1], [1, 1, 0])), shape=(2, 2))
    refused(MatrixError, ("row 0, column 1", "inf"), check_matrix, A)


def test_long_double_beyond_the_range_is_infinite(refused) -> None:
    big = np.longdouble("1e4000")
    if not np.isfinite(big):
        pytest.skip("long double is double here")
    refused(MatrixError, ("row 0, column 1", "inf"), check_matrix, np.array([[0, big], [big, 0]]))


@pytest.mark.parametrize("scale", [1e-60, 1e60])
def test_extreme_scales(scale: float) -> None:
    A = scale * PATH
    matrix = check_matrix(A, drop_zeros=1e-12, noise=scale / 100)
    assert matrix.entries.tolist() == [A[0, 1], A[1, 2]]
    assert matrix.asymmetry == 0
    A[0, 1] *= 1 + 1e-14
    matrix = check_matrix(A)
    assert 0.9e-14 < matrix.asymmetry < 1.2e-14
    assert abs(matrix.entries[0] / A[1, 0] - 1) < 1e-14


@pytest.mark.parametrize("scale", [1e-320, 1e-300, 1e300, 8e307])
def test_scales_whose_products_overflow(scale: float, refused) -> None:
    refused(MatrixError, "multiply the matrix by a number", check_matrix, scale * PATH)


def test_extreme_scales_beside_each_other(refused) -> None:
    A = np.zeros((4, 4))
    A[0, 1] = A[1, 0] = 1e60
    A[2, 3] = A[3, 2] = 1e-60
    assert check_matrix(A, drop_zeros=1e-12).entries.tolist() == [1e60, 1e-60]
    A[3, 2] = 2e-60  # small beside the largest entry, not beside those of its own rows
    refused(MatrixError, ("row 2, column 3", "1e-60", "2e-60"), check_matrix, A)
    A[3, 2], A[0, 1] = 1e-60, -1.7e308
    A[1, 0] = 1.7e308
    refused(MatrixError, ("row 0, column 1", "-1.7e+308", "1.7e+308"), check_matrix, A)


@pytest.mark.parametrize("options", [{"drop_zeros": t} for t in (-1e-3, 1.0, np.nan, np.inf, True)])
def test_drop_zeros_out_of_range(options: dict[str, float], refused) -> None:
    refused(InputError, "drop_zeros", check_matrix, PATH, **options)


def test_drop_zeros_forgets_and_counts() -> None:
    A = with_zero(1e-14)
    assert len(check_matrix(A).edges) == 3
    assert len(check_matrix(A, drop_zeros=1e-15).edges) == 3
    matrix = check_matrix(A, drop_zeros=1e-12)
    assert matrix.edges.tolist() == [[0, 1], [1, 2]]
    assert len(matrix.warnings) == 1
    assert "1 of 3" in matrix.warnings[0]
    assert check_matrix(with_zero(), drop_zeros=0.0).edges.tolist() == [[0, 1], [1, 2]]
    assert check_matrix(PATH, drop_zeros=0.0).warnings == ()


def test_drop_zeros_looks_at_both_rows() -> None:
    # Between rows 1 and 2 stands an entry that is small for row 1 and the largest one of row 2.
    A = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 1e-13], [0.0, 1e-13, 0.0]])
    assert check_matrix(A, drop_zeros=1e-12).edges.tolist() == [[0, 1], [1, 2]]


def test_drop_zeros_keeps_the_diagonal() -> None:
    A = PATH.copy()
    A[0, 0] = 1e-30
    assert check_matrix(A, drop_zeros=1e-12).diagonal[0] == 1e-30


@pytest.mark.parametrize("storage", ["coo", "dok", "lil"])
def test_far_more_rows_than_entries(storage: str, refused) -> None:
    n = 10**9 if storage == "coo" else 10**5
    A = sp.coo_array(([1.0, 1.0], ([0, 1], [1, 0])), shape=(n, n)).asformat(storage)
    refused(MatrixError, (f"{n - 2} of the {n} rows", "no off-diagonal"), check_matrix, A)


@pytest.mark.parametrize(
    ("attribute", "value"),
    [
        ("indices", [0, 1, 0, 1, 2, 1, 9]),
        ("indices", [0, 1, 0, 1, 2, -1, 2]),
        ("indptr", [0, 5, 2, 7]),
        ("indptr", [0, 2, 5, 70]),
        ("indptr", [1, 2, 5, 7]),
        ("indptr", [0, 2, 7]),
    ],
)
def test_index_arrays_that_would_crash(attribute: str, value: list[int], refused) -> None:
    A = sp.csr_array(PATH)
    setattr(A, attribute, np.array(value, dtype=np.int32))
    refused(MatrixError, "damaged", check_matrix, A)


def test_coordinates_that_would_crash(refused) -> None:
    A = sp.coo_array(PATH)
    A.row[3] = 77
    refused(MatrixError, ("damaged", "77"), check_matrix, A)


@given(st.permutations(range(5)), st.integers(0, 2**32 - 1))
def test_rows_in_any_order(order: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.integers(-3, 4, (5, 5)).astype(float)
    A += A.T
    A[0, 1] = A[1, 0] = 1.0
    matrix = check_matrix(A[np.ix_(order, order)])
    p = np.array(order)
    assert matrix.diagonal.tolist() == A.diagonal()[p].tolist()
    assert matrix.entries.tolist() == A[p[matrix.edges[:, 0]], p[matrix.edges[:, 1]]].tolist()
    assert len(matrix.edges) == np.count_nonzero(np.triu(A, 1))
    assert matrix.edges.tolist() == sorted(matrix.edges.tolist())
