"""Mirror images of pieces that close rings."""

import numpy as np
import pytest

from unassemble.planar.images import growing_images


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
