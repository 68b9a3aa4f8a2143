"""Four right angles about a vertex are known by their numbers, and the graph is drawn around them."""

import numpy as np
import pytest

from families import kites
from meshes import specimen
from unassemble import recover
from unassemble.cells.candidates.crosses import Crosses
from unassemble.topology.embedding import drawing_with_corners
from vanishing import forgotten, holes, squares, used


def read(known):
    upper = known.matrix.tocoo()
    chosen = upper.row < upper.col
    edges = np.column_stack([upper.row[chosen], upper.col[chosen]]).astype(np.int64)
    order = np.lexsort(edges.T[::-1])
    return edges[order], -upper.data[chosen][order]


def two_kites(step):
    """That share an edge; steps of the grid whose every other point is the middle of a kite."""
    x, y = (np.append(0, np.cumsum(steps)) for steps in step)
    a, b = (1, 1), (2, 2)
    number = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    triangles = []
    for i, j in (a, b):
        rim = [number[i + 1, j], number[i, j + 1], number[i - 1, j], number[i, j - 1]]
        triangles += [[number[i, j], rim[k], rim[(k + 1) % 4]] for k in range(4)]
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return used(points, np.array(triangles))


@pytest.mark.parametrize("c", [None, -2.5])
@pytest.mark.parametrize("seed", range(4))
def test_crosses_by_their_numbers(seed, c):
    known = forgotten(specimen(*kites(np.random.default_rng(seed)), c=-2.5, seed=seed))
    edges, weights = read(known)
    found = Crosses.of(len(known.points), edges, weights, c)
    assert found.scale == pytest.approx(-2.5, rel=1e-7)
    z = known.points @ [1, 1j]
    for hub, order in zip(found.hub[found.unique], found.order[found.unique], strict=True):
        turn = np.mod(np.angle((z[order] - z[hub]) / (z[order[0]] - z[hub])), 2 * np.pi)
        assert np.sort(turn) == pytest.approx(np.arange(4) * np.pi / 2, abs=1e-9)
        assert turn[2] == pytest.approx(np.pi)  # opposite
    drawing = drawing_with_corners(len(z), edges, found.wedges)
    assert drawing.is_sphere()


def test_equal_legs_leave_the_order_open():
    known = forgotten(specimen(*squares(holes(3, 3), crossed=True)))
    edges, weights = read(known)
    found = Crosses.of(len(known.points), edges, weights)
    assert found.scale == pytest.approx(1.0)
    assert len(found.hub) == 9 + 4  # the middles of the squares, and of the rectangles between these
    assert not found.unique.any()


@pytest.mark.parametrize("scale", [1.0, None])
def test_random_meshes_of_kites(scale):
    """Uneven steps determine the cells if c is known; equal factors of other readings do not occur by chance."""
    certified = 0
    for seed in (1, 5, 9, 10, 14, 15):
        known = forgotten(specimen(*kites(np.random.default_rng(seed)), seed=seed))
        found = recover(known.matrix, scale=scale)
        certified += found.certified
        assert found.certified or found.alternatives, found.reason
        assert found.certified or scale is None
    assert certified >= 4


@pytest.mark.parametrize("even", [True, False])
def test_two_kites_are_one_mesh_or_four(even):
    """As `exhaustive.all_meshes` counts them for c = 1, which takes a minute."""
    rng = np.random.default_rng(0)
    step = np.ones((2, 3)) if even else rng.uniform(0.5, 1.5, (2, 3))
    known = forgotten(specimen(*two_kites(step), seed=1))
    found = recover(known.matrix, scale=1.0)
    assert found.backward_error < 1e-12
    assert found.certified != even
    assert bool(found.alternatives) == even


def test_no_drawing_where_corners_contradict_each_other():
    star = np.array([[0, 1], [0, 2], [0, 3], [0, 4]])
    around = np.array([[1, 0, 2], [2, 0, 3], [3, 0, 4], [4, 0, 1]])
    assert drawing_with_corners(5, star, around).is_sphere()
    assert drawing_with_corners(5, star, np.array([[1, 0, 2], [1, 0, 3], [1, 0, 4]])) is None
