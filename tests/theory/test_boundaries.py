"""Section 15 of the theory: what inner edges alone leave open, on matrices that scikit-fem assembled."""

import numpy as np
import pytest
from skfem import Basis, ElementTriP1, MeshTri
from skfem.models import laplace

from meshes import largest_error


def strip(columns: int, rows: int, hole: bool) -> MeshTri:
    """Triangles in no order, of which some in the middle may lack."""
    mesh = MeshTri.init_tensor(np.arange(columns + 1.0), np.arange(rows + 1.0))
    middle = np.linalg.norm(mesh.p[:, mesh.t].mean(axis=1) - mesh.p.mean(axis=1, keepdims=True), axis=0)
    mesh = mesh.remove_elements(np.flatnonzero(middle < 1)) if hole else mesh
    return MeshTri(mesh.p + np.random.default_rng(0).uniform(-0.15, 0.15, mesh.p.shape), mesh.t)


def weights(mesh: MeshTri, z: np.ndarray) -> np.ndarray:
    """Entries of the inner edges, as they are assembled at positions x, y (2 n,)."""
    inner = mesh.facets[:, np.setdiff1d(np.arange(mesh.nfacets), mesh.boundary_facets())]
    matrix = laplace.assemble(Basis(MeshTri(z.reshape(2, -1), mesh.t), ElementTriP1())).tocsr()
    return -np.asarray(matrix[inner[0], inner[1]]).ravel()


def derivative(mesh: MeshTri, z: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """(W, 2 n + 1), the last column that of log c."""
    moves = step * np.eye(len(z))
    columns = [(weights(mesh, z + move) - weights(mesh, z - move)) / (2 * step) for move in moves]
    return np.column_stack([*columns, weights(mesh, z)])


@pytest.mark.parametrize(("columns", "rows", "hole"), [(8, 1, False), (6, 2, False), (4, 4, True), (7, 7, False)])
def test_freedoms_of_inner_edges(columns, rows, hole):
    mesh = strip(columns, rows, hole)
    z = mesh.p.ravel()
    size = np.linalg.svd(derivative(mesh, z), compute_uv=False)
    kernel = len(z) + 1 - int((size > 1e-7 * size[0]).sum())
    ears = int((np.bincount(mesh.t.ravel()) == 1).sum())  # a vertex in one triangle turns on a circle
    assert kernel == 4 + max(2 * len(mesh.boundary_facets()) - mesh.nvertices - 3 * hole, ears)


def test_another_mesh_with_the_same_inner_entries():
    mesh = strip(6, 2, False)
    start = mesh.p.ravel()
    given, z, log_c = weights(mesh, start), start, 0.0
    away = np.linalg.svd(derivative(mesh, z))[2][-12:].T  # of the kernel
    z = z + 0.3 * (away @ np.random.default_rng(1).standard_normal(away.shape[1]))[:-1]
    for _ in range(12):
        misfit = np.exp(log_c) * weights(mesh, z) - given
        jacobian = np.exp(log_c) * derivative(mesh, z)
        step = np.linalg.lstsq(jacobian, -misfit, rcond=1e-9)[0]
        z, log_c = z + step[:-1], log_c + step[-1]
    assert np.abs(np.exp(log_c) * weights(mesh, z) - given).max() < 1e-9
    assert largest_error(z.reshape(2, -1).T, mesh.p.T) > 0.01
