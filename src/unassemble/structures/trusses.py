"""Pin-jointed trusses: the block of two nodes is that of a bar, and tells its direction.

A bar between nodes i and j with direction e has A_ij = - k e e^T, and nothing else has. So for every bar, whatever its
stiffness, next to supports as well, (I - e e^T) (x_i - x_j) = 0: linear in the coordinates. All solutions have the
bars' directions; where the truss has enough of them, these are its translations and enlargements.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import GeometryError
from ..matrix import OperatorMatrix
from ..nodes.anchoring import anchored, checked_anchors, digits_lost, near_enough
from ..nodes.nodal import NodalMatrix, determined, nodal_matrix
from ..nodes.numbering import Numbering
from ..nodes.redrawn import Known, known_to
from ..nodes.rounded import Rounding
from ..nodes.shape import in_gauge, shape
from ..recovery import Evidence, Structure
from ..tolerances import ALIKE, CERTIFIED, SINGULAR, SMALL
from ..words import Reason, count_of
from .bars import Bars, bars_of
from .placed import Piece, Placed, Positions, covered, placed, without_free
from .positions import least_squares


def serve_truss(
    matrix: OperatorMatrix,
    nodal: NodalMatrix,
    numbering: Numbering,
    bars: Bars,
    clock: Clock,
    *,
    anchors: Sequence[Any] | None,
    choice: str,
    rounding: Rounding | None = None,
) -> Structure:
    """Recover a truss, up to the size of each piece.

    Raises
    ------
    InputError
        For anchors that do not fit.
    RecoveryError
        If no piece is determined.
    """
    known = checked_anchors(anchors, numbering.node_of_row, nodal.dim)
    with clock("solve"):
        found = place_joints(bars, nodal.n, rounding.spread if rounding else CERTIFIED)
    with clock("certify"):
        misfits = bars_misfits(nodal, found.points)
        error = float(np.abs(misfits).max(initial=0.0))
        certain = _known(misfits, found, numbering, rounding)
    loose = found.component < 0
    points, factor, notes = anchored(found.points, found.component, len(found.evidence), known)
    if loose.any():
        notes.append(f"{loose.sum()} of {count_of(nodal.n, 'node')} cannot be determined: the directions of all bars "
                     "leave them room")  # fmt: skip
    if np.isnan(factor).any():
        notes.append("the sign of the scale is free: the point reflection of a truss has the same matrix")
    lost = digits_lost(points, found.points, found.component, factor)
    status, reason = _verdict(error, found, certain, rounding)
    if status == "certified":
        rows = ~loose[numbering.node_of_row]
        reason = Reason(f"{reason.text}: {covered(rows, rows)}")
    status, reason = near_enough(status, reason, lost)
    return Structure(
        **found.fields(numbering),
        points=points,
        lines=bars.ends[~loose[bars.ends].any(axis=1)],
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason.text,
        advice=reason.advice,
        operator="truss",
        backward_error=error,
        position_error=certain.error if rounding and certain.explained else None,
        timings=clock.timings,
        warnings=(*matrix.warnings, *found.notes, *notes),
        choice=choice,
    )


def _known(misfits: NDArray, found: Placed, numbering: Numbering, rounding: Rounding | None) -> Known:
    """How far positions may be off, relative to the size."""
    if rounding is None:
        return Known(max(one.residual / one.gap for one in found.evidence))
    allowed = rounding.spread

    def place(matrix: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        nodal = nodal_matrix(matrix, numbering)
        bars = bars_of(nodal, allowed)
        if bars is None:
            raise GeometryError("blocks are no longer those of bars")
        points = place_joints(bars, numbering.n_nodes, allowed).points
        return points, bars_misfits(nodal, points)

    return known_to(found.points, found.component, misfits, rounding, place, sized=False)


def _verdict(error: float, found: Placed, known: Known, rounding: Rounding | None) -> tuple[str, Reason]:
    if not (error <= (rounding.spread if rounding else CERTIFIED) and known.explained):
        return "uncertified", Reason(f"a block differs from that of a bar by {error:.1e} of the row's largest entry")
    if found.unnoticed.any():
        return "uncertified", Reason(
            "supports leave parts of bars only, and nothing contradicts other directions of these"
        )
    if known.error > (rounding.needed if rounding else ALIKE):
        return "uncertified", Reason(
            f"the directions of the bars contradict each other by {found.residual:.1e}: positions are known to about "
            f"{known.error:.0e} of the size"
        )
    digits = f", to {known.error:.0e} of the size as entries rounded to {rounding.name} leave it" if rounding else ""
    return "certified", Reason(
        f"bars along these directions re-assemble to the matrix, and these determine the nodes{digits}"
    )


def place_joints(bars: Bars, n: int, allowed: float = CERTIFIED) -> Placed:
    """Find positions for which all bars have their directions.

    Whole blocks are those of bars or not, but a block of which only one row or column is left is that of a bar for any
    numbers: bars that only such blocks tell of count where others would contradict their directions.

    Raises
    ------
    GeometryError
        If no piece is determined: its bars may turn against each other.
    """
    d = bars.directions.shape[1]
    ends, directions, whole = bars.ends[bars.known], bars.directions[bars.known], bars.whole[bars.known]

    def solve(piece: Piece) -> Positions:
        order = len(piece.nodes)
        links = sp.csr_array((np.ones(len(piece.edges)), piece.edges.T), shape=(order, order))
        links = sp.csr_array(links + links.T)
        _, probes, fields, values = least_squares(piece.operator, np.zeros(len(piece.rows)), d)
        one = shape(fields, values, np.zeros(order, dtype=bool))
        which = piece.rows.reshape(-1, d)[:, 0] // d
        seen = _across_one(directions[which]) @ probes[:, 1:].reshape(-1, d, probes.shape[1] - 1)
        blind = ~whole[which] & (np.linalg.svd(seen, compute_uv=False)[:, d - 2] < SMALL)
        gap = values[values > SINGULAR]
        evidence = Evidence(one.dimension, float(values[d]), float(gap[0]) if len(gap) else float("inf"), len(which))
        return Positions(in_gauge(one.points, links), evidence, np.repeat(blind, d))

    return without_free(placed(_across(ends, directions, n), d, ends, solve, allowed), d + 1)


def _across_one(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, d, d) I - e e^T of each bar."""
    return np.asarray(np.eye(directions.shape[1]) - directions[:, :, None] * directions[:, None, :])


