"""Whether each alternative that is named is another mesh with the same matrix."""

from itertools import pairwise

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

import exhaustive
from meshes import triangle_set
from unassemble import recover


def cells_of(found):
    ends = zip(found.polygons_offsets[:-1], found.polygons_offsets[1:], strict=True)
    return [*map(tuple, found.triangles.tolist()), *(tuple(found.polygons_data[a:b].tolist()) for a, b in ends)]


def with_structure(matrix, cells):
    """The matrix with zeros stored on every side and diagonal of cells: then there is one reading only."""
    fans = np.array([(cell[0], p, q) for cell in cells for p, q in pairwise(cell[1:])])
    i, j = fans[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).T
    entries = matrix.tocoo()
    zeros = np.zeros(2 * len(i))
    ends = np.r_[entries.row, i, j], np.r_[entries.col, j, i]
    return sp.coo_array((np.r_[entries.data, zeros], ends), shape=matrix.shape), fans


def check_alternatives(matrix, **options):
    """Put the cells of each alternative in place of those in doubt, and recover that mesh."""
    found = recover(matrix, **options)
    cells = cells_of(found)
    for other in found.alternatives:
        gone = {tuple(sorted(cell)) for cell in other.cells}
        kept = [cell for cell in cells if tuple(sorted(cell)) not in gone]
        assert len(kept) == len(cells) - len(gone)
        stored, fans = with_structure(matrix, [*kept, *other.other_cells])
        again = recover(stored)
        assert again.certified or again.alternatives, again.reason  # a right angle may close what is left
        assert triangle_set(again.triangles) == triangle_set(fans)
        if other.same_scale:
            assert again.scale == pytest.approx(found.scale, rel=1e-9)
        else:
            assert abs(again.scale[0] / found.scale[0] - 1) > 1e-6
    assert found.certified != bool(found.alternatives)
    return found


def explains(matrix, cells, c):
    """Whether every piece that cells make, glued at common sides, has the entries of the matrix, as an oracle finds."""
    glued = networkx.Graph()
    for k, cell in enumerate(cells):
        glued.add_edges_from((("cell", k), frozenset(side)) for side in pairwise((*cell, cell[0])))
    entries = matrix.tocoo()
    covered = 0
    for part in networkx.connected_components(glued):
        own = [cells[node[1]] for node in part if isinstance(node, tuple)]
        rows = sorted(set().union(*own))
        number = {row: k for k, row in enumerate(rows)}
        sides = {node for node in part if isinstance(node, frozenset)}
        weights = {
            (number[i], number[j]): -float(w)
            for i, j, w in zip(entries.row.tolist(), entries.col.tolist(), entries.data, strict=True)
            if i < j and frozenset((i, j)) in sides and w
        }
        covered += len(weights)
        signed = {pair: w / c for pair, w in weights.items()}
        if not exhaustive.fits(len(rows), signed, [tuple(number[v] for v in cell) for cell in own], 1.0):
            return False
    return covered == np.count_nonzero(entries.data[entries.row < entries.col])
