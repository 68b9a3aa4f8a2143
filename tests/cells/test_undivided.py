"""Cells are written as they are, not as they were found."""

from dataclasses import replace

import numpy as np

from meshes import specimen
from unassemble import recover
from unassemble.cells import undivided
from unassemble.scalar import joined
from unassemble.topology import surfaces
from vanishing import forgotten, squares


def test_triangles_that_share_vanished_sides_become_one_polygon():
    triangles = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (3, 5, 4), (5, 6, 4)])
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    pieces = surfaces(7, edges).pieces
    vanished = np.isin(edges @ [10, 1], [2, 3, 45])
    lone, polygons = undivided(pieces, vanished)
    assert not len(lone)
    found = {frozenset(part.tolist()) for part in np.split(polygons.vertices, polygons.offsets[1:-1])}
    assert found == {frozenset({0, 1, 2, 3, 4}), frozenset({3, 4, 5, 6})}
    for part in np.split(polygons.vertices, polygons.offsets[1:-1]):
        sides = {tuple(sorted(side)) for side in zip(part.tolist(), np.roll(part, -1).tolist(), strict=True)}
        assert sides <= set(map(tuple, edges[~vanished].tolist()))


def test_nothing_has_vanished():
    edges = np.array([(0, 1), (0, 2), (1, 2)])
    for pieces in (surfaces(3, edges).pieces, ()):
        lone, polygons = undivided(pieces, np.zeros(3, bool))
        assert len(lone) == len(pieces)
        assert polygons.count == 0


def test_outlines_of_many_cells():
    """More cells times vertices than 32 bits hold."""
    known = forgotten(specimen(*squares(np.ones((230, 220), bool)), c=-0.5))
    found = recover(known.matrix, refine=False)
    assert np.diff(found.polygons_offsets).tolist() == [4] * (230 * 220)
    assert not len(found.triangles)


def test_cells_without_an_outline_are_written_as_triangles():
    """A ring of triangles with vanished entries on all its inner edges: two loops."""
    ring = [(k, (k + 1) % 6, (k + step) % 6 + 6) for k in range(6) for step in (0, 1)]
    triangles = np.array([(a, b, c) if c == a + 6 else (b, c, a + 6) for a, b, c in ring])
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    topology = surfaces(12, edges)
    (piece,) = topology.pieces
    vanished = np.flatnonzero(piece.inner)
    lone, polygons = undivided([piece], np.isin(np.arange(len(edges)), piece.edge_rows[vanished]))
    assert len(lone) == 12
    assert not polygons.count
    z = np.exp(2j * np.pi * np.arange(12) / 6) * np.repeat([2, 1], 6)
    mesh = joined(replace(topology, vanished=piece.edge_rows[vanished]), [z[piece.vertices]], np.ones(1), "")
    assert len(mesh.triangles) == 12
