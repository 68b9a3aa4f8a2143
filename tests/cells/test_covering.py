"""Lattices that hang together by single vertices: cells by an exact cover, and other meshes with the same matrix."""

from itertools import islice

import numpy as np
import pytest

from families import member
from meshes import specimen
from named_meshes import cells_of, explains
from unassemble import recover
from unassemble.cells.alternatives import regrouped
from unassemble.cells.alternatives.right_angles import RightAngle
from unassemble.cells.covers.consistent import Assembly
from unassemble.cells.covers.covering import likely_scales, read_by_cover
from unassemble.cells.covers.numbered import Numbered, frequent_numbers
from unassemble.cells.covers.program import Program
from unassemble.cells.covers.shapes import Shapes
from vanishing import forgotten, holes, squares


def graph(known):
    upper = known.matrix.tocoo()
    chosen = upper.row < upper.col
    edges = np.column_stack([upper.row[chosen], upper.col[chosen]]).astype(np.int64)
    order = np.lexsort(edges.T[::-1])
    return len(known.points), edges[order], -upper.data[chosen][order]


# Right isosceles triangles, whose right angles can be regrouped at some vertices.
@pytest.mark.parametrize("seed", [83, 91])
def test_other_meshes_of_a_lattice(seed):
    known, c = member("lattice", seed)
    found = recover(known.matrix)
    assert found.backward_error < 1e-12
    assert not found.certified
    cells = cells_of(found)
    assert explains(known.matrix, cells, c)
    assert found.alternatives
    for other in found.alternatives:
        gone = {tuple(sorted(cell)) for cell in other.cells}
        assert not gone & {tuple(sorted(cell)) for cell in other.other_cells}
        kept = [cell for cell in cells if tuple(sorted(cell)) not in gone]
        assert len(kept) == len(cells) - len(gone)
        assert explains(known.matrix, [*kept, *other.other_cells], c)


def test_another_mesh_that_is_not_tried_is_named(monkeypatch):
    monkeypatch.setattr(regrouped, "_MOST_VERTICES", 0)
    found = recover(member("lattice", 83)[0].matrix)
    assert not found.certified
    assert "which was not tried" in found.reason


@pytest.mark.parametrize("limit", ["_MOST_VERTICES", "_MOST_TRIALS"])
def test_the_rest_of_a_mesh_excludes_what_is_not_tried(limit, monkeypatch):
    """Between two holes right angles are opposite to each other, and might lie in the next quarters."""
    monkeypatch.setattr(regrouped, limit, 0)
    known = forgotten(specimen(*squares(holes(8, 5, (2, 2, 1, 1), (4, 2, 1, 1)), crossed=True)))
    found = recover(known.matrix)
    assert found.certified, found.reason


# In the second parts that could be put in another order about a vertex are joined by another piece as well.
@pytest.mark.parametrize("seed", [0, 19])
def test_a_lattice_without_another_mesh(seed):
    known, c = member("lattice", seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert found.scale == pytest.approx(c, rel=1e-9)


# Half rectangles at the boundary of the last ones: most edges have a half of their weight on either side.
@pytest.mark.parametrize(
    ("family", "seed"),
    [("lattice", 0), ("lattice", 70), ("lattice", 91), ("kites", 7), ("stairs", 1), ("stairs", 8), ("stairs", 11)],
)
def test_cover(family, seed):
    """Equilateral triangles, right isosceles ones, right angles of arbitrary legs about crosses, and rectangles."""
    known, c = member(family, seed)
    n, edges, weights = graph(known)
    shapes = Shapes.of(n, edges, 3000)
    assert min(abs(scale / c - 1) for scale in likely_scales(shapes, weights)) < 1e-9
    for scale in (None, c):
        reading = read_by_cover(n, edges, weights, scale)
        assert reading.fits
        solved = [mesh.scale for mesh in reading.meshes]
        assert solved == pytest.approx([c] * len(solved), rel=1e-6)


def test_nothing_covers_random_weights():
    known, _ = member("lattice", 0)
    n, edges, weights = graph(known)
    random = np.random.default_rng(0).uniform(0.2, 2, len(weights))
    assert read_by_cover(n, edges, random) is None
    assert read_by_cover(n, edges, random, 1.0) is None


def test_cells_with_their_numbers():
    """Squares in a grid: each side has the cotangent 1, and all angles add up to pi."""
    known = forgotten(specimen(*squares(holes(5, 4, (2, 2, 1, 1)))))
    n, edges, weights = graph(known)
    shapes = Shapes.of(n, edges, 3000)
    numbers = frequent_numbers(shapes, 2 * weights, 2)
    assert np.sort(numbers) == pytest.approx([0.5, 1.0])
    cells = Numbered.of(shapes, 2 * weights, np.tile(numbers, (len(edges), 1)))
    assert cells.angles.sum(axis=1) == pytest.approx(np.pi)
    program = Program(cells)
    chosen = program.solution(program.fans)
    assert (shapes.size[cells.cell[chosen]] == 4).all()
    assert len(chosen) == 19
    assert Assembly(cells).conflict(chosen) is None


def test_cells_that_are_no_mesh_together():
    """A square of a grid and two corners inside it: its wedges are taken twice."""
    known = forgotten(specimen(*squares(holes(2, 2))))
    n, edges, weights = graph(known)
    shapes = Shapes.of(n, edges, 3000)
    cells = Numbered.of(shapes, 2 * weights, np.ones((len(edges), 1)))
    quads = np.flatnonzero(shapes.size[cells.cell] == 4)
    inside = shapes.vertices[cells.cell]
    corners = np.flatnonzero(shapes.corner[cells.cell] & np.isin(inside[:, :3], inside[quads[0]]).all(axis=1))
    conflict = Assembly(cells).conflict(np.append(quads, corners[:1]))
    assert set(conflict.tolist()) == {quads[0], corners[0]}
    program = Program(cells)
    program.exclude(quads[:1])
    assert program.solution(program.fans) is None or quads[0] not in program.solution(program.fans)


def test_right_angles_at_a_hub_are_listed_one_after_the_other():
    """Of 300 squares that meet in one vertex there are 90,000 regroupings, of which the first is named."""
    corners = 300
    turn = np.exp(2j * np.pi * np.arange(corners) / corners)
    z = np.concatenate([[0], np.column_stack([turn, turn * (1 + 1j), turn * 1j]).ravel()])
    k = 1 + 3 * np.arange(corners)
    triangles = np.concatenate([np.column_stack([0 * k, k, k + 1]), np.column_stack([0 * k, k + 1, k + 2])])
    right = [RightAngle(0, int(a), int(a) + 2, 0.0, (0, int(a), int(a) + 1, int(a) + 2), ()) for a in k]
    some = regrouped._regroupings([right], 1e-9)
    assert len(list(islice(some, 10))) == 10
    found = recover(forgotten(specimen(np.column_stack([z.real, z.imag]), triangles)).matrix)
    assert not found.certified
    assert len(found.alternatives) == 1


def test_where_the_budget_for_regroupings_ends(monkeypatch):
    """What has not been looked at is said."""
    monkeypatch.setattr(regrouped, "_LISTED", 1e9)
    mask = np.zeros((4, 4), bool)
    mask[[0, 1, 2, 3], [0, 1, 2, 3]] = True
    found = recover(forgotten(specimen(*squares(mask))).matrix)
    assert not found.certified
