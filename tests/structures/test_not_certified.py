"""What the gallery says of famous matrices that are not certified, counted and measured here without the library."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

CLASSICS = Path(__file__).resolve().parents[3] / "shared" / "classics"


def matrix(name):
    path = CLASSICS / f"{name}.mtx.gz"
    if not path.exists():
        pytest.skip("the classics are not here")
    return sp.csr_array(scipy.io.mmread(path))


def forces(A, moved):
    """Forces under displacements (N, k), relative to the terms that they are sums of."""
    return np.abs(A @ moved) / np.maximum(abs(A) @ np.abs(moved), np.finfo(float).tiny)


def polar(direction, angle, radial, tangential):
    """Both translations across an axis, along axes turned by an angle for each row."""
    turn = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.where((direction == radial)[:, None], turn, 0) + np.where(
        (direction == tangential)[:, None], turn[:, ::-1] * [-1, 1], 0
    )


def test_a_washer_in_polar_axes():
    """bcsstk10: 37 rays of six nodes, of which the first and the last have three unknowns."""
    A = matrix("bcsstk10")
    ray = np.concatenate([np.zeros(18, int), 1 + np.arange(1050) // 30, np.full(18, 36)])
    direction = np.concatenate([np.tile([0, 2, 3], 6), np.tile(np.arange(5), 210), np.tile([0, 2, 3], 6)])
    inside = (direction < 2) & (ray > 1) & (ray < 35)
    along = {step: np.median(forces(A, polar(direction, np.radians(-step * ray), 0, 1))[inside]) for step in (0, 5)}
    assert along[5] < 1e-12
    assert along[0] > 1e-6


def test_a_cylinder_in_polar_axes():
    """bcsstk34: rings of ten nodes, beginning with a node and both beside it; all other nodes are alike."""
    A = matrix("bcsstk34")
    start = 24 + 6 * np.arange(80)
    blocks = A.diagonal()[24 : 24 + 6 * 80].reshape(80, 6)
    assert np.ptp(blocks / blocks[0], axis=0).max() < 1e-5
    for ring in range(1, 7):
        rings = 10 * np.arange(ring - 1, ring + 2)
        place = np.full((80, 6), 0.0)
        near = np.zeros((80, 6), dtype=bool)
        for k, turn in enumerate((0, 1, -1)):
            place[rings + k], near[rings + k] = turn, True
        columns = np.flatnonzero(np.append(np.zeros(24, bool), np.append(near.ravel(), np.zeros(84, bool))))
        own = A[start[10 * ring] + np.arange(6)]
        assert abs(own).sum() == abs(own[:, columns]).sum()
        direction, angle = np.tile(np.arange(6), 9), np.radians(-36 * place[near])
        assert forces(own[:, columns], polar(direction, angle, 0, 1)).max() < 1e-7
        assert forces(own[:, columns], polar(direction, 0 * angle, 0, 1)).max() > 0.1


def test_floors_that_move_as_a_whole():
    """bcsstk08: seven floors of three unknowns; the other nodes have none of these."""
    A = matrix("bcsstk08").toarray()
    floors = np.array([3, 180, 491, 548, 591, 640, 967])
    degree = np.count_nonzero(A, axis=1) - 1
    assert np.sort((floors[:, None] + np.arange(3)).ravel()).tolist() == np.flatnonzero(degree >= 43).tolist()
    for k in range(2):
        columns = A[:, floors + k]
        several = np.count_nonzero(columns, axis=1) > 1
        still = np.abs(columns.sum(axis=1)) < 1e-9 * np.abs(columns).sum(axis=1)
        assert still[several].mean() > 0.6


def test_damage():
    """nasa1824: a run of twenty diagonals is next to nothing."""
    A = matrix("nasa1824").toarray()
    assert np.flatnonzero(np.diag(A) < 1e-5).tolist() == list(range(196, 216))
    assert np.count_nonzero(np.linalg.eigvalsh(A) < -1) == 20


def test_initial_stresses():
    """bcsstm10: negative eigenvalues."""
    A = matrix("bcsstm10").toarray()
    assert np.count_nonzero(np.linalg.eigvalsh(A) < -1) > 10


def test_single_precision():
    """lund_a: what should be zero is a multiple of a power of two, and equal entries differ in the last of 24 bits."""
    A = matrix("lund_a")
    small = np.abs(A.data[np.abs(A.data) < 1e-3])
    small = small[small > 0] * 2.0**13
    assert len(small) > 10
    assert np.abs(small - np.round(small)).max() < 1e-6
    equal = A.diagonal()[np.isclose(A.diagonal(), 7.5e7, rtol=1e-5)]
    assert len(equal) > 10
    assert np.unique(np.diff(np.sort(equal)).round()).tolist() == [0, 16, 32]
