"""Elasticity matrices assembled by scikit-fem, with every kind of support, and the truth about their nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.helpers import ddot, grad, sym_grad, trace

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


def stiffness(kind: str, mesh, *, lam=1.0, mu=1.0, form=None, intorder=None, quadrature=None) -> Assembled:
    """Assemble; lam and mu are numbers, (m, 1) numbers of each cell, or functions of the position.

    A quadrature is given as its points and weights.

    Hexahedra of 27 nodes get three points in each direction, as in most codes, where scikit-fem would take seven.
    """
    intorder = intorder or {"hex-q2": 5}.get(kind)
    element = skfem.ElementVector(ELEMENTS[kind][1]())
    basis = skfem.Basis(mesh, element, intorder=intorder, quadrature=quadrature)

    @skfem.BilinearForm
    def isotropic(u, v, w):
        first = lam(w.x) if callable(lam) else lam
        second = mu(w.x) if callable(mu) else mu
        return first * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * second * ddot(sym_grad(u), sym_grad(v))

    matrix = (form or isotropic).assemble(basis)
    groups = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
    dofs = np.concatenate([g for g in groups if g is not None and g.size], axis=1)
    order = dofs.T.ravel()
    matrix = sp.csr_array(matrix.tocsr()[order][:, order])
    return Assembled(matrix, basis.doflocs[:, dofs[0]].T.copy(), mesh.t.T.copy())


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
