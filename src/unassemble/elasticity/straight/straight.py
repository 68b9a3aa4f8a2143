"""Pieces that the identities leave bent, made straight by what their elements say.

Where a homogeneous body is held all around, no boundary term is left that would fix the axes: the identities have more
solutions than translations and scale. With the boundary terms known to vanish, inside, they are scalar equations, the
same for each coordinate, among whose solutions are the affine functions. These make up an affine picture of the piece
(:mod:`.pictures`), of which :mod:`.frame` finds the axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..nodal import NodalMatrix, determined
from ..nullspace.atlas import null_fields
from ..nullspace.identities import no_terms
from ..nullspace.placing import pieces_of
from ..nullspace.shape import EXACT, in_gauge
from ..nullspace.solution import Solution
from ..results import Evidence
from .frame import frame
from .pictures import picture
from .rigid import interchangeable, rigid

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
        shown = picture(nodal, inside, null.nodes, null.fields[..., exact])
        one = None if shown is None else frame(nodal, shown.points)
        if shown is None or one is None:
            continue
        body = determined(shown.points)
        points = np.full_like(shown.points, np.nan)
        points[body] = in_gauge(shown.points[body] @ one.map.T, graph[body][:, body])
        models = tuple(replace(model, points=points) for model in one.models)
        told = not shown.told_by_cells or not interchangeable(nodal, inside, body)
        if told and (not shown.told_by_cells or rigid(models, one.entries, one.ratio, shown.functions)):
            residual, gap = map(float, null.values[[nodal.dim, exact.sum()]])
            yield Straight(points, one.ratio, Evidence(shown.fields, residual, gap, null.rows))


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
