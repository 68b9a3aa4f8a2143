"""Element matrices and candidates for cells of every kind, against scikit-fem: scalar operators and elasticity."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from skfem.helpers import ddot, sym_grad, trace

from unassemble.elements import (
    KINDS,
    Graph,
    assembled,
    candidates,
    elasticity,
    mass,
    ordered,
    reference_nodes,
    rules,
    shape_functions,
    shape_gradients,
    volumes,
)

SKFEM = {
    "triangle": (skfem.MeshTri, skfem.ElementTriP1),
    "triangle6": (skfem.MeshTri, skfem.ElementTriP2),
    "triangle10": (skfem.MeshTri, skfem.ElementTriP3),
    "quad": (skfem.MeshQuad, skfem.ElementQuad1),
    "quad8": (skfem.MeshQuad, skfem.ElementQuadS2),
    "quad9": (skfem.MeshQuad, skfem.ElementQuad2),
    "tetra": (skfem.MeshTet, skfem.ElementTetP1),
    "tetra10": (skfem.MeshTet, skfem.ElementTetP2),
    "hexahedron": (skfem.MeshHex, skfem.ElementHex1),
    "hexahedron20": (skfem.MeshHex, skfem.ElementHexS2),
    "hexahedron27": (skfem.MeshHex, skfem.ElementHex2),
}
VECTOR = [name for name, kind in KINDS.items() if kind.degree < 3]  # of which elasticity is recognised
CELLS = [(name, number) for name, kind in KINDS.items() for number in range(len(list(rules(kind))))]


@skfem.BilinearForm
def product(u, v, w):
    return u * v


@skfem.BilinearForm
def elastic(u, v, w):
    return 1.5 * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * 0.7 * ddot(sym_grad(u), sym_grad(v))


def basis_of(name: str, rule, *, vector: bool = False) -> skfem.Basis:
    """On a box whose inner vertices were moved."""
    mesh_type, element = SKFEM[name]
    mesh = mesh_type.init_tensor(*[np.linspace(0, 1, k) for k in (4, 3, 4)[: KINDS[name].dim]])
    p = mesh.p.copy()
    inner = np.all((p > 1e-9) & (p < 1 - 1e-9), axis=0)
    p[:, inner] += 0.08 * np.random.default_rng(0).uniform(-1, 1, (len(p), inner.sum()))
    chosen = skfem.ElementVector(element()) if vector else element()
    return skfem.Basis(mesh_type(p, mesh.t), chosen, quadrature=(rule[0].T, rule[1]))


def nodes_and_cells(name: str, basis: skfem.Basis) -> tuple[np.ndarray, np.ndarray]:
    points = basis.doflocs.T.copy()
    return points, ordered(np.sort(basis.element_dofs.T.astype(np.int64), axis=1), points, KINDS[name])


@pytest.mark.parametrize("name", KINDS)
def test_shape_functions_interpolate_and_gradients_are_their_slopes(name):
    kind = KINDS[name]
    assert shape_functions(kind, reference_nodes(kind)) == pytest.approx(np.eye(kind.nodes), abs=1e-13)
    at = np.random.default_rng(0).random((5, kind.dim)) / kind.dim
    slopes = shape_gradients(kind, at)
    for a, step in enumerate(1e-6 * np.eye(kind.dim)):
        difference = (shape_functions(kind, at + step) - shape_functions(kind, at - step)) / 2e-6
        assert slopes[:, :, a] == pytest.approx(difference, abs=1e-8)


@pytest.mark.parametrize(("name", "number"), CELLS)
def test_mass_matrices_are_those_of_scikit_fem(name, number):
    kind, rule = KINDS[name], list(rules(KINDS[name]))[number]
    basis = basis_of(name, rule)
    points, cells = nodes_and_cells(name, basis)
    expected = product.assemble(basis)
    found = assembled(mass(kind, rule[0], volumes(points, cells, kind, rule)), cells, len(points))
    assert abs(found - expected).max() < 1e-12 * abs(expected).max()


@pytest.mark.parametrize("name", VECTOR)
def test_elasticity_is_that_of_scikit_fem(name):
    kind = KINDS[name]
    rule = next(rules(kind))
    basis = basis_of(name, rule, vector=True)
    d, scalar = kind.dim, basis_of(name, rule)
    points, cells = nodes_and_cells(name, scalar)
    dofs = np.empty((len(points), d), dtype=int)
    of_cell = basis.element_dofs.T.reshape(len(cells), kind.nodes, d)
    dofs[scalar.element_dofs.T] = of_cell
    expected = sp.csr_array(elastic.assemble(basis))[dofs.ravel()][:, dofs.ravel()]
    first, second = elasticity(points, cells, kind, rule)
    found = assembled(1.5 * first + 0.7 * second, cells, len(points))
    assert abs(found - expected).max() < 1e-12 * abs(expected).max()


@pytest.mark.parametrize("name", VECTOR)
def test_cells_are_among_the_candidates_of_a_scalar_matrix(name):
    """Cliques of the graph of M, which has an entry wherever two nodes share a cell."""
    kind = KINDS[name]
    basis = basis_of(name, next(rules(kind)))
    points, cells = nodes_and_cells(name, basis)
    graph = Graph(sp.csr_array(product.assemble(basis) != 0))
    found = [block for (block,) in (some for some in candidates(graph, points) if len(some) == 1)]
    found = {frozenset(cell) for block in found if block.kind is kind for cell in block.cells.tolist()}
    assert {frozenset(cell) for cell in cells.tolist()} <= found


@pytest.mark.parametrize("name", ["quad", "quad9", "hexahedron"])
def test_cells_whose_nodes_are_one_point_divide_by_nothing(name):
    kind = KINDS[name]
    with np.errstate(all="raise"):
        cells = ordered(np.arange(kind.nodes)[None], np.ones((kind.nodes, kind.dim)), kind)
    assert cells.shape[1:] == (kind.nodes,)
