"""Elements with incompatible modes, and bodies in contact."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from assembled import Assembled, box, eliminated, error, on_plane, permuted_nodes, recover_elasticity, stiffness
from scipy.sparse.linalg import splu
from skfem.helpers import ddot, sym_grad, trace


class Bending(skfem.ElementH1):
    """Two parabolas inside a quadrilateral that do not fit to the neighbours' (Wilson's)."""

    interior_dofs = 2
    maxdeg = 2
    dofnames = ("a", "b")
    doflocs = np.array([[0.5, 0.5], [0.5, 0.5]])
    refdom = skfem.refdom.RefQuad

    def lbasis(self, X, i):
        slope = 4 - 8 * X[i]
        return 4 * X[i] * (1 - X[i]), np.stack([slope if k == i else 0 * slope for k in range(2)])


def with_incompatible_modes(mesh) -> Assembled:
    """Quadrilaterals with Wilson's modes, which are condensed in each cell."""

    @skfem.BilinearForm
    def form(u, v, w):
        return trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * ddot(sym_grad(u), sym_grad(v))

    outer = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad1()), intorder=4)
    inner = skfem.Basis(mesh, skfem.ElementVector(Bending()), intorder=4)
    across = form.assemble(outer, inner)
    correction = across.T @ splu(form.assemble(inner).tocsc()).solve(across.toarray())
    matrix = form.assemble(outer).toarray() - correction
    order = outer.nodal_dofs.T.ravel()
    matrix = sp.csr_array(np.where(np.abs(matrix) > 1e-13, matrix, 0)[order][:, order])
    return Assembled(matrix, mesh.p.T.copy(), mesh.t.T.copy())


def test_incompatible_modes_that_pass_the_patch_test_are_exact():
    """On parallelograms a constant stress does no work on Wilson's modes."""
    mesh = box("quad-q1", (10, 9))
    sheared = type(mesh)(np.array([[1.0, 0.4], [0.2, 1.1]]) @ mesh.p, mesh.t)
    given = permuted_nodes(with_incompatible_modes(sheared))
    found = recover_elasticity(given.matrix)
    assert found.certified
    assert error(found.points, given.points) < 1e-10


def test_incompatible_modes_that_do_not_are_a_best_fit():
    given = permuted_nodes(with_incompatible_modes(box("quad-q1", (10, 9), perturb=0.1)))
    found = recover_elasticity(given.matrix)
    assert found.status == "uncertified"
    assert "no exact null vector" in found.reason
    assert error(found.points, given.points) < 0.05


def touching(gap: float = 0.0) -> Assembled:
    """Two blocks of different meshes one upon the other; springs across the joint, from nodes to sides facing them."""
    low = stiffness("quad-q1", box("quad-q1", (9, 6), perturb=0.2))
    high = stiffness("quad-q1", box("quad-q1", (7, 5), perturb=0.2), lam=2.0)
    raised = high.points + [0.0, 1.0 + gap]
    matrix = sp.block_diag([low.matrix, high.matrix], format="csr")
    n = len(low.points)
    top = np.flatnonzero(on_plane(low, 1, 1.0))
    bottom = np.flatnonzero(on_plane(high, 1))
    bottom = bottom[np.argsort(high.points[bottom, 0])]
    x = high.points[bottom, 0]
    jump = np.zeros((len(top), 2 * (n + len(raised))))
    for row, node in enumerate(top):
        right = int(np.clip(np.searchsorted(x, low.points[node, 0]), 1, len(x) - 1))
        share = (low.points[node, 0] - x[right - 1]) / (x[right] - x[right - 1])
        jump[row, 2 * node + 1] = 1
        jump[row, 2 * (n + bottom[right - 1]) + 1] = share - 1
        jump[row, 2 * (n + bottom[right]) + 1] = -share
    matrix = sp.csr_array(matrix + 50 * sp.csr_array(jump.T @ jump))
    return Assembled(matrix, np.vstack([low.points, raised]), low.cells)


@pytest.mark.parametrize("clamped", [False, True])
def test_closed_contact_is_exact(clamped):
    """Springs between points that lie upon each other know no linear field."""
    given = permuted_nodes(touching())
    matrix, nodes = eliminated(given, np.repeat((on_plane(given, 1) & clamped)[:, None], 2, axis=1))
    found = recover_elasticity(matrix, cells=False)
    assert found.certified
    assert len(found.evidence) == 1
    assert error(found.points, given.points[nodes]) < 1e-10


def test_a_gap_that_springs_bridge_is_not_in_the_matrix():
    """The springs are the same whatever the gap: the blocks come back touching."""
    found = recover_elasticity(touching(0.3).matrix, cells=False)
    assert found.certified
    assert error(found.points, touching().points) < 1e-10
