"""Both triangles: averaged at rounding level, completed in structure, or the worst pair is named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, strategies as st

from unassemble.errors import MatrixError
from unassemble.matrix import check_matrix

A = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.0]])


def changed(*changes: tuple[int, int, float]) -> np.ndarray:
    B = A.copy()
    for i, j, value in changes:
        B[i, j] = value
    return B


def one_sided(value: float, place: tuple[int, int] = (0, 2)) -> sp.coo_array:
    """A with one more entry stored, its transpose not."""
    B = sp.coo_array(A)
    i, j = np.append(B.row, place[0]), np.append(B.col, place[1])
    return sp.coo_array((np.append(B.data, value), (i, j)), shape=(3, 3))


@pytest.mark.parametrize(
    ("B", "words"),
    [
        (changed((0, 1, -3.0)), ("row 0, column 1", "-3.0", "row 1, column 0", "-1.0")),
        (changed((0, 1, -3.0), (2, 1, -7.0)), ("row 1, column 2", "-0.5", "row 2, column 1", "-7.0")),
        (changed((0, 2, 1e-3)), ("row 0, column 2", "0.001", "not stored")),
        (changed((2, 0, 1e-3)), ("row 0, column 2", "0.001", "not stored")),
        (changed((0, 1, -1 - 2e-10)), ("row 0, column 1", "-1.0000000002")),
        (changed((0, 1, 1.0)), ("row 0, column 1", "1.0", "-1.0")),
        (np.array([[0.0, 1.0], [-1.0, 0.0]]), "not symmetric"),
    ],
)
@pytest.mark.parametrize("make", [np.array, sp.csr_array, sp.csc_array, sp.coo_array])
def test_largest_offending_pair_is_named(B: np.ndarray, words: tuple[str, ...], make: Any, refused) -> None:
    refused(MatrixError, ("not symmetric", *words) if isinstance(words, tuple) else words, check_matrix, make(B))


@pytest.mark.parametrize(("keep", "above"), [(np.triu, 1), (np.tril, -1)])
def test_one_triangle_only(keep: Any, above: int, refused) -> None:
    refused(MatrixError, "on one side of the diagonal", check_matrix, keep(A))
    refused(MatrixError, "on one side of the diagonal", check_matrix, keep(A, above))


@pytest.mark.parametrize("difference", [1e-16, 0.99e-12, 1.01e-12, 0.99e-10])
def test_rounding_is_averaged_and_reported_where_it_is_large(difference: float) -> None:
    B = 3 * A
    B[1, 2] += 3 * difference  # the largest entry of the two rows is 3
    matrix = check_matrix(B)
    assert matrix.entries[1] == pytest.approx((B[1, 2] + B[2, 1]) / 2, rel=2e-16)
    assert matrix.asymmetry == pytest.approx(abs(B[1, 2] - B[2, 1]) / 3, rel=1e-12)
    assert len(matrix.warnings) == (difference > 1e-12)
    for warning in matrix.warnings:
        assert "1 entry was averaged" in warning
        assert "(1 and 2)" in warning


def test_tolerance_is_relative_to_either_row() -> None:
    B = np.zeros((3, 3))
    B[0, 1] = B[1, 0] = 1.0
    B[1, 2], B[2, 1] = 1e-11, 2e-11  # large beside row 2, rounding beside row 1
    assert check_matrix(B).entries.tolist() == [1.0, 1.5e-11]


def test_diagonal_does_not_count() -> None:
    B = changed((0, 1, -1 - 1e-6), (0, 0, 1e20), (1, 1, 1e20))
    with pytest.raises(MatrixError, match="not symmetric"):
        check_matrix(B)


def test_noise_widens_the_tolerance(refused) -> None:
    B = changed((0, 1, -1.05))
    refused(MatrixError, "give their `noise`", check_matrix, B)
    message = refused(MatrixError, "not symmetric", check_matrix, B, noise=0.004)
    assert "give their `noise`" not in message
    matrix = check_matrix(B, noise=0.006)
    assert matrix.entries[0] == pytest.approx(-1.025)
    assert matrix.asymmetry == pytest.approx(0.05 / 1.05)
    assert "averaged" in matrix.warnings[0]


def test_small_noise_does_not_narrow_it() -> None:
    assert check_matrix(changed((0, 1, -1 - 5e-11)), noise=1e-20).asymmetry > 0
    assert check_matrix(changed((0, 1, -1 - 5e-11)), noise=0.0).asymmetry > 0


@pytest.mark.parametrize("place", [(0, 2), (2, 0)])
@pytest.mark.parametrize("value", [0.0, 1e-16, -4e-11])
@pytest.mark.parametrize("storage", ["coo", "csr", "csc", "lil"])
def test_small_one_sided_entries_become_structure(place: tuple[int, int], value: float, storage: str) -> None:
    matrix = check_matrix(one_sided(value, place).asformat(storage))
    assert matrix.edges.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert matrix.entries.tolist() == [-1.0, value / 2, -0.5]
    assert matrix.asymmetry == abs(value)
    assert "1 entry is stored on one side" in matrix.warnings[0]
    assert len(matrix.warnings) == (1 if abs(value) <= 1e-12 else 2)


def test_large_one_sided_entry_is_refused(refused) -> None:
    refused(MatrixError, ("row 2, column 0", "not stored", "0.25"), check_matrix, one_sided(0.25))
    assert check_matrix(one_sided(0.25), noise=0.1).entries[1] == 0.125


def test_one_sided_zero_may_be_dropped() -> None:
    assert check_matrix(one_sided(0.0), drop_zeros=1e-12).edges.tolist() == [[0, 1], [1, 2]]


def test_one_sided_entries_are_counted() -> None:
    n = 6
    B = sp.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[-1, 1]).tocoo()
    far = np.arange(n - 2)
    i, j = np.concatenate([B.row, far]), np.concatenate([B.col, far + 2])
    matrix = check_matrix(sp.coo_array((np.concatenate([B.data, np.zeros(n - 2)]), (i, j)), shape=(n, n)))
    assert len(matrix.edges) == 2 * n - 3
    assert f"{n - 2} entries are" in matrix.warnings[0]


ENTRIES = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(-3, 3)), min_size=1, max_size=30)


@given(ENTRIES, st.sampled_from(["coo", "csr", "csc"]))
def test_symmetric_structure_is_kept_whatever_the_values(entries: list[tuple[int, int, int]], storage: str) -> None:
    i, j, v = np.array(entries).T
    B = sp.coo_array((np.tile(v / 2, 2), (np.r_[i, j], np.r_[j, i])), shape=(6, 6)).asformat(storage)
    pairs = sorted({(min(a, b), max(a, b)) for a, b, _ in entries if a != b})
    values = [B.tocsr()[pair] for pair in pairs]
    if not any(values):
        with pytest.raises(MatrixError):
            check_matrix(B)
        return
    matrix = check_matrix(B)
    assert [tuple(edge) for edge in matrix.edges.tolist()] == pairs
    assert matrix.entries.tolist() == values
    assert matrix.asymmetry == 0


@given(ENTRIES)
def test_answer_is_symmetric_or_the_pair_named_is_not(entries: list[tuple[int, int, int]]) -> None:
    i, j, v = np.array(entries).T
    B = sp.coo_array((v / 2, (i, j)), shape=(6, 6)).tocsr()
    dense = B.toarray()
    try:
        matrix = check_matrix(B)
    except MatrixError as error:
        off = dense - np.diag(dense.diagonal())
        message = str(error)
        symmetric = (dense == dense.T).all()
        assert ("not symmetric" in message) == (not symmetric)
        assert symmetric <= (not off.any())
    else:
        # Rows of the identity and convection are not symmetric, and are said to be there.
        assert (dense == dense.T).all() or any("columns" in one or "symmetric part" in one for one in matrix.warnings)
        if (dense == dense.T).all():
            assert matrix.entries.tolist() == dense[tuple(matrix.edges.T)].tolist()
