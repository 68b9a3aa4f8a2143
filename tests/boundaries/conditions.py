"""Boundary conditions put into the matrices of meshes, as libraries do it; rows in random order."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import (
    Basis,
    BilinearForm,
    Element,
    ElementTriP0,
    ElementTriP1,
    FacetBasis,
    Mesh,
    MeshQuad,
    MeshTri,
    condense,
    enforce,
)
from skfem.helpers import dot, grad
from skfem.models import laplace, mass

from meshes import largest_error
from unassemble import PlanarMesh

Given = tuple[sp.csr_array, NDArray]
LINEAR = ElementTriP1()


def mesh_of(points: NDArray, cells: NDArray) -> Mesh:
    """Centred and of size 1: shares of Robin terms and convection then do not depend on units."""
    points = (points - points.mean(axis=0)) / np.ptp(points)
    kind = MeshTri if cells.shape[1] == 3 else MeshQuad
    return kind(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def jittered(levels: int = 3, seed: int = 0) -> MeshTri:
    """A square of triangles in no order but with decent angles, on the boundary too."""
    mesh = MeshTri.init_sqsymmetric().refined(levels)
    rng = np.random.default_rng(seed)
    move = rng.uniform(-1, 1, mesh.p.shape) * 0.12 / 2**levels
    sides = np.isclose(mesh.p, 0) | np.isclose(mesh.p, 1)
    return MeshTri(mesh.p + np.where(sides, 0, move), mesh.t)


def shuffled(matrix: sp.csr_array, points: NDArray, seed: int = 0) -> Given:
    order = np.random.default_rng(seed).permutation(len(points))
    place = np.argsort(order)
    entries = sp.coo_array(matrix)  # keeps stored zeros
    moved = sp.coo_array((entries.data, (place[entries.row], place[entries.col])), shape=matrix.shape)
    return moved.tocsr(), points[order]


def eliminated(mesh: Mesh, part: Callable[[NDArray], NDArray] | None = None, element: Element = LINEAR) -> Given:
    """Rows and columns of unknowns on the boundary, or of those that `part` marks by their place, taken out."""
    basis = Basis(mesh, element)
    gone = basis.get_dofs().all()
    gone = gone if part is None else gone[part(basis.doflocs[:, gone])]
    inside = np.setdiff1d(np.arange(basis.N), gone)
    return shuffled(condense(laplace.assemble(basis), D=gone, expand=False), basis.doflocs.T[inside])


def identity_rows(mesh: Mesh, c: float = 1.0, element: Element = LINEAR) -> Given:
    """Rows of unknowns on the boundary replaced, columns kept."""
    basis = Basis(mesh, element)
    return shuffled(enforce(c * laplace.assemble(basis), D=basis.get_dofs().all()), basis.doflocs.T)


def robin(mesh: MeshTri, alpha: float) -> Given:
    """With alpha u on the boundary."""
    matrix = laplace.assemble(Basis(mesh, ElementTriP1()))
    return shuffled(matrix + alpha * mass.assemble(FacetBasis(mesh, ElementTriP1())), mesh.p.T)


def convected(mesh: MeshTri, field: tuple[float, float]) -> Given:
    """With a constant field: not symmetric."""

    @BilinearForm
    def form(u, v, w):
        return dot(grad(u), grad(v)) + (field[0] * grad(u)[0] + field[1] * grad(u)[1]) * v

    return shuffled(form.assemble(Basis(mesh, ElementTriP1())), mesh.p.T)


def determined(found: PlanarMesh, points: NDArray) -> float:
    """The share of points that are said to be determined, once it is checked that they are right."""
    known = found.node_status == 0
    if known.sum() > 2:
        assert largest_error_of(found, points, known) <= 1e-8
    return float(known.mean())


def largest_error_of(found: PlanarMesh, points: NDArray, known: NDArray) -> float:
    """Of each piece by itself."""
    pieces = [known & (found.component == label) for label in range(found.n_components)]
    return max(largest_error(found.points[rows], points[rows]) for rows in pieces if rows.sum() > 2)


def materials(
    mesh: MeshTri,
    factors: Sequence[float],
    at: Callable[[NDArray], NDArray] | None = None,
    outside: Callable[..., sp.csr_array] | None = None,
) -> Given:
    """With a factor for each of two halves, or four quarters, or for what `at` tells from the centres of triangles.

    Boundary unknowns are those of `outside`, ``condense`` or ``enforce``.
    """
    centre = mesh.p[:, mesh.t].mean(axis=1)

    @BilinearForm
    def form(u, v, w):
        return w.k * dot(grad(u), grad(v))

    flat = Basis(mesh, ElementTriP0())
    values = flat.zeros()
    values[flat.element_dofs[0]] = np.array(factors)[(at or parts(mesh, len(factors)))(centre).astype(int)]
    matrix = form.assemble(Basis(mesh, ElementTriP1()), k=flat.interpolate(values))
    if outside is enforce:
        return shuffled(enforce(matrix, D=mesh.boundary_nodes()), mesh.p.T)
    if outside is condense:
        matrix = condense(matrix, D=mesh.boundary_nodes(), expand=False)
        return shuffled(matrix, mesh.p.T[mesh.interior_nodes()])
    return shuffled(matrix, mesh.p.T)


def parts(mesh: MeshTri, count: int) -> Callable[[NDArray], NDArray]:
    """Which of two halves, or four quarters, of the triangles of a mesh points (2, k) are in."""
    middle = np.median(mesh.p[:, mesh.t].mean(axis=1), axis=1) + 1e-9 * np.ptp(mesh.p)  # whatever rounding does

    def at(points: NDArray) -> NDArray:
        right, above = points > middle[:, None]
        return right + (2 * above if count > 2 else 0)

    return at


def determined_factors(found: PlanarMesh, points: NDArray) -> tuple[NDArray, NDArray]:
    """Factors of triangles with three points that are determined, and the true centres of these triangles, (2, k)."""
    known = (found.node_status == 0)[found.triangles].all(axis=1)
    assert found.region is not None
    return found.scale[found.region[known]], points[found.triangles[known]].mean(axis=1).T
