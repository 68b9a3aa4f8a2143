"""Elasticity matrices assembled by scikit-fem, with every kind of support, and the truth about their nodes."""

from __future__ import annotations

from dataclasses import dataclass
from unittest import mock

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.helpers import ddot, grad, sym_grad, trace

from unassemble.clock import Clock
from unassemble.elasticity import Request, serve_body
from unassemble.elasticity.nullspace import PATCH
from unassemble.matrix import check_matrix
from unassemble.nodes import find_numbering, nodal_matrix, with_exact_sums
from unassemble.recovery import Body

ELEMENTS = {
    "tri-p1": (skfem.MeshTri, skfem.ElementTriP1),
    "tri-p2": (skfem.MeshTri, skfem.ElementTriP2),
    "quad-q1": (skfem.MeshQuad, skfem.ElementQuad1),
    "quad-s2": (skfem.MeshQuad, skfem.ElementQuadS2),
    "quad-q2": (skfem.MeshQuad, skfem.ElementQuad2),
    "tet-p1": (skfem.MeshTet, skfem.ElementTetP1),
    "tet-p2": (skfem.MeshTet, skfem.ElementTetP2),
    "hex-q1": (skfem.MeshHex, skfem.ElementHex1),
    "hex-s2": (skfem.MeshHex, skfem.ElementHexS2),
    "hex-q2": (skfem.MeshHex, skfem.ElementHex2),
}


@skfem.BilinearForm
def orthotropic(u, v, w):
    e, f = sym_grad(u), sym_grad(v)
    return trace(e) * trace(f) + 2 * ddot(e, f) + 0.3 * e[0, 0] * f[0, 0]


@skfem.BilinearForm
def vector_laplace(u, v, w):
    return ddot(grad(u), grad(v))


@dataclass(frozen=True)
class Assembled:
    """A matrix, node by node, and where its nodes are: (n, d) points, cells on the mesh's own vertices."""

    matrix: sp.csr_array
    points: np.ndarray
    cells: np.ndarray

    @property
    def dim(self) -> int:
        return self.points.shape[1]


def box(kind: str, counts, *, perturb: float = 0.0, seed: int = 0, grading: float = 1.0, stretch=None):
    """A mesh of a box with so many vertices along each axis."""
    mesh_type = ELEMENTS[kind][0]
    axes = [np.linspace(0, 1, k) ** grading for k in counts]
    mesh = mesh_type.init_tensor(*axes)
    p = mesh.p.copy()
    inner = np.all((p > 1e-9) & (p < 1 - 1e-9), axis=0)
    step = min(np.diff(a).min() for a in axes)
    p[:, inner] += perturb * step * np.random.default_rng(seed).uniform(-1, 1, (len(p), inner.sum()))
    if stretch is not None:
        p = p * np.asarray(stretch, dtype=float)[:, None]
    return mesh_type(p, mesh.t)


def stiffness(
    kind: str, mesh, *, lam=1.0, mu=1.0, within=False, tensor=None, form=None, intorder=None, quadrature=None
) -> Assembled:
    """Assemble; lam and mu are numbers, (m, 1) numbers of each cell, or functions of the position.

    A function is that of the cells' centres, or of the points of the quadrature where material varies `within` cells.

    Other material has a `tensor` of elasticity (d, d, d, d), another operator a `form` of vector-valued functions.
    A quadrature is given as its points and weights.

    Hexahedra of 27 nodes get three points in each direction, as in most codes, where scikit-fem would take seven.
    """
    intorder = intorder or {"hex-q2": 5}.get(kind)
    element = ELEMENTS[kind][1]()
    basis = skfem.Basis(mesh, element if form is None else skfem.ElementVector(element), intorder=intorder,
                        quadrature=quadrature)  # fmt: skip
    groups = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
    dofs = np.concatenate([g for g in groups if g is not None and g.size], axis=1)
    if form is not None:
        matrix = form.assemble(basis)
    elif tensor is not None:
        matrix = _of_tensor(tensor, _gradients(basis, 1.0))
    else:
        x = basis.global_coordinates() if within else mesh.p[:, mesh.t].mean(axis=1)[:, :, None]
        first, second = (_gradients(basis, one(x) if callable(one) else one) for one in (lam, mu))
        matrix = _isotropic(first, second)
    order = dofs.T.ravel() if form is not None else (dofs[0][:, None] + np.arange(mesh.dim()) * basis.N).ravel()
    matrix = sp.csr_array(matrix.tocsr()[order][:, order])
    return Assembled(matrix, basis.doflocs[:, dofs[0]].T.copy(), mesh.t.T.copy())


