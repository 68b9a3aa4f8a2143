"""Coordinates from the matrix of a frame, shell or plate, in true units of length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..clock import Clock
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..nodes.anchoring import anchored, checked_anchors, digits_lost, near_enough
from ..nodes.rounded import Rounding, with_exact_sums
from ..recovery import Structure
from ..tolerances import ALIKE, CERTIFIED
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of
from .certificate import forces, members_misfits
from .members import members_and_cells, mispaired
from .nodes import Nodes, nodes_of
from .placed import Placed, covered
from .recognise import StructuralNumbering
from .straight import straight_members
from .turning import turning_positions


def serve_structure(
    matrix: OperatorMatrix,
    numbering: StructuralNumbering,
    clock: Clock,
    *,
    anchors: Sequence[Any] | None,
    choice: str,
    cells: bool,
) -> Structure:
    """Recover the coordinates of a structure whose nodes and directions are known, in true units of length.

    Parameters
    ----------
    matrix : OperatorMatrix
    numbering : StructuralNumbering
    clock : Clock
    anchors : sequence of (row, x, y) or (row, x, y, z), optional
        They move pieces; size and axes are the matrix's own.
    choice : str
        Why the matrix was taken for a structure's.
    cells : bool
        Look for members and shell cells too.

    Raises
    ------
    InputError
        For anchors that do not fit.
    RecoveryError
        If no node is determined.
    """
    layout = numbering.layout
    node, direction = numbering.node_of_row, numbering.direction_of_row
    known = checked_anchors(anchors, node, layout.space)
    whole, rounding = with_exact_sums(matrix.csr())
    nodes = nodes_of(whole, layout, node, direction)
    with clock("solve"), blas_threads(1):
        members = straight_members(nodes)
        found, valid = turning_positions(nodes, members)
    with clock("certify"):
        counted = np.zeros((len(node), len(layout.rotations)), dtype=bool)
        counted[nodes.row_of[nodes.present]] = valid[nodes.present]
        force, used = forces(whole, layout, node, direction, found.points, counted)
        ends, misfit = members_misfits(members, layout, found.points)
        used |= np.isin(node, ends)
        error = float(np.concatenate([force, misfit]).max()) if used.any() else float("inf")
        status, reason = _verdict(error, found, rounding, len(misfit))
        pair = mispaired(nodes, found.points) if status == "certified" and numbering.kind != "given" else None
    if pair is not None:
        first, second = (np.flatnonzero(node == one)[0] for one in pair)
        status = "uncertified"
        reason = Reason(
            f"which rows belong to one node is not certain: those of rows {first} and {second}, as numbered, do not "
            "couple like the rows of two nodes",
            GIVE_NUMBERING,
        )
    elif status == "certified":
        reason = Reason(f"{reason.text}: {covered(used, abs(whole[used]).sum(axis=0) > 0)}")
    notes = list(found.notes)
    placed = np.pad(found.points, ((0, 0), (0, layout.space - layout.dim)))
    fields: dict[str, Any] = {}
    if cells and error < ALIKE:
        with clock("members"):
            fields = members_and_cells(nodes, placed)
        notes.append("members and cells were read off the graph: what is certified is the coordinates")
    if not valid[:, len(layout.displacements) :].any():
        notes.append("moments are not used alone: springs between rotations and the ground, as against drilling, would "
                     "spoil them")  # fmt: skip
    untold = np.unique(node[direction < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     f"left out unless you {GIVE_NUMBERING}")  # fmt: skip
    if (found.component < 0).any():
        notes.append(f"{(found.component < 0).sum()} of {count_of(nodes.n, 'node')} cannot be determined: at supports, "
                     "or tied to these only")  # fmt: skip
    points, factor, more = anchored(placed, found.component, len(found.evidence), known, sized=True)
    lost = digits_lost(points, placed, found.component, factor) / _edge_length(nodes, found)
    status, reason = near_enough(status, reason, lost)
    return Structure(
        **fields,
        **found.fields(numbering),
        points=points,
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason.text,
        advice=reason.advice,
        operator=layout.name,
        backward_error=error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes, *more),
        choice=choice,
    )


def _edge_length(nodes: Nodes, found: Placed) -> float:
    """Mean distance of coupled nodes."""
    i, j = sp.triu(nodes.graph, 1).nonzero()
    length = np.linalg.norm(found.points[i] - found.points[j], axis=1)
    return float(np.nanmean(length)) if np.nansum(length) > 0 else 1.0


def _verdict(error: float, found: Placed, rounding: Rounding | None, members: int) -> tuple[str, Reason]:
    d = found.points.shape[1]
    if found.null_dimension > d:
        return "uncertified", Reason(
            f"the null space has dimension {found.null_dimension} where {d} translations are expected: supports leave "
            "too few whole rows",
            WITHOUT_SUPPORTS,
        )
    loosest = min(found.evidence, key=lambda one: one.gap / np.sqrt(one.rows))
    allowed = max(CERTIFIED, rounding.spread) if rounding else CERTIFIED
    off = max(error, rounding.spread) if rounding else error
    doubt = off * np.sqrt(loosest.rows) / loosest.gap  # each equation may be off by as much
    if not error <= allowed or doubt > ALIKE:
        digits = f" of entries rounded to {rounding.name}" if rounding else ""
        return "uncertified", Reason(
            f"rigid rotations of the nodes cause forces of {error:.1e} of those{digits} that make them up, and another "
            f"field, no translation, only {loosest.gap:.1e}: positions may be off by {doubt:.0e} of the size"
        )
    if found.unnoticed.any():
        count = count_of(int(np.count_nonzero(found.unnoticed)), "equation has", "equations have")
        return "uncertified", Reason(
            f"{count} no other to check against, so that springs would go unnoticed: too few whole rows are left",
            WITHOUT_SUPPORTS,
        )
    blocks = f", {count_of(members, 'block is that', 'blocks are those')} of straight members" if members else ""
    if rounding:
        return "certified", Reason(
            f"rigid rotations of the nodes cause no more forces than entries rounded to {rounding.name} leave{blocks}, "
            f"so that positions are known to {doubt:.0e} of the size"
        )
    return "certified", Reason(
        f"rigid rotations of the nodes cause no forces{blocks}, and only translations change nothing"
    )
