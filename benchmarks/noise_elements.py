"""Matrices of quadratic triangles and of quadrilaterals, with the derivative of their entries for the bound of errors.

Straight cells have the positions of their corners for unknowns, whatever their order, and errors are those of corners.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from bound import Bound, mesh_of_at_least
from skfem import Basis, ElementQuad1, ElementTriP1, ElementTriP2, MeshTri

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from conforming.assembled import laplace, quadrilaterals, with_hole

ORDER = {"P2": 2, "Q1": 3}
"""Of the quadrature: exact, and two points by two."""


def specimen(element: str, size: int) -> tuple[sp.csr_array, np.ndarray, np.ndarray, Bound]:
    """A matrix of at least about so many rows, in random order, without its zeros.

    Returns
    -------
    matrix : (n, n)
    corners : (v,) int
        Rows.
    z : (v,) complex
        Their positions, the mesh as large as a circle of diameter 1.
    bound : Bound
    """
    if element == "P2":
        points, triangles = mesh_of_at_least(size // 4)
        mesh = MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))
    else:
        side = int(np.ceil(np.sqrt(size)))
        mesh = with_hole(quadrilaterals(side, side))
    z = np.array([1, 1j]) @ mesh.p
    z = (z - z.mean()) / (2 * np.abs(z - z.mean()).max())
    mesh = type(mesh)(np.stack([z.real, z.imag]), mesh.t)
    basis = Basis(mesh, {"P2": ElementTriP2, "Q1": ElementQuad1}[element](), intorder=ORDER[element])
    place = np.random.default_rng(1).permutation(basis.N)
    stiffness = laplace.assemble(basis).tocoo()
    large = np.abs(stiffness.data) > 1e-14 * np.abs(stiffness.data).max()
    row, column = place[stiffness.row[large]], place[stiffness.col[large]]
    matrix = sp.coo_array((stiffness.data[large], (row, column)), shape=stiffness.shape).tocsr()
    return matrix, place[basis.nodal_dofs[0]], z, Bound(z, *entries_and_derivative(basis, place, matrix))


def entries_and_derivative(basis: Basis, place: np.ndarray, matrix: sp.csr_array) -> tuple[np.ndarray, sp.csr_array]:
    """w (e,) of the entries of a matrix of straight cells, and dw / d(x, y) (e, 2 v).

    Corners are moved along the imaginary axis; the imaginary parts of the entries of their cells are the derivatives,
    exact to rounding, for no differences are taken.
    """
    at, weight = basis.quadrature
    straight = ElementTriP1() if isinstance(basis.mesh, MeshTri) else ElementQuad1()
    own, mapped = (np.stack([e.lbasis(at, k)[1] for k in range(nodes)]) for e, nodes in (
        (basis.elem, basis.Nbfun), (straight, len(basis.mesh.t))))  # fmt: skip
    a, b = np.triu_indices(basis.Nbfun, 1)
    ends = place[basis.element_dofs][[a, b]]
    key = ends.min(axis=0) * basis.N + ends.max(axis=0)  # (pairs, m)
    upper = sp.triu(matrix, 1).tocoo()
    stored = np.sort(upper.row.astype(np.int64) * basis.N + upper.col)
    edge = np.minimum(np.searchsorted(stored, key), len(stored) - 1)
    there = stored[edge] == key

    def entries(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        (xs, xt), (ys, yt) = (np.einsum("kdq,km->dmq", mapped, of) for of in (x, y))
        p, r = own[:, 0][:, None], own[:, 1][:, None]
        first, second = p * yt - r * ys, r * xs - p * xt  # the gradient times the determinant
        determinant = xs * yt - xt * ys
        scaled = weight / np.where(determinant.real > 0, determinant, -determinant)
        return -((first[a] * first[b] + second[a] * second[b]) * scaled).sum(axis=2)

    x, y = basis.mesh.p[:, basis.mesh.t]
    w = np.bincount(edge[there], entries(x, y)[there], len(stored))
    assert np.allclose(w, -matrix[stored // basis.N, stored % basis.N], rtol=1e-9, atol=1e-12)
    total = sp.csr_array((len(stored), 2 * basis.mesh.p.shape[1]))
    tiny = 1e-30
    for k, vertex in enumerate(basis.mesh.t):
        for part in range(2):
            step = np.zeros((2, *basis.mesh.t.shape), complex)
            step[part, k] = 1j * tiny
            slope = entries(x + step[0], y + step[1]).imag / tiny
            column = np.broadcast_to(2 * vertex + part, slope.shape)
            total += sp.coo_array((slope[there], (edge[there], column[there])), shape=total.shape).tocsr()
    return w, total
