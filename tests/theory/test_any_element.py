"""Section 14 of the theory: the form M of any conforming element, on matrices that scikit-fem assembled."""

import numpy as np
import pytest
import skfem
from skfem.models.poisson import laplace

from unassemble.conforming import AssembledEntries, OrderedCells, parts_of
from unassemble.elements import KINDS, exact_rule, planar_rules

ELEMENTS = {
    "triangle": skfem.ElementTriP1,
    "triangle6": skfem.ElementTriP2,
    "triangle10": skfem.ElementTriP3,
    "quad": skfem.ElementQuad1,
    "quad8": skfem.ElementQuadS2,
    "quad9": skfem.ElementQuad2,
}
NULL = {"triangle": 2, "triangle6": 3, "triangle10": 4, "quad": 2, "quad8": 2, "quad9": 2}


def mesh_of(name):
    axes = np.linspace(0, 1, 5), np.linspace(0, 1, 4)
    mesh = (skfem.MeshTri if name.startswith("triangle") else skfem.MeshQuad).init_tensor(*axes)
    shift = 0.05 * np.random.default_rng(1).uniform(-1, 1, mesh.p.shape)
    mesh = type(mesh)(mesh.p + shift, mesh.t)
    return mesh.remove_elements([len(mesh.t.T) // 2])


CENTRE = np.full((2, 1), 0.5), np.ones(1)


def form(name, order=10, rule=None):
    """M, L and the positions of the nodes."""
    mesh, element = mesh_of(name), ELEMENTS[name]()
    basis = skfem.Basis(mesh, element, intorder=order, quadrature=rule)

    @skfem.BilinearForm
    def along(u, v, w):
        return v * (-u.grad[0] * w.n[1] + u.grad[1] * w.n[0])

    circulation = along.assemble(skfem.FacetBasis(mesh, element, intorder=10)).toarray()
    area = (circulation - circulation.T) / 4j
    energy = laplace.assemble(basis).toarray()
    return energy / 2 - area, energy, basis


def cells_of(name, basis):
    """In meshio's order: scikit-fem numbers the nodes of the last side of a cubic triangle from the other end."""
    cells = basis.element_dofs.T.astype(np.int64)
    cells = cells[:, [0, 1, 2, 3, 4, 5, 6, 8, 7, 9]] if name == "triangle10" else cells
    return OrderedCells({KINDS[name]: cells}, told=True, order=np.arange(basis.N))


@pytest.mark.parametrize("name", ELEMENTS)
def test_the_form_is_semidefinite_and_its_null_vectors_are_holomorphic(name):
    matrix, _, basis = form(name)
    values = np.linalg.eigvalsh(matrix)
    z = basis.doflocs[0] + 1j * basis.doflocs[1]
    assert np.abs(matrix @ z).max() < 1e-13
    assert np.abs(matrix @ np.ones(len(z))).max() < 1e-13
    powers = {"triangle6": [z**2], "triangle10": [z**2, z**3]}.get(name, [])
    assert all(np.abs(matrix @ one).max() < 1e-12 for one in powers)
    assert np.abs(values[: NULL[name]]).max() < 1e-13
    if name != "quad9" and name != "quad8":
        assert values[NULL[name]] > 1e-5
    assert values.min() > -1e-13


@pytest.mark.parametrize(("name", "order"), [("quad", 3), ("quad9", 3), ("quad8", 3)])
def test_reduced_quadrature_keeps_the_coordinates(name, order):
    matrix, energy, basis = form(name, order)
    z = basis.doflocs[0] + 1j * basis.doflocs[1]
    assert np.abs(energy - form(name)[1]).max() > 1e-3
    assert np.abs(matrix @ z).max() < 1e-13
    assert np.linalg.eigvalsh(matrix).min() > -1e-13


def test_one_point_leaves_quadrilaterals_open():
    values = np.linalg.eigvalsh(form("quad", rule=CENTRE)[0])
    assert np.count_nonzero(np.abs(values) < 1e-12) > 2


@pytest.mark.parametrize("name", ["triangle6", "triangle10"])
def test_triangles_reduce_to_linear_ones(name):
    _, energy, basis = form(name)
    (part,) = parts_of(cells_of(name, basis))
    order = part.piece.vertices
    to_nodes = part.from_corners().toarray()
    reduced = to_nodes.T @ energy[np.ix_(order, order)] @ to_nodes
    linear = laplace.assemble(skfem.Basis(mesh_of(name), skfem.ElementTriP1())).toarray()
    corner = order[: part.n_corners]
    assert reduced == pytest.approx(linear[np.ix_(corner, corner)], abs=1e-12)


@pytest.mark.parametrize("straight", [True, False])
@pytest.mark.parametrize("name", ELEMENTS)
def test_derivative_of_entries(name, straight):
    kind = KINDS[name]
    basis = skfem.Basis(mesh_of(name), ELEMENTS[name]())
    (part,) = parts_of(cells_of(name, basis))
    rule = exact_rule(kind) if kind.simplex else next(iter(planar_rules(kind).values()))
    entries = AssembledEntries(part, {kind: rule}, straight=straight)
    z = (basis.doflocs[0] + 1j * basis.doflocs[1])[part.piece.vertices][: entries.n]
    z = z if entries.areas(z).min() > 0 else np.conj(z)
    rng = np.random.default_rng(0)
    move, change = rng.standard_normal((entries.n, 2)) @ [1, 1j], rng.standard_normal(len(part.edges))
    jacobian = entries.jacobian(z, np.ones(len(part.edges)))
    step = 1e-6
    difference = (entries.weights(z + step * move) - entries.weights(z - step * move)) / (2 * step)
    assert jacobian.forward(move) == pytest.approx(difference, abs=1e-5 * np.abs(difference).max())
    assert jacobian.matrix @ np.stack([move.real, move.imag], axis=1).ravel() == pytest.approx(jacobian.forward(move))
    assert np.vdot(jacobian.transpose(change), move).real == pytest.approx(change @ jacobian.forward(move))
    assert jacobian.forward(z) == pytest.approx(np.zeros(len(part.edges)), abs=1e-10)


def test_a_node_on_a_side_has_twice_the_diagonal_of_a_corner():
    rng = np.random.default_rng(0)
    for _ in range(50):
        mesh = skfem.MeshTri(rng.standard_normal((2, 3)), np.array([[0], [1], [2]]), validate=False)
        diagonal = laplace.assemble(skfem.Basis(mesh, skfem.ElementTriP2())).diagonal()
        assert diagonal[3:].min() >= (2 - 1e-9) * diagonal[:3].max()
