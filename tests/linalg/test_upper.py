"""The upper triangle that the solvers read."""

from __future__ import annotations

import numpy as np
import pytest

from unassemble.linalg import UpperTriangle

WHOLE = ([2.0, 1.0, 2.0, 3.0], [0, 2, 1, 2], [0, 2, 3, 4])


def test_a_whole_triangle():
    data, indices, indptr = WHOLE
    matrix = UpperTriangle(np.array(data), np.array(indices), np.array(indptr))
    assert matrix.full().toarray().tolist() == [[2, 0, 1], [0, 2, 0], [1, 0, 3]]
    assert UpperTriangle(np.empty(0), np.empty(0, int), np.zeros(1, int)).n == 0


@pytest.mark.parametrize(
    ("indices", "indptr", "row"),
    [
        ([0, 2, 2, 2], [0, 2, 3, 4], 1),
        ([0, 2, 1], [0, 2, 3, 3], 2),
        ([2, 0, 1, 2], [0, 2, 3, 4], 0),
        ([], [0, 0, 0], 0),
    ],
)
def test_a_row_without_its_diagonal_is_named(indices, indptr, row):
    """PARDISO would read beyond the row and crash."""
    with pytest.raises(ValueError, match=f"row {row} "):
        UpperTriangle(np.ones(len(indices)), np.array(indices, dtype=int), np.array(indptr))
