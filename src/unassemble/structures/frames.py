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
from ..words import count_of
from .certificate import forces
from .members import members_and_cells, mispaired
from .nodes import Nodes, nodes_of
from .placed import Placed, covered
from .recognise import StructuralNumbering
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
    known = checked_anchors(anchors, node, layout.dim)
    whole, rounding = with_exact_sums(matrix.csr())
    nodes = nodes_of(whole, layout, node, direction)
    with clock("solve"), blas_threads(1):
        found, valid = turning_positions(nodes)
    with clock("certify"):
        counted = np.zeros((len(node), len(layout.rotations)), dtype=bool)
        counted[nodes.row_of[nodes.present]] = valid[nodes.present]
        force, used = forces(whole, layout, node, direction, found.points, counted)
        error = float(force.max()) if len(force) else float("inf")
        status, reason = _verdict(error, found, rounding)
        pair = mispaired(nodes, found.points) if status == "certified" and numbering.kind != "given" else None
    if pair is not None:
        first, second = (np.flatnonzero(node == one)[0] for one in pair)
        status = "uncertified"
        reason = (
            f"which rows belong to one node is not certain: those of rows {first} and {second}, as numbered, do not "
            "couple like the rows of two nodes; give the numbering if it is known"
        )
    elif status == "certified":
        reason += f": {covered(used, abs(whole[used]).sum(axis=0) > 0)}"
    notes = list(found.notes)
    fields: dict[str, Any] = {}
    if cells and error < ALIKE:
        with clock("members"):
            fields = members_and_cells(nodes, found.points)
        notes.append("members and cells were read off the graph; what is certified is the coordinates")
    if not valid[:, len(layout.displacements) :].any():
        notes.append("moments are not used alone: springs between rotations and the ground, as against drilling, would "
                     "spoil them")  # fmt: skip
    untold = np.unique(node[direction < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     "left out; give the numbering if it is known")  # fmt: skip
    if (found.component < 0).any():
        notes.append(f"{(found.component < 0).sum()} of {count_of(nodes.n, 'node')} cannot be determined: at supports, "
                     "or tied to these only")  # fmt: skip
    points, factor, more = anchored(found.points, found.component, len(found.evidence), known, sized=True)
    lost = digits_lost(points, found.points, found.component, factor) / _edge_length(nodes, found)
    status, reason = near_enough(status, reason, lost)
    return Structure(
        **fields,
        **found.fields(numbering),
        points=points,
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason,
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


def _verdict(error: float, found: Placed, rounding: Rounding | None) -> tuple[str, str]:
    d = found.points.shape[1]
    if found.null_dimension > d:
        return "uncertified", (
            f"the null space has dimension {found.null_dimension} where {d} translations are expected: supports leave "
            "too few whole rows"
        )
    loosest = min(found.evidence, key=lambda one: one.gap / np.sqrt(one.rows))
    allowed = max(CERTIFIED, rounding.spread) if rounding else CERTIFIED
    off = max(error, rounding.spread) if rounding else error
    doubt = off * np.sqrt(loosest.rows) / loosest.gap  # each equation may be off by as much
    if not error <= allowed or doubt > ALIKE:
        digits = f" of entries rounded to {rounding.name}" if rounding else ""
        return "uncertified", (
            f"rigid rotations of the nodes cause forces of {error:.1e} of those{digits} that make them up, and another "
            f"field, no translation, only {loosest.gap:.1e}: positions may be off by {doubt:.0e} of the size"
        )
    if found.unnoticed.any():
        count = count_of(int(np.count_nonzero(found.unnoticed)), "equation has", "equations have")
        return "uncertified", (
            f"{count} no other to check against, so that springs would go unnoticed: too few whole rows are left"
        )
    if rounding:
        return "certified", (
            f"rigid rotations of the nodes cause no more forces than entries rounded to {rounding.name} leave, so that "
            f"positions are known to {doubt:.0e} of the size"
        )
    return "certified", "rigid rotations of the nodes cause no forces, and only translations change nothing"
