"""Right isosceles triangles from bisection with a diagonal next to nothing, which is no scaling and no mass matrix."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTri

from meshes import largest_error, specimen
from unassemble import recover
from vanishing import forgotten


def bisected(seed, n=50):
    """Points (n, 2) and triangles of a square, or an L, refined by bisection in triangles at random."""
    rng = np.random.default_rng(seed)
    mesh = MeshTri.init_lshaped() if seed % 2 else MeshTri().refined(1)
    while mesh.nvertices < n:
        mesh = mesh.refined(np.flatnonzero(rng.random(mesh.nelements) < 0.2))
    return mesh.p.T, mesh.t.T


def with_diagonal(matrix, size, *, positive, seed):
    """A random diagonal of that size, relative to the entries, added; zeros that are stored stay."""
    rng, entries, n = np.random.default_rng(seed), matrix.tocoo(), matrix.shape[0]
    added = size * (rng.random(n) if positive else rng.standard_normal(n))
    row, column = np.append(entries.row, np.arange(n)), np.append(entries.col, np.arange(n))
    return sp.csr_array(sp.coo_array((np.append(entries.data, added), (row, column)), shape=(n, n)))


@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-8, 1.0])
def test_the_mesh_comes_back_whatever_is_on_the_diagonal(size, positive, dropped):
    """A diagonal matrix of 1e-9 was read as a scaling S c L S that gives the entries back to 1e-8 only."""
    for seed in range(2):
        known = specimen(*bisected(seed), c=0.7, seed=seed)
        known = forgotten(known) if dropped else known
        found = recover(with_diagonal(known.matrix, size, positive=positive, seed=seed))
        assert found.status != "uncertified", found.reason
        assert found.backward_error <= 1e-12
        assert found.row_scaling is None
        if found.certified:
            assert largest_error(found.points, known.points) <= 1e-11


def test_rounding_is_no_reason_where_the_mesh_has_the_entries_exactly():
    """A triangle lies across the arms of a U and touches them in its corners, with entries of two decimals."""
    mesh = MeshTri().refined(3)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.remove_elements(np.flatnonzero((np.abs(middle[0] - 0.5) < 0.25) & (middle[1] > 0.5)))
    arms = [int(np.flatnonzero((mesh.p[0] == x) & (mesh.p[1] == 1))[0]) for x in (0.75, 0.25)]
    points = np.vstack([mesh.p.T, (0.5, 1.25)])
    triangles = np.vstack([mesh.t.T, [*arms, mesh.nvertices]])
    found = recover(specimen(points, triangles, c=3.7).matrix)
    assert found.status != "uncertified", found.reason
    assert found.backward_error <= 1e-12
