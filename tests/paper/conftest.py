"""Matrices assembled by scikit-fem, with their rows in random order."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

from unassemble.paper import angles_of, corners_of
from unassemble.topology import surfaces
from unassemble_paper import meshes
from unassemble_paper.cases import Case, case


@BilinearForm
def _laplace(u, v, w):
    return dot(grad(u), grad(v))


def laplacian(mesh: meshes.Mesh):
    """The Neumann stiffness matrix by scikit-fem."""
    basis = Basis(MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy()), ElementTriP1())
    return _laplace.assemble(basis).tocsr()


def assembled(mesh: meshes.Mesh, name: str = "", *, seed: int = 7, scale: float = 1.0) -> Case:
    """Permute the vertices, assemble elsewhere, recognise: the truth is used to judge only."""
    order = np.random.default_rng(seed).permutation(len(mesh.points))
    place = np.argsort(order)
    shuffled = meshes.Mesh(mesh.points[order], place[mesh.triangles])
    matrix = scale * laplacian(shuffled)
    sides = np.sort(shuffled.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = np.unique(sides, axis=0)  # zero entries are structure, and scikit-fem drops them
    weights = -np.asarray(matrix[edges[:, 0], edges[:, 1]]).ravel()
    (piece,) = surfaces(len(order), edges).pieces
    z = (shuffled.points @ np.array([1, 1j]))[piece.vertices]
    p = z[piece.triangles]
    if ((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag.sum() < 0:
        z = z.conj()
    angles = angles_of(z, piece.triangles).ravel()
    return Case(name, 0, piece, corners_of(piece), weights[piece.edge_rows], z, angles)


@pytest.fixture(scope="session", params=["square", "ellipse", "rocket"])
def paper_case(request) -> Case:
    """Each of the paper's three meshes, assembled by scikit-fem with its rows permuted."""
    return assembled(getattr(meshes, request.param)(), request.param)


@pytest.fixture(scope="session")
def own_cases() -> dict[str, Case]:
    """The experiments' own cases, in the order of their points."""
    return {name: case(name) for name in ("square", "ellipse", "rocket")}


@pytest.fixture(scope="session")
def assemble():
    """The function :func:`assembled`."""
    return assembled