def _across(ends: NDArray[np.int64], directions: NDArray[np.float64], n: int) -> sp.csr_array:
    """(m d, n d) what a field moves the ends of each bar against each other across its direction."""
    m, d = directions.shape
    across = _across_one(directions)
    blocks = np.stack([across, -across], axis=1).reshape(2 * m, d, d)
    return sp.bsr_array((blocks, ends.ravel(), np.arange(0, 2 * m + 1, 2)), shape=(m * d, n * d)).tocsr()


def bars_misfits(nodal: NodalMatrix, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Entries that are left of blocks, (k,), once the bars between the given points are taken away.

    Relative to the largest off-diagonal entry of the node's rows; pairs with undetermined nodes do not count. Infinite
    where both ends of a bar lie in one point.
    """
    known = determined(points)
    i, j = nodal.node, nodal.indices
    off = (i != j) & known[i] & known[j]
    blocks, i, j = nodal.data[off], i[off], j[off]
    along = points[i] - points[j]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if (length == 0).any():
        return np.array([np.inf])  # a bar without length has no direction
    along /= length
    present = nodal.row_of >= 0
    bar = along[:, :, None] * along[:, None, :] * (present[i][:, :, None] & present[j][:, None, :])
    weight = (bar * bar).sum(axis=(1, 2))
    force = (blocks * bar).sum(axis=(1, 2)) / np.where(weight > 0, weight, 1)
    left = blocks - force[:, None, None] * bar
    size = np.zeros(nodal.n)
    np.maximum.at(size, i, np.abs(blocks).max(axis=(1, 2), initial=0))
    return np.asarray(left / np.where(size[i] > 0, size[i], 1)[:, None, None]).ravel()
