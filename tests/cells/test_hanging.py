"""Small parts that hang on a mesh by a vertex and can be read in another way, whatever the size of the rest."""

import time

import numpy as np
import pytest

from families import FAMILIES
from meshes import random_mesh, specimen
from unassemble import recover
from unassemble.cells.alternatives.hanging import small_parts
from unassemble.topology import Numbering, components
from vanishing import Mesh, forgotten, squares


def stairs() -> Mesh:
    """Of 120 vertices, 16 of which are those of a chain that hangs on one of the others."""
    rng = np.random.default_rng(11)
    rng.choice(3)  # as for the member with this number
    return FAMILIES["stairs"](rng)


@pytest.mark.parametrize("c", [1.0, -2.5])
@pytest.mark.parametrize("order", range(4))
def test_a_chain_of_right_angles_in_another_order(order, c):
    """Five right triangles or three: what hangs on the chain has another shape, whichever is found first."""
    found = recover(forgotten(specimen(*stairs(), c=c, seed=order)).matrix)
    assert found.backward_error <= 1e-12
    assert found.alternatives
    assert all(other.tested for other in found.alternatives)


@pytest.mark.parametrize("c", [1.0, -3.0])
def test_a_chain_on_a_large_mesh(c):
    """The same, beside 800 vertices more, which hang on the far side of the mesh."""
    known = forgotten(specimen(*joined(stairs(), random_mesh(800, 1, holes=False)), c=c, seed=5))
    found = recover(known.matrix)
    assert found.backward_error <= 1e-12
    assert found.alternatives
    assert all(other.tested for other in found.alternatives)


def slit(seed: int) -> Mesh:
    """A mesh with a closed slit, the middle of which is two vertices."""
    points, triangles = squares(np.ones((6, 2), dtype=bool))
    points = points + np.random.default_rng(seed).uniform(-0.2, 0.2, points.shape)
    middle = int(np.flatnonzero((points.round() == [3, 1]).all(axis=1))[0])
    above = points[triangles].mean(axis=1)[:, 1] > points[middle, 1]
    both = np.where((triangles == middle) & above[:, None], len(points), triangles)
    return np.concatenate([points, points[[middle]]]), both


def test_a_chain_on_a_mesh_with_a_slit():
    """With the same places on both sides it is no crack between cells that do not match."""
    assert recover(specimen(*slit(2), seed=1).matrix).certified
    found = [recover(forgotten(specimen(*joined(stairs(), slit(seed)), seed=5)).matrix) for seed in (2, 3, 4)]
    assert not any(one.certified for one in found)
    assert any(one.backward_error <= 1e-12 and one.alternatives for one in found)  # all of them, mostly


def joined(one: Mesh, other: Mesh) -> Mesh:
    """Two meshes with one vertex in common, the other one on the left."""
    (points, triangles), (more, others) = one, other
    left, right = int(points[:, 0].argmin()), int(more[:, 0].argmax())
    number = np.arange(len(more)) + len(points)
    number[right] = left
    number[right + 1 :] -= 1
    whole = np.concatenate([points, np.delete(more - more[right] + points[left], right, axis=0)])
    return whole, np.concatenate([triangles, number[others]])


def test_long_chains_are_cut_in_two_ways():
    """Each edge of a path, and of a comb, lies in a part of at most 60 vertices."""
    n = 500
    path = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    comb = np.concatenate([path, np.column_stack([np.arange(n), n + np.arange(n)])])
    comb = comb[np.lexsort(comb.T[::-1])]
    for size, edges in ((n, path), (2 * n, comb)):
        labels = small_parts(Numbering(np.arange(size), np.arange(len(edges)), edges))
        assert (labels >= 0).any(axis=0).all()
        for label in labels:
            for part in set(label[label >= 0].tolist()):
                rows = np.unique(edges[label == part])
                assert len(rows) <= 60
                assert len(components(size, edges[label == part])) == 1


def test_long_paths_are_cut_in_linear_time():
    """Eight times as long takes about eight times the time, and less than half of 64 times on any machine."""

    def seconds(n: int) -> float:
        path = np.column_stack([np.arange(n - 1), np.arange(1, n)])
        start = time.process_time()
        labels = small_parts(Numbering(np.arange(n), np.arange(n - 1), path))
        assert (labels >= 0).any(axis=0).all()
        return time.process_time() - start

    assert min(seconds(100_000) for _ in range(3)) < 32 * max(min(seconds(12_500) for _ in range(3)), 0.01)
