"""Surfaces of which rows were taken out: one alone in a place can be put back, and nothing is certified without c."""

from dataclasses import replace

import numpy as np
import pyamg
import pytest
from surfaces import double_torus, largest_error, moebius, sheet, sphere, surface, torus

from meshes import triangle_set
from unassemble import RecoveryError, recover
from unassemble.metric import Found


def test_the_knot_of_pyamg():
    """A row is gone. It is the Laplacian of the graph, so that the lengths are those of equal triangles."""
    example = pyamg.gallery.load_example("knot")
    with pytest.raises(RecoveryError, match="operator='surface'"):  # which nothing else speaks for
        recover(example["A"])
    found = recover(example["A"], operator="surface")
    left = example["elements"][(example["elements"] < found.n_points).all(axis=1)]
    assert found.status == "ambiguous"
    assert triangle_set(found.triangles) == triangle_set(left)
    assert (found.genus.tolist(), found.loops.tolist()) == ([1], [1])
    np.testing.assert_allclose(found.edge_lengths, 1, rtol=1e-12)


def without(known, gone):
    keep = np.setdiff1d(np.arange(len(known.points)), gone)
    return known.matrix[keep][:, keep], known.points[keep]


@pytest.mark.parametrize("mesh", [sphere(200), torus(), double_torus()], ids=["sphere", "torus", "double torus"])
def test_vertices_apart_from_each_other(mesh):
    known = surface(*mesh, c=-0.7, seed=3)
    far = np.flatnonzero((abs(known.matrix) @ abs(known.matrix) @ abs(known.matrix))[[0]].toarray()[0] == 0)
    matrix, points = without(known, [0, far[0]])
    found = recover(matrix, operator="surface")
    assert (found.status, found.scale[0]) == ("ambiguous", pytest.approx(-0.7, rel=1e-11))
    assert "2 vertices were put back" in " ".join(found.warnings)
    assert found.loops.tolist() == [2]
    assert largest_error(found, points) <= 1e-11
    assert recover(matrix, operator="surface", scale=-0.7).certified


@pytest.mark.parametrize("spoiled", [False, True])
def test_lengths_are_compared_as_they_are_written(spoiled, monkeypatch):
    """Those of the surface without the vertices that were put back: where they are spoiled on the way that shows."""
    known = surface(*torus(), c=-0.7, seed=3)
    matrix, _ = without(known, [0])
    left_over = Found.without_last

    def spoil(found, gone):
        left = left_over(found, gone)
        squared = left.squared.copy()
        squared[7] *= 1 + 1e-4 * spoiled
        return replace(left, squared=squared)

    monkeypatch.setattr(Found, "without_last", spoil)
    found = recover(matrix, operator="surface", scale=-0.7)
    assert found.certified != spoiled
    if not spoiled:
        assert found.backward_error < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_several_in_one_hole_are_never_certified(seed):
    """One vertex in the place of two or three has lengths mostly, with another c: they are wrong."""
    mesh = [sphere(150, seed), torus(16, 9, seed), moebius(24, 7, seed), sheet(14, seed)][seed % 4]
    known = surface(*mesh, c=0.7, seed=seed)
    triangle = known.triangles[5]
    matrix, _ = without(known, triangle[: 2 + seed % 2])
    for scale in (None, 0.7):
        try:
            found = recover(matrix, operator="surface", scale=scale)
        except RecoveryError:
            continue
        assert not found.certified, found.reason
