"""Structures and bodies whose element matrices are CALFEM's (Lund University): certified and right."""

import importlib

import numpy as np
import pytest
import scipy.sparse as sp
from as_given import supported, written
from built import SPACE, Built, cells_of, error, grid, sound
from scipy.spatial.distance import pdist

from unassemble import recover

calfem = pytest.importorskip("calfem.core")
importlib.import_module("calfem.matrix_compat").restore_numpy_matrix()  # it puts a class of its own in numpy
pytestmark = pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")


def added(points, cells, element, block, unknowns):
    """Element matrices of cells (m, k), added up; `element` is called with the corners of a cell and its number."""
    rows, columns, values = [], [], []
    for k, nodes in enumerate(cells):
        dofs = (block * np.asarray(nodes)[:, None] + np.arange(block)).ravel()
        rows.append(np.repeat(dofs, len(dofs)))
        columns.append(np.tile(dofs, len(dofs)))
        values.append(np.asarray(element(points[nodes], k)).ravel())
    order = block * len(points)
    matrix = sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (order, order))
    pairs = np.asarray(cells) if len(cells[0]) == 2 else np.empty((0, 2), np.int64)
    return Built((matrix + matrix.T) / 2, points, pairs, tuple(unknowns))


def out_of_plumb(counts, seed=0, off=0.4):
    points, ends = grid(counts)
    return 3 * points + np.random.default_rng(seed).uniform(-off, off, points.shape), ends


def section(k):
    factor = 1 + (k % 7) / 5
    return 1e-2 * factor, 1e-4 * factor, 2e-4 * factor


def frame():
    points, ends = out_of_plumb((4, 3, 3))

    def beam(ends_, k):
        area, one, other = section(k)
        return calfem.beam3e(*ends_.T, np.array([0.3, 0.5, 0.8]), [200e9, 77e9, area, one, other, 2.5e-4])

    return added(points, ends, beam, 6, SPACE)


def plane_frame():
    points, ends = out_of_plumb((5, 4))
    return added(points, ends, lambda x, k: calfem.beam2e(*x.T, [200e9, *section(k)[:2]]), 3, (0, 1, 5))


def stiff_in_shear():
    """Timoshenko's beams."""
    points, ends = out_of_plumb((5, 4))
    return added(points, ends, lambda x, k: calfem.beam2te(*x.T, [200e9, 77e9, *section(k)[:2], 5 / 6]), 3, (0, 1, 5))


def plate():
    """Rectangles of different sizes."""
    x, y = np.cumsum([1, 1.3, 0.8, 1.1, 1.2, 0.9, 1.4]), np.cumsum([0.7, 1.0, 1.2, 0.9, 1.1, 1.3])
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    D = calfem.hooke(1, 200e9, 0.3)
    return added(points, cells_of((7, 6)), lambda at, k: calfem.platre(*at.T, [0.1], D), 3, (2, 3, 4))


def panels_in_a_frame():
    """A plane frame whose bays are filled by membranes, which hold no rotation."""
    points, _ = out_of_plumb((5, 4))
    D = calfem.hooke(1, 30e9, 0.2)

    def membrane(at, k):
        full = np.zeros((12, 12))
        moves = [0, 1, 3, 4, 6, 7, 9, 10]
        full[np.ix_(moves, moves)] = calfem.planqe(*at.T, [1, 0.05], D)
        return full

    beams, filling = plane_frame(), added(points, cells_of((5, 4)), membrane, 3, (0, 1, 5))
    return Built(sp.csr_array(beams.matrix + filling.matrix), points, beams.members, beams.unknowns)


MAKE = [frame, plane_frame, stiff_in_shear, plate]


@pytest.mark.parametrize("make", MAKE, ids=lambda make: make.__name__)
@pytest.mark.parametrize("how", ["none", "removed", "identity", "penalty", "condensed"])
@pytest.mark.parametrize("digits", [8, 16])
def test_certified_and_right(make, how, digits):
    matrix, true = supported(make().permuted(2), how)
    noise = np.random.default_rng(3).standard_normal(matrix.nnz)
    matrix = sp.csr_array(matrix)
    matrix.data = matrix.data * (1 + 1e-15 * noise)
    assert sound(written((matrix + matrix.T) / 2, digits), true)


def test_panels_in_a_frame():
    """Whose rows are whose is not certain there, unless it is said."""
    given = panels_in_a_frame().permuted(2)
    true = np.repeat(given.points, 3, axis=0)
    assert not sound(given.matrix, true)
    rows = np.arange(len(true))
    assert sound(given.matrix, true, numbering=(rows // 3, rows % 3))


def test_a_truss():
    points, _ = out_of_plumb((3, 3, 4))
    near = np.argwhere(np.triu(np.linalg.norm(points[:, None] - points, axis=2) < 4.8, 1))
    given = added(points, near, lambda x, k: calfem.bar3e(*x.T, [200e9, section(k)[0]]), 3, range(3)).permuted(1)
    found = recover(given.matrix)
    assert found.certified
    assert found.operator == "truss"
    assert error(found.points, given.points, scaled=True) < 1e-11


@pytest.mark.parametrize("held", [False, True])
def test_bodies(held):
    """Bricks in space, and triangles in plane strain, rows at random."""
    rng = np.random.default_rng(4)
    lattice, _ = grid((4, 4, 5))
    place = np.arange(80).reshape(4, 4, 5)
    low = np.stack([place[:-1, :-1, :-1], place[1:, :-1, :-1], place[1:, 1:, :-1], place[:-1, 1:, :-1]], -1).reshape(
        -1, 4
    )
    D = calfem.hooke(4, 200e9, 0.3)
    bricks = added(
        lattice + rng.uniform(-0.15, 0.15, lattice.shape),
        np.hstack([low, low + 1]),
        lambda x, k: calfem.soli8e(*x.T, [2], D),
        3,
        range(3),
    )
    flat, _ = grid((7, 6))
    corners = cells_of((7, 6))
    plane = calfem.hooke(2, 200e9, 0.3)[np.ix_([0, 1, 3], [0, 1, 3])]
    triangles = added(
        flat + rng.uniform(-0.2, 0.2, flat.shape),
        np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]),
        lambda x, k: calfem.plante(*x.T, [2, 1.0], plane),
        2,
        range(2),
    )
    for given in (bricks, triangles):
        given = given.clamped(given.points[:, -1] < 0.5) if held else given
        order = rng.permutation(given.matrix.shape[0])
        found = recover(given.matrix[order][:, order])
        assert found.certified, found.reason
        assert found.operator == "elasticity"
        node = order // given.block
        known = found.node_status[found.node_of_row] == 0
        placed, true = found.points[found.node_of_row[known]], given.points[node[known]]
        apart, wanted = (pdist(points) for points in (placed, true))  # which axis is which, rows at random do not tell
        assert np.abs(apart * (wanted.sum() / apart.sum()) - wanted).max() < 1e-8
