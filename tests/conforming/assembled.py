"""Scalar matrices of elements other than linear triangles, assembled by scikit-fem, rows permuted at random."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad1,
    ElementQuad2,
    ElementQuadS2,
    ElementTriP1,
    ElementTriP2,
    ElementTriP3,
    MeshQuad,
    MeshTri,
    MeshTri2,
)
from skfem.helpers import dot, grad

ELEMENTS = {
    "P1": ElementTriP1,
    "P2": ElementTriP2,
    "P3": ElementTriP3,
    "Q1": ElementQuad1,
    "Q2": ElementQuad2,
    "S2": ElementQuadS2,
}


@dataclass(frozen=True, eq=False)
class Assembled:
    """A matrix, the positions of its rows, and its cells as sets of rows."""

    matrix: sp.csr_array
    points: NDArray[np.float64]
    cells: set[frozenset[int]]


@BilinearForm
def laplace(u, v, w):
    return dot(grad(u), grad(v))


@BilinearForm
def mass(u, v, w):
    return u * v


def assembled(
    element: str,
    *meshes: MeshTri | MeshQuad,
    c: float = 1.0,
    order: int | None = None,
    zeros: bool = True,
    seed: int = 0,
    reaction: float = 0.0,
) -> Assembled:
    """c times the Laplacian, and `reaction` times the mass matrix.

    Without `zeros` entries at rounding level are not stored. A second mesh, of the same points, has quadrilaterals
    beside the triangles of the first.
    """
    parts, cells, points = [], [], np.empty((0, 2))
    for mesh in meshes:
        own = "Q1" if element == "mixed" and isinstance(mesh, MeshQuad) else "P1" if element == "mixed" else element
        basis = Basis(mesh, ELEMENTS[own](), **({} if order is None else {"intorder": order}))
        parts.append((laplace.coo_data(basis), mass.coo_data(basis)))
        cells.append(basis.element_dofs.T)
        points = mesh.p.T if element == "mixed" else _nodes(basis)
    n = len(points)
    row, column = np.hstack([part.indices for part, _ in parts])
    value = np.hstack([c * part.data + reaction * more.data for part, more in parts])
    place = np.random.default_rng(seed).permutation(n)
    matrix = sp.coo_array((value, (place[row], place[column])), shape=(n, n)).tocsr()
    if not zeros:
        matrix.data[np.abs(matrix.data) < 1e-14 * np.abs(matrix.data).max()] = 0
        matrix.eliminate_zeros()
    sets = {frozenset(some) for own in cells for some in place[own].tolist()}
    return Assembled(matrix, points[np.argsort(place)], sets)


def _nodes(basis: Basis) -> NDArray[np.float64]:
    """(n, 2) where the nodes are; scikit-fem knows those of straight cells only."""
    points = basis.doflocs.T.copy()
    if isinstance(basis.mesh, MeshTri2):
        points[basis.element_dofs] = basis.mesh.doflocs[:, basis.mesh.dofs.element_dofs].transpose(1, 2, 0)
    return points


def quadrilaterals(m: int, n: int, *, shaken: float = 0.25, seed: int = 0) -> MeshQuad:
    """A lattice of m x n irregular quadrilaterals."""
    mesh = MeshQuad.init_tensor(np.arange(m + 1.0), np.arange(n + 1.0))
    shift = np.random.default_rng(seed).uniform(-shaken, shaken, mesh.p.shape)
    return MeshQuad(mesh.p + shift, mesh.t)


def with_hole(mesh: MeshQuad | MeshTri) -> MeshQuad | MeshTri:
    """The mesh without the cells in the middle."""
    centre = mesh.p.mean(axis=1)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    size = np.ptp(mesh.p, axis=1).min()
    return mesh.remove_elements(np.flatnonzero(np.linalg.norm(middle - centre[:, None], axis=0) < 0.2 * size))


def largest_error(found: NDArray, true: NDArray) -> float:
    """After the best similarity, mirrored or not, relative to the diameter."""
    z, w = found @ [1, 1j], true @ [1, 1j]
    w = w - w.mean()
    errors = []
    for one in (z, z.conj()):
        one = one - one.mean()
        errors.append(np.abs(np.vdot(one, w) / np.vdot(one, one) * one - w).max())
    return min(errors) / (2 * np.abs(w).max())


def cell_sets(recovery) -> set[frozenset[int]]:
    """Cells as sets of rows."""
    return {frozenset(some) for cells in recovery.cells.values() for some in cells.tolist()}


def same_but_for_diagonals(cells: set[frozenset[int]], others: set[frozenset[int]]) -> bool:
    """Whether cells are the same but for pairs that share a side and are divided along another diagonal."""
    mine, theirs = cells - others, others - cells
    both = _pairs(mine) & _pairs(theirs)
    covered = all(any(cell < pair for pair in both) for cell in mine | theirs)
    return len(mine) == len(theirs) == 2 * len(both) and covered


def _pairs(cells: set[frozenset[int]]) -> set[frozenset[int]]:
    """Rows of two quadratic triangles that share a side."""
    around: dict[int, list[frozenset[int]]] = {}
    for cell in cells:
        for row in cell:
            around.setdefault(row, []).append(cell)
    return {one | other for of in around.values() for one in of for other in of if len(one & other) == 3}
