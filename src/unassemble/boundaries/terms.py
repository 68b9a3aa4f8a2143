"""Terms on the boundary, taken off by row sums: Robin conditions, and flow of a constant field through it.

On an edge ab of the boundary each adds m_ab (1/3 1/6; 1/6 1/3), m_ab = alpha |ab| for alpha u v, or half the flux of
the field through ab for the symmetric part of a convection. Rows of everything else add up to zero, so that the row of
a boundary vertex adds up to half of m on both sides of it: around a loop of oddly many edges these equations give m,
and around one of evenly many all but m_k + (-1)^k t. The t of each such loop is the one with which a conformal map has
all entries.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..certificate import BoundaryCertificate, Findings, Unique, Verdict, certify_with_boundary_terms
from ..clock import Clock
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..planar.piece import left_by_map
from ..recovery import Examined, Placed, PlanarMesh, finish
from ..tolerances import ALIKE, ROUNDED
from ..topology import Piece
from ..words import Reason


def recover_without_boundary_terms(
    matrix: OperatorMatrix,
    plain: Callable[[OperatorMatrix], PlanarMesh],
    scale: float | None,
    clock: Clock,
    tensor: tuple[float, float, float] | None = None,
) -> PlanarMesh | None:
    """The certified mesh of a matrix with terms on its boundary; None where there are no such terms.

    It is certified only where the operator with terms of one factor for each loop and one field, integrated on the mesh
    as it is written, gives all entries back, those on the diagonal too. `plain`: the mesh of a matrix without terms;
    `scale`: c, where it is known; `tensor`: (kxx, kxy, kyy) to be undone.
    """
    loops = _Loops.of(matrix)
    if loops is None:
        return None
    terms = loops.terms(matrix, scale)
    if terms is None:
        return None
    try:
        found = plain(loops.without(matrix, terms))
    except RecoveryError:
        return None
    if not found.certified or found.node_status.any():
        return None
    note = (
        "entries on the boundary have a term of their own, a Robin condition or half of a flow through it: row sums "
        "say how much, and it was taken off"
    )
    whole = finish(
        clock,
        lambda: Placed(found, (*found.warnings, note)),
        lambda mesh: certify_with_boundary_terms(matrix, mesh, tensor),
        lambda _, compared: _examined(compared, found.verdict),
    )
    return whole if whole.certified else None


def _examined(compared: BoundaryCertificate, known: Verdict) -> Examined:
    """What is found out about a mesh with terms on its boundary; `known` is what it is worth without them."""
    error = compared.backward_error
    fits = (
        "the operator with the terms on its boundary, re-assembled on this mesh, gives the matrix back to "
        f"{error:.1e} (relative)"
    )
    objections = list(known.objections)
    if not compared.spare > 0:
        objections.append(Reason("the boundary has no more edges than its terms have factors, so that any terms fit"))
    # Other meshes were looked for without terms, or with the same: with others there may be more.
    unique: Unique = "searched" if known.unique == "proved" else known.unique
    return Examined(Findings((fits,), error, tuple(objections), unique=unique), fields=compared.entries.counts())


def unless_flow(matrix: OperatorMatrix, found: PlanarMesh) -> PlanarMesh:
    """A mesh of c L + D; ambiguous where D is what a convection leaves whose flow crosses the boundary.

    Of a divergence-free flow, the symmetric part has sums in the rows of the boundary alone, which add up to zero. It
    has entries on the edges of the boundary, too, and regular meshes have so few different entries that another mesh
    may have them without a flow.
    """
    lacking, sums = matrix.incomplete_rows, matrix.row_sums
    rim = np.zeros(matrix.n, dtype=bool)
    rim[found.boundary] = True
    size = float(np.abs(sums[lacking]).sum())
    if not lacking.any() or (lacking & ~rim).any() or abs(float(sums[lacking].sum())) > ALIKE * size:
        return found
    return replace(found, verdict=found.verdict.beside(_FLOW))


_FLOW = Reason(
    "only rows of the boundary do not add up to zero, and their sums cancel, as those of a flow through it do: with "
    "such a flow the mesh is another"
)


@dataclass(frozen=True, eq=False)
class _Loops:
    """Boundary edges, loop by loop in running order, of a matrix of a single piece."""

    piece: Piece
    ends: NDArray[np.int64]  # (b, 2) rows of the matrix
    edge: NDArray[np.int64]  # (b,) rows of `matrix.edges`
    loop: NDArray[np.int64]  # (b,)
    sign: NDArray[np.int64]  # (b,) 1 and -1 in turn, from 1 in each loop
    sums: NDArray[np.float64]  # (b,) of the row at the first end of each edge

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> _Loops | None:
        """None unless there is one piece, without pinched vertices, and only rows of its boundary have sums."""
        incomplete = matrix.incomplete_rows
        if not incomplete.any():
            return None
        topology = matrix.surfaces
        if len(topology.pieces) != 1 or topology.pieces[0].n_vertices < matrix.n:
            return None
        (piece,) = topology.pieces
        ends = piece.vertices[piece.boundary]
        outside = np.zeros(matrix.n, dtype=bool)
        outside[ends[:, 0]] = True
        if (incomplete & ~outside).any() or outside.sum() < len(ends) or len(piece.edges) < len(matrix.edges):
            return None
        key = np.searchsorted(matrix.edges @ [matrix.n, 1], np.sort(ends, axis=1) @ [matrix.n, 1])
        size = np.diff(piece.loop_offsets)
        place = np.arange(len(ends)) - np.repeat(piece.loop_offsets[:-1], size)
        return cls(
            piece, ends, key, np.repeat(np.arange(len(size)), size), 1 - 2 * (place % 2), matrix.row_sums[ends[:, 0]]
        )

    def _particular(self) -> NDArray[np.float64] | None:
        """(b,) terms that give the row sums; None where there are none."""
        terms = np.empty(len(self.loop))
        for start, end in zip(self.piece.loop_offsets[:-1], self.piece.loop_offsets[1:], strict=True):
            sign, twice = self.sign[start:end], 2 * self.sums[start:end]
            along = np.cumsum(sign * twice) - twice[0]  # less the first term: signed ones
            if len(sign) % 2:
                first = (twice[0] - along[-1]) / 2
            elif abs(along[-1] + twice[0]) > ALIKE * np.abs(twice).sum():
                return None
            else:
                first = -along.mean()
            terms[start:end] = sign * (first + along)
        return terms

    def terms(self, matrix: OperatorMatrix, scale: float | None) -> NDArray[np.float64] | None:
        """(b,) m with which a conformal map has all entries, by least squares; None where there is none."""
        terms = self._particular()
        if terms is None:
            return None
        even = np.flatnonzero(np.diff(self.piece.loop_offsets) % 2 == 0)
        ways = np.where(self.loop[:, None] == even, self.sign[:, None], 0) * np.median(np.abs(matrix.entries))

        def misfit(t: NDArray) -> NDArray[np.float64]:
            weights = -self.without(matrix, terms + ways @ t).entries[self.piece.edge_rows]
            found = left_by_map(self.piece, weights, scale)
            if found is None or not np.isfinite(found[1]).all():
                return np.full(len(weights), 1 / ALIKE)  # so that no step ends there
            return found[1]

        left = misfit(np.zeros(len(even)))
        if len(even):
            found = least_squares(misfit, np.zeros(len(even)), ftol=None, xtol=ROUNDED, gtol=ROUNDED, max_nfev=12)
            terms, left = terms + ways @ found.x, found.fun
        return terms if np.abs(left).max() <= ALIKE else None

    def without(self, matrix: OperatorMatrix, terms: NDArray) -> OperatorMatrix:
        """The matrix less these terms."""
        entries, diagonal = matrix.entries.copy(), matrix.diagonal.copy()
        entries[self.edge] -= terms / 6
        for end in self.ends.T:
            diagonal[end] -= terms / 3
        return replace(matrix, entries=entries, diagonal=diagonal)
