"""Mirror images of pieces that close rings."""

import numpy as np
import pytest

from unassemble.planar import join
from unassemble.topology import Topology, planar_pieces, with_sides


@pytest.mark.parametrize("seed", range(5))
def test_rings_beyond_a_single_vertex_are_joined(seed):
    """A triangle in the hole of a ring, touching it three times, and another one outside; each in any image and frame.

    The one outside stays where it is.
    """
    rng = np.random.default_rng(seed)
    angle = np.pi / 3 * np.arange(6) + rng.uniform(-0.2, 0.2, 6)
    points = np.concatenate([np.exp(1j * angle), 2 * np.exp(1j * angle), [3, 3 + 1j]])
    i, j = np.arange(6), (np.arange(6) + 1) % 6
    ring = np.concatenate([np.column_stack([i, 6 + i, j]), np.column_stack([6 + i, 6 + j, j])])
    triangles = np.concatenate([[[6, 12, 13]], ring, [[0, 2, 4]]])
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    pieces = planar_pieces(14, edges, triangles, with_sides(14, edges, triangles)[2])
    topology = Topology(14, edges, pieces, "")
    assert len(pieces) == 3
    assert 12 in pieces[0].vertices
    z = [points[piece.vertices] * np.exp(2j * np.pi * rng.random()) * rng.uniform(0.5, 2) for piece in pieces]
    z = [z[0], z[1], np.conj(z[2])]
    joined = join(topology, z)
    at = np.full(14, np.nan, dtype=np.complex128)
    for piece, there in zip(pieces, joined, strict=True):
        known = np.isfinite(at[piece.vertices])
        assert np.abs(at[piece.vertices] - there)[known].max(initial=0.0) < 1e-9
        at[piece.vertices] = there
        assert np.abs(there - there.mean()).max() > 0.01
