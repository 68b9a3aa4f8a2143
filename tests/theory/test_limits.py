"""docs/theory.md, sections 9 to 11: anisotropic operators, what no method can tell, counting equations."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import skfem
from numpy.typing import NDArray
from skfem.helpers import dot, grad

from dense_mesh import Mesh, disc, square


def anisotropic(mesh: Mesh, tensor: NDArray) -> NDArray:
    """The matrix of -div K grad, assembled by scikit-fem."""
    points = np.ascontiguousarray([mesh.p.real, mesh.p.imag])
    basis = skfem.Basis(skfem.MeshTri(points, np.ascontiguousarray(mesh.t.T)), skfem.ElementTriP1())

    @skfem.BilinearForm
    def flux(u, v, _):
        return dot(np.einsum("ij,j...->i...", tensor, grad(u)), grad(v))

    return flux.assemble(basis).toarray()


def mapped(mesh: Mesh, matrix: NDArray) -> Mesh:
    """The mesh under a linear map; triangles turned round where it reverses orientation."""
    x, y = matrix @ [mesh.p.real, mesh.p.imag]
    return Mesh(x + 1j * y, mesh.t if np.linalg.det(matrix) > 0 else mesh.t[:, [0, 2, 1]])


TENSOR = np.array([[4.0, 0.5], [0.5, 0.7]])


def test_constant_tensor_is_a_laplacian_on_a_mapped_mesh():
    mesh = square(6)
    image = mapped(mesh, np.linalg.inv(scipy.linalg.sqrtm(TENSOR)))
    expected = np.sqrt(np.linalg.det(TENSOR)) * image.stiffness
    np.testing.assert_allclose(anisotropic(mesh, TENSOR), expected, atol=1e-12)


def test_diagonal_tensor_contracts_x():
    """Kx = 4, Ky = 1: the Laplacian's mesh has x halved, and not doubled."""
    mesh = square(6)
    matrix = anisotropic(mesh, np.diag([4.0, 1.0]))
    np.testing.assert_allclose(matrix, 2 * mapped(mesh, np.diag([0.5, 1.0])).stiffness, atol=1e-12)
    assert np.abs(matrix - 2 * mapped(mesh, np.diag([2.0, 1.0])).stiffness).max() > 0.1


@pytest.mark.parametrize("reflect", [False, True])
def test_tensor_without_orientation_leaves_a_circle_of_meshes(reflect):
    """K^(1/2) Q K^(-1/2) maps a mesh to another with the same matrix, for every orthogonal Q."""
    mesh = square(6)
    root = np.real(scipy.linalg.sqrtm(TENSOR))
    c, s = np.cos(0.8), np.sin(0.8)
    orthogonal = np.array([[c, -s], [s, c]]) @ np.diag([1, -1 if reflect else 1])
    other = mapped(mesh, root @ orthogonal @ np.linalg.inv(root))
    np.testing.assert_allclose(anisotropic(other, TENSOR), anisotropic(mesh, TENSOR), atol=1e-12)
    distances = [np.abs(m.p - m.p[0])[1:] for m in (mesh, other)]
    assert np.ptp(distances[0] / distances[1]) > 0.3  # no similarity


def test_diagonals_of_a_cocircular_quadrilateral_do_not_show():
    p = np.exp(1j * np.array([0.1, 1.3, 2.9, 4.4]))
    one = Mesh(p, np.array([[0, 1, 2], [0, 2, 3]]))
    other = Mesh(p, np.array([[0, 1, 3], [1, 2, 3]]))
    np.testing.assert_allclose(one.stiffness, other.stiffness, atol=1e-14)
    assert abs(one.stiffness[0, 2]) < 1e-15
    shifted = Mesh(p + np.array([0.1, 0, 0, 0]), one.t)
    assert np.abs(shifted.stiffness - Mesh(shifted.p, other.t).stiffness).max() > 1e-2


def test_pieces_that_meet_in_a_vertex_turn_freely():
    def two_pieces(turn: complex) -> Mesh:
        p = np.array([0, 1, 1 + 1j, 0.2 + 1j])
        return Mesh(np.concatenate([p, turn * p[1:]]), np.array([[0, 1, 2], [0, 2, 3], [0, 4, 5], [0, 5, 6]]))

    straight, turned = two_pieces(-1.0), two_pieces(-2 * np.exp(0.3j))
    np.testing.assert_allclose(straight.stiffness, turned.stiffness, atol=1e-14)
    assert np.linalg.norm(scipy.linalg.eigvalsh(straight.energy)[:3]) < 1e-14  # a third null vector


def test_angle_equations_are_fewer_than_angles_with_two_holes():
    """e + m + w - 3 m = 1 - h."""
    for holes in ([], [(0.3 + 0.3j, 0.13)], [(0.3 + 0.3j, 0.13), (0.7 + 0.65j, 0.16)]):
        mesh = square(12, holes)
        interior = mesh.n - len(np.unique(mesh.boundary))
        assert len(mesh.loops) == 1 + len(holes)
        assert len(mesh.edges[0]) + len(mesh.t) + interior - 3 * len(mesh.t) == 1 - len(holes)


def test_vanished_boundary_edges_allow_two_readings():
    """A hub between four right angles: two cyclic orders of its neighbours, one set of weights."""

    def star(radii: NDArray, order: list[int]) -> NDArray:
        """Weights hub-leaf of four right triangles about the origin, leaves in counter-clockwise order."""
        p = np.zeros(5, complex)
        p[np.array(order) + 1] = radii * 1j ** np.arange(4)
        t = np.array([[0, order[k] + 1, order[(k + 1) % 4] + 1] for k in range(4)])
        stiffness = Mesh(p, t).stiffness
        assert np.abs(stiffness[1:, 1:] - np.diag(np.diag(stiffness)[1:])).max() < 1e-15
        return -stiffness[0, 1:]

    # Distances r with u_k = 1 / w_k = 2 r_k / (r_(k-1) + r_(k+1)).
    one = star(np.array([1.0, 3.0, 3.0, 1.0]), [0, 1, 2, 3])
    other = star(np.array([1.0, 3.0, 3.0, 1.0]), [0, 2, 1, 3])
    np.testing.assert_allclose(one, other, atol=1e-14)


def test_disc_is_recovered_from_its_own_null_space():
    """The theorem at work: the null vector of M, constants removed, is the mesh."""
    mesh = disc(5)
    _, vectors = scipy.linalg.eigh(mesh.energy)
    z = vectors[:, :2] @ np.linalg.lstsq(vectors[:, :2], mesh.p, rcond=None)[0]
    np.testing.assert_allclose(z, mesh.p, atol=1e-11)
