"""Unknowns that follow those of masters: floors that are rigid in their plane, and rigid links."""

import numpy as np
import pytest
import scipy.sparse as sp
from built import error, frame, sound
from spoiled import constrained, storeys

from unassemble import RecoveryError, recover


@pytest.mark.parametrize("counts", [(2, 2, 3), (3, 2, 3), (3, 2, 4)])
@pytest.mark.parametrize("order", ["masters last", "masters first", "mixed", "by component"])
def test_a_building_is_no_plate(counts, order):
    """Its floors cover each other in plan, and heights are not in the matrix."""
    matrix, _ = storeys(counts, 1)
    n, masters = matrix.shape[0], 3 * (counts[2] - 1)
    rows = {
        "masters last": np.arange(n),
        "masters first": np.roll(np.arange(n), masters),
        "mixed": (3 * np.random.default_rng(0).permutation(n // 3)[:, None] + np.arange(3)).ravel(),
        "by component": np.arange(n).reshape(-1, 3).T.ravel(),
    }[order]
    try:
        found = recover(matrix[rows][:, rows])
    except RecoveryError:
        return
    assert found.status == "uncertified"


def test_the_reason_says_that_columns_are_not_short():
    matrix, _ = storeys((2, 2, 3), 1)
    found = recover(matrix)
    assert "lie in one place" in found.reason
    assert "columns" in found.reason
    assert "constraints" in found.advice


@pytest.mark.parametrize("seed", range(24))
def test_never_certified_without_heights(seed):
    """Floors of all shapes, some rigid and some not, clamped or not."""
    rng = np.random.default_rng(seed)
    counts = tuple(int(k) for k in rng.integers(2, 4, 3))
    given = frame(counts, seed, off=0.0 if seed % 3 else 0.3)
    level = np.round(given.points[:, 2] / 3)
    floors = [np.flatnonzero(level == k) for k in np.unique(level) if rng.random() < 0.8]
    if not floors:
        return
    matrix, true = constrained(given, [given.points[some].mean(axis=0) for some in floors], floors)
    try:
        found = recover(matrix)
    except RecoveryError:
        return
    if found.certified:
        assert found.points.shape[1] == 3
        assert sound(matrix, true)


@pytest.mark.parametrize("off", [0.0, 0.4])
def test_rigid_links_are_rigid(off):
    """All six unknowns of some nodes follow one node, and where that is comes back."""
    given = frame((3, 3, 3), off=off)
    linked = [0, 1, 3]
    master = given.points[linked].mean(axis=0) + [0.1, 0.2, 0.3]
    matrix, true = constrained(given, [master], [linked], directions=range(6))
    found = recover(matrix)
    assert found.certified
    assert error(found.points[found.node_of_row], true) < 1e-10


def test_a_hinge_has_no_length():
    """Two nodes in one place, joined by springs for each unknown: in space that is what the matrix says."""
    given = frame((3, 2, 2))
    n = len(given.points)
    matrix = sp.block_diag([given.matrix, frame((3, 2, 2), 1).matrix], format="csr")
    other = frame((3, 2, 2), 1).points
    other = other - other[0] + given.points[-1]
    last, first = 6 * (n - 1) + np.arange(6), 6 * n + np.arange(6)
    springs = np.repeat([1e8, 1e6], 3)
    for i, j, sign in ((last, last, 1), (first, first, 1), (last, first, -1), (first, last, -1)):
        matrix = matrix + sp.csr_array((sign * springs, (i, j)), shape=matrix.shape)
    found = recover(matrix)
    assert found.certified
    assert error(found.points, np.concatenate([given.points, other])) < 1e-10
