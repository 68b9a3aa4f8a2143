"""Cells are written as they are, not as they were found."""

import numpy as np

from unassemble.cells.undivided import undivided
from unassemble.topology import recognise


def test_triangles_that_share_vanished_sides_become_one_polygon():
    triangles = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (3, 5, 4), (5, 6, 4)])
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    pieces = recognise(7, edges).pieces
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
    for pieces in (recognise(3, edges).pieces, ()):
        lone, polygons = undivided(pieces, np.zeros(3, bool))
        assert len(lone) == len(pieces)
        assert polygons.count == 0
