"""Meshes whose matrices have boundary conditions in them: what is determined is right, and it is most of it."""

import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
from conditions import convected, determined, eliminated, identity_rows, jittered, mesh_of, robin, shuffled

from meshes import SHARED, largest_error, needs_shared, random_mesh
from unassemble import recover


def corpus(name):
    mesh = np.load(SHARED / "corpus" / "planar" / f"{name}.npz")
    return mesh_of(mesh["points"][:, :2].astype(float), mesh["triangles"].astype(np.int64))


def test_the_airfoil_of_pyamg():
    """260 rows of 322: the boundary was eliminated before it was stored."""
    example = pyamg.gallery.load_example("airfoil")
    triangles = example["elements"] - example["elements"].min()
    boundary = mesh_of(example["vertices"], triangles).boundary_nodes()
    inside = np.setdiff1d(np.arange(len(example["vertices"])), boundary)
    found = recover(example["A"])
    known = found.node_status == 0
    assert found.certified, found.reason
    assert known.sum() >= 250
    assert largest_error(found.points[known], example["vertices"][inside][known]) <= 1e-10


@pytest.mark.parametrize("seed", range(3))
def test_eliminated(seed):
    matrix, points = eliminated(mesh_of(*random_mesh(600, seed=seed, holes=False)))
    found = recover(-2.5 * matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.8  # there are slivers at the rim
    assert found.scale == pytest.approx(-2.5, rel=1e-9)
    assert set(found.node_status.tolist()) <= {0, 1, 2}


@needs_shared
@pytest.mark.parametrize("name", ["pyamg_unit_square", "thetis_headland", "skfem_ex28", "meshpart_Eppstein"])
def test_eliminated_third_party(name):
    matrix, points = eliminated(corpus(name))
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.7


def test_eliminated_in_part():
    """Natural conditions on one side: entries there are those of a boundary, and count."""
    matrix, points = eliminated(jittered(seed=1), lambda x: x[0] < 0.7)
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.9


@pytest.mark.parametrize("c", [1.0, -3.0])
def test_identity_rows(c):
    matrix, points = identity_rows(jittered(seed=2), c)
    found = recover(matrix)
    assert found.certified, found.reason
    assert "boundary condition" in " ".join(found.warnings)
    assert determined(found, points) >= 0.9
    assert found.scale == pytest.approx(c, rel=1e-9)


def test_identity_rows_without_their_zeros():
    """Edges between boundary vertices are not in the matrix then."""
    matrix, points = identity_rows(jittered(seed=6))
    matrix.eliminate_zeros()
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.9


@needs_shared
@pytest.mark.parametrize("name", ["pyamg_airfoil", "skfem_annulus", "gc_lego", "skfem_square"])
def test_identity_rows_third_party(name):
    matrix, points = identity_rows(corpus(name))
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= (0.8 if name == "pyamg_airfoil" else 0.9)


@pytest.mark.parametrize("alpha", [1.0, 100.0])
def test_robin(alpha):
    matrix, points = robin(jittered(seed=3), alpha)
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.85


@pytest.mark.parametrize("field", [(1.0, 0.0), (-20.0, 30.0)])
def test_the_symmetric_part_of_convection(field):
    """With a constant field C + C' is a boundary integral: entries inside are those of the Laplacian."""
    matrix, points = convected(jittered(seed=4), field)
    found = recover((matrix + matrix.T) / 2)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.85


@pytest.mark.parametrize("noise", [1e-6, 1e-3])
def test_noise_is_not_certified(noise):
    matrix, _ = eliminated(mesh_of(*random_mesh(120, seed=4, holes=False)))
    upper = sp.triu(matrix, 1).tocsr()
    upper.data *= 1 + noise * np.random.default_rng(0).standard_normal(len(upper.data))
    found = recover(upper + upper.T + sp.diags_array(matrix.diagonal()))
    assert not found.certified


def test_a_whole_mesh_stays_one():
    """A diagonal matrix on the boundary is no elimination."""
    mesh = mesh_of(*random_mesh(400, seed=5))
    matrix, points = robin(mesh, 0.0)
    boundary = np.zeros(len(points))
    boundary[np.flatnonzero(np.isin(points[:, 0], mesh.p[0, mesh.boundary_nodes()]))] = 3.0
    found = recover(matrix + sp.diags_array(boundary))
    assert found.certified
    assert found.uniqueness == "proved"
    assert not found.node_status.any()


def test_a_random_rim_is_refused():
    """Entries inside that are not those of any mesh: nothing is called determined."""
    matrix, _ = eliminated(mesh_of(*random_mesh(120, seed=6, holes=False)))
    upper = sp.triu(matrix, 1).tocsr()
    upper.data *= np.random.default_rng(0).uniform(0.8, 1.2, len(upper.data))
    assert not recover(upper + upper.T + sp.diags_array(matrix.diagonal())).certified


def test_shuffled_keeps_zeros():
    matrix, _ = identity_rows(mesh_of(*random_mesh(100, seed=7)))
    assert (matrix.data == 0).any()
    assert shuffled(matrix, np.zeros((matrix.shape[0], 2)))[0].nnz == matrix.nnz
