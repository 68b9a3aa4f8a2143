"""Pieces that the identities leave bent, made straight by what their elements say.

Where a homogeneous body is held all around, no boundary term is left that would fix the axes: the identities have more
solutions than translations and scale. With the boundary terms known to vanish, inside, they are scalar equations, the
same for each coordinate, whose solutions are the affine functions. Any d of these are an affine picture of the piece,
of which :mod:`.frame` finds the axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ...linalg import svd
from ..nodal import NodalMatrix, determined
from ..nullspace.atlas import null_fields
from ..nullspace.identities import identities, no_terms
from ..nullspace.placing import pieces_of
from ..nullspace.shape import EXACT, in_gauge, set_aside
from ..nullspace.solution import Solution
from ..results import Evidence
from .frame import frame

_NONE = 1e-6  # singular value of functions that are none, beside others of norm one

Rows = tuple[NodalMatrix, NDArray[np.bool_]]  # which of them are valid, (n, d, d) or (n, d, d, d)


@dataclass(frozen=True, eq=False)
class Straight:
    """A piece whose axes elements told: points (n, d), NaN elsewhere; lambda / mu; what the identities alone say."""

    points: NDArray[np.float64]
    ratio: float
    evidence: Evidence

    @property
    def nodes(self) -> NDArray[np.bool_]:
        """(n,) which nodes belong to it."""
        return determined(self.points)

    def piece_in(self, found: Solution) -> int:
        """The bent piece that this one is part of, -1 if none; nodes that are loose there are part of none."""
        return int(found.component[self.nodes].max())


def straightened(
    nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_], completed: Rows | None, patch: int | None
) -> Solution | None:
    """The solution with as many of its bent pieces straight as elements explain; unchanged where there are none.

    All identities place more nodes than those of rows inside alone, which have fewer solutions. So these are for
    pieces of which the first show no picture.

    Parameters
    ----------
    nodal : NodalMatrix
    found : Solution or None
        None where the identities determine nothing.
    valid : (n, d, d) bool
        By the strict rule.
    completed : (NodalMatrix, (n, d, d, d) bool), optional
        What rows next to rollers say too; see :mod:`.planes`.
    patch : int, optional
        Most nodes per chart.
    """
    bent = _bent(nodal, found)
    inside = valid & (valid.all(axis=(1, 2)) & bent)[:, None, None]
    if not inside.any():
        return found
    straight: list[Straight] = []
    if found is not None:
        rows, used = completed if completed is not None and found.planes else (nodal, found.valid)
        used = used & bent.reshape(-1, *(1,) * (used.ndim - 1))
        straight += _straight(nodal, inside, (rows, used), None, patch)
        for one in straight:
            inside = inside & (found.component != one.piece_in(found))[:, None, None]
    straight += _straight(nodal, inside, (nodal, inside), no_terms(nodal.dim), patch)
    return in_place(found, valid, straight) if straight else found


def _bent(nodal: NodalMatrix, found: Solution | None) -> NDArray[np.bool_]:
    """(n,) nodes of pieces of which more than translation and scale is free."""
    if found is None:
        return np.ones(nodal.n, dtype=bool)
    return np.isin(found.component, [piece for piece, freedom in enumerate(found.freedoms) if freedom])


def _straight(
    nodal: NodalMatrix,
    inside: NDArray[np.bool_],
    rows: Rows,
    terms: NDArray[np.float64] | None,
    patch: int | None,
) -> Iterator[Straight]:
    """Pieces that these rows hold together, and of which elements tell the axes."""
    component, n_pieces = pieces_of(*rows)
    graph = nodal.graph
    for piece in range(n_pieces):
        null = null_fields(*rows, np.flatnonzero(component == piece), patch=patch, terms=terms)
        exact = null.values <= EXACT
        if not len(exact) or exact[-1] or exact.sum() <= nodal.dim:
            continue
        shown = _picture(nodal, inside, null.nodes, null.fields[..., exact])
        told = None if shown is None else frame(nodal, shown[0])
        if shown is None or told is None:
            continue
        (points, fields), (matrix, ratio) = shown, told
        body = determined(points)
        points[body] = in_gauge(points[body] @ matrix.T, graph[body][:, body])
        residual, gap = map(float, null.values[[nodal.dim, exact.sum()]])
        yield Straight(points, ratio, Evidence(fields, residual, gap, null.rows))


def _picture(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], null: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int] | None:
    """An affine picture among null fields, (n, d), NaN elsewhere, and how many of the fields it has; None if none.

    Parameters
    ----------
    nodal : NodalMatrix
    inside : (n, d, d) bool
        Rows whose boundary terms vanish in homogeneous material.
    nodes : (N,) int64
        Of the piece.
    null : (N, d, k) float64
        Orthonormal fields that satisfy its identities.
    """
    if not inside[nodes].any():
        return None
    null = _without_terms(nodal, inside, nodes, null)
    d, functions = nodal.dim, _functions(null)
    held = np.ones(len(nodes), dtype=bool)
    if functions.shape[1] > d:  # those of nodes that can move by themselves are among them
        _, loose = set_aside(np.column_stack([np.full(len(nodes), len(nodes) ** -0.5), functions])[:, None], d + 1)
        held = ~loose
        functions = _functions(null[held])
    if functions.shape[1] != d:
        return None
    points = np.full((nodal.n, d), np.nan)
    points[nodes[held]] = functions
    return points, int((scipy.linalg.svdvals(null[held].reshape(-1, null.shape[2])) > _NONE).sum())


def _without_terms(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], null: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, d, k') those of the fields without boundary terms inside."""
    n, d, k = null.shape
    place = np.full(nodal.n, -1)
    place[nodes] = np.arange(n)
    scalar = identities(nodal, inside, nodes, no_terms(d))
    residual = scalar.residual(null[place[scalar.columns]]).reshape(-1, k)
    _, values, v = svd(np.linalg.qr(residual, mode="r"))
    kept = np.concatenate([values, np.zeros(k - len(values))]) <= 10 * EXACT
    return np.asarray(null.reshape(-1, k) @ v[kept].T).reshape(n, d, -1)


def _functions(null: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, m) orthonormal basis of all components of the fields, constants aside."""
    flat = (null - null.mean(axis=0)).reshape(len(null), -1)
    u, s, _ = svd(flat, full_matrices=False)
    return np.asarray(u[:, s > _NONE * max(s.max(initial=0), _NONE)])


def in_place(found: Solution | None, valid: NDArray[np.bool_], straight: list[Straight]) -> Solution:
    """Straight pieces, one at least, in place of the bent ones that they are part of."""
    component, points = np.full(len(valid), -1), np.full(straight[0].points.shape, np.nan)
    evidence: list[Evidence] = []
    freedoms: list[str] = []
    if found is not None:
        better = {one.piece_in(found) for one in straight}
        for piece in range(len(found.freedoms)):
            if piece not in better:
                here = found.component == piece
                component[here], points[here] = len(freedoms), found.points[here]
                evidence.append(found.evidence[piece])
                freedoms.append(found.freedoms[piece])
    for one in straight:
        component[one.nodes], points[one.nodes] = len(freedoms), one.points[one.nodes]
        evidence.append(one.evidence)
        freedoms.append("")
    base = Solution(valid, component, points, (), (), exact=True, warnings=()) if found is None else found
    return replace(
        base,
        component=component,
        points=points,
        evidence=tuple(evidence),
        freedoms=tuple(freedoms),
        straight=tuple(one.ratio for one in straight),
    )