def _gradients(basis: skfem.Basis, factor) -> list[list[sp.csr_matrix]]:
    """Integrals of factor d_a phi_i d_e phi_j for scalar shape functions, by a and e.

    Vector-valued shape functions make far more, and dearer, integrals of the same d^2 numbers.
    """
    d = basis.mesh.dim()
    found = [[None] * d for _ in range(d)]
    for a in range(d):
        for e in range(a, d):
            form = skfem.BilinearForm(lambda u, v, w, a=a, e=e: factor * v.grad[a] * u.grad[e])
            found[a][e] = form.assemble(basis)
            found[e][a] = found[a][e].T
    return found


def _isotropic(first, second):
    """The matrix, direction by direction, from the integrals with lambda and with mu."""
    d = range(len(first))
    shear = sum(second[a][a] for a in d)
    return sp.bmat([[first[c][b] + second[b][c] + (shear if c == b else 0 * shear) for b in d] for c in d])


def _of_tensor(tensor, gradients):
    """The matrix, direction by direction, of a constant tensor of elasticity."""
    d = range(len(gradients))
    return sp.bmat([[sum(tensor[c, a, b, e] * gradients[a][e] for a in d for e in d) for b in d] for c in d])


def heterogeneous(x):
    """A Lame coefficient that varies smoothly and jumps."""
    return 1 + x[0] ** 2 + 3 * (x[1] > 0.5)


def permuted_nodes(case: Assembled, seed: int = 0) -> Assembled:
    """Number the nodes at random; unknowns stay interleaved."""
    n, d = case.points.shape
    p = np.random.default_rng(seed).permutation(n)
    rows = (p[:, None] * d + np.arange(d)).ravel()
    place = np.empty(n, dtype=int)
    place[p] = np.arange(n)
    return Assembled(case.matrix[rows][:, rows], case.points[p], place[case.cells])


def on_plane(case: Assembled, axis: int, value: float = 0.0) -> np.ndarray:
    """(n,) nodes in a plane across one axis."""
    return np.abs(case.points[:, axis] - value) < 1e-9


def eliminated(case: Assembled, gone: np.ndarray) -> tuple[sp.csr_array, np.ndarray]:
    """Remove unknowns, (n, d) mask; returns the matrix and the nodes left, in order of their rows."""
    rows = np.flatnonzero(~gone.ravel())
    nodes = np.flatnonzero(~gone.all(axis=1))
    return case.matrix[rows][:, rows], nodes


def with_identity(case: Assembled, gone: np.ndarray) -> sp.csr_array:
    """Replace rows and columns of unknowns by those of the identity."""
    keep = sp.diags_array((~gone.ravel()).astype(float))
    return sp.csr_array(keep @ case.matrix @ keep + sp.diags_array(gone.ravel().astype(float)))


def with_penalty(case: Assembled, held: np.ndarray, value: float = 1e10) -> sp.csr_array:
    """Put a huge number on the diagonal of unknowns."""
    return sp.csr_array(case.matrix + sp.diags_array(value * held.ravel().astype(float)))


def error(points: np.ndarray, truth: np.ndarray) -> float:
    """Largest distance relative to the diameter after the best translation and scale; undetermined nodes left out."""
    known = np.isfinite(points).all(axis=1)
    a, b = points[known], truth[known]
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    scale = (a * b).sum() / (a * a).sum()
    return float(np.linalg.norm(scale * a - b, axis=1).max() / np.linalg.norm(np.ptp(b, axis=0)))


def recover_elasticity(matrix, *, block_size=None, numbering=None, cells=True, patch=None) -> Body:
    """The body of a matrix that is one's; `patch` is the most nodes of a chart."""
    clock, checked = Clock(), check_matrix(matrix)
    whole, rounding = with_exact_sums(checked.csr())
    numbering = numbering or find_numbering(whole, block_size)
    with mock.patch.dict(PATCH, {} if patch is None else {2: patch, 3: patch}):
        return serve_body(nodal_matrix(whole, numbering), numbering, Request(checked, clock, None, cells, "", rounding))
