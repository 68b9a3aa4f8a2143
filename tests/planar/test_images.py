"""Mirror images of pieces that close rings."""

import numpy as np
import pytest

from unassemble.planar.hinges import join
from unassemble.planar.images import growing_images
from unassemble.topology import Topology
from unassemble.topology.keys import with_sides
from unassemble.topology.pieces import planar_pieces


def _truss(rng, n):
    """Pieces of three shared vertices each on a strip, every piece in a frame of its own."""
    points = np.arange(n + 2) + 1j * np.where(np.arange(n + 2) % 2, 1.0, 0.0) + 0.2 * rng.random(n + 2)
    vertices = [np.arange(k, k + 3) for k in range(n)]
    turn = np.exp(2j * np.pi * rng.random(n)) * rng.uniform(0.2, 5, n)
    return vertices, [t * points[v] for t, v in zip(turn, vertices, strict=True)]


@pytest.mark.parametrize("n", [4, 15, 40])
def test_any_images_of_a_strip_close_it(n):
    """Neighbours share two vertices and nothing else: the matrix does not tell."""
    vertices, z = _truss(np.random.default_rng(n), n)
    assert len(growing_images(vertices, z, 1e-9)) == min(2 ** (n - 1), 16)


@pytest.mark.parametrize("n", [4, 15, 40])
def test_images_are_found_where_the_rings_tell(n):
    """A further piece meets every vertex of the strip, which fixes all images up to a common one."""
    rng = np.random.default_rng(n)
    vertices, z = _truss(rng, n)
    points = np.arange(n + 2) + 1j * np.where(np.arange(n + 2) % 2, 1.0, 0.0)
    vertices, z = [*vertices, np.arange(n + 2)], [points[v] * np.exp(1j * k) for k, v in enumerate(vertices)] + [points]
    mirrored = rng.random(n + 1) < 0.5
    z = [np.conj(at) if over else at for at, over in zip(z, mirrored, strict=True)]
    choices = growing_images(vertices, z, 1e-9)
    assert any((turned == mirrored).all() or (turned != mirrored).all() for turned in choices)


def test_no_choice_is_made_where_no_ring_closes():
    rng = np.random.default_rng(0)
    vertices = [np.arange(5), np.arange(5)]
    z = [rng.standard_normal((5, 2)) @ [1, 1j] for _ in vertices]
    assert growing_images(vertices, z, 1e-9) == []


def test_groups_are_told_apart():
    rng = np.random.default_rng(1)
    square, other = (rng.standard_normal((4, 2)) @ [1, 1j] for _ in range(2))
    vertices = [np.arange(4), np.arange(4), np.arange(4, 8), np.arange(4, 8)]
    choices = growing_images(vertices, [square, np.conj(square) * 1j, other, 3 * other], 1e-9)
    assert [turned.tolist() for turned in choices] == [[False, True, False, False]]


@pytest.mark.parametrize("seed", range(5))
def test_pieces_do_not_meet_by_shrinking_to_a_point(seed):
    """Rings that hang on the first piece by one vertex: as points all pieces in them would meet, in any image."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((12, 2)) @ [1, 1j]
    vertices = [np.append(0, np.arange(5, 12)), np.arange(5), np.arange(5)]
    z = [points[v] for v in vertices]
    z[2] = np.conj(z[2]) * 0.5j
    choices = growing_images(vertices, z, 1e-9)
    assert choices
    assert all(turned[1] != turned[2] for turned in choices)


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
