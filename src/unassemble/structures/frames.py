"""Coordinates from the matrix of a frame, shell or plate, in true units of length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..elasticity.anchoring import checked_anchors, digits_lost, near_enough
from ..elasticity.nodal import determined
from ..elasticity.rounded import Rounding, with_exact_sums
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..recovery import Structure
from ..words import count_of
from .certificate import largest_force
from .members import members_and_cells
from .nodes import Nodes, nodes_of
from .placed import CERTIFIED, Placed, best_positions
from .recognise import StructuralNumbering

_SURE = 1e-6  # of the diameter: how far off the points of a certified structure may be


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
        found = best_positions(nodes)
    points, component, evidence, notes, springs = (
        found.points, found.component, found.evidence, found.notes, found.springs
    )  # fmt: skip
    with clock("certify"):
        valid = found.valid.copy()
        if springs:
            valid[:, len(layout.displacements) :] = False
        counted = np.zeros((len(node), len(layout.rotations)), dtype=bool)
        present = nodes.present
        counted[nodes.row_of[present]] = valid[present]
        error = largest_force(whole, layout, node, direction, points, counted)
    fields: dict[str, Any] = {}
    if cells and error < 1e-6:
        with clock("members"):
            fields = members_and_cells(nodes, points)
        notes.append("members and cells were read off the graph; what is certified is the coordinates")
    if springs:
        notes.append("moments do not balance alone: rotations are tied to the ground by springs, as against drilling")
    untold = np.unique(node[direction < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     "left out; give the numbering if it is known")  # fmt: skip
    loose = ~determined(points)
    if loose.any():
        notes.append(f"{loose.sum()} of {count_of(nodes.n, 'node')} cannot be determined: at supports, or tied to "
                     "these only")  # fmt: skip
    points, more = _moved(points, component, known)
    lost = digits_lost(points, found.points, component, np.ones(len(evidence))) / _edge_length(nodes, found.points)
    status, reason = near_enough(*_verdict(error, found, layout.dim, rounding), lost)
    return Structure(
        **fields,
        points=points,
        component=component,
        scale=np.full(len(evidence), np.nan),
        node_status=np.asarray(loose, dtype=np.int8),
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason,
        operator=layout.name,
        backward_error=error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes, *more),
        node_of_row=node,
        direction_of_row=direction,
        numbering=numbering.kind,
        choice=choice,
        evidence=evidence,
    )


def _edge_length(nodes: Nodes, points: NDArray[np.float64]) -> float:
    """Mean distance of coupled nodes."""
    i, j = sp.triu(nodes.graph, 1).nonzero()
    length = np.linalg.norm(points[i] - points[j], axis=1)
    return float(np.nanmean(length)) if np.isfinite(length).any() else 1.0


def _moved(
    points: NDArray[np.float64], component: NDArray[np.int64], anchors: tuple[NDArray, NDArray]
) -> tuple[NDArray[np.float64], list[str]]:
    """Pieces moved to their anchors, and how far these are missed."""
    nodes, places = anchors
    points, notes = points.copy(), []
    lost = nodes[component[nodes] < 0]
    if len(lost):
        notes.append(f"the anchored nodes {', '.join(map(str, lost))} are not determined and were not used")
    for piece in np.unique(component[nodes][component[nodes] >= 0]):
        here = nodes[component[nodes] == piece]
        wanted = places[component[nodes] == piece]
        points[component == piece] += (wanted - points[here]).mean(axis=0)
        misfit = float(np.linalg.norm(points[here] - wanted, axis=1).max())
        if len(here) > 1 and misfit > 1e-6 * np.linalg.norm(wanted - wanted.mean(axis=0), axis=1).max():
            notes.append(f"the anchors do not fit the structure, whose size and axes the matrix knows: one is missed "
                         f"by {misfit:.3g}")  # fmt: skip
    return points, notes


def _verdict(error: float, found: Placed, d: int, rounding: Rounding | None) -> tuple[str, str]:
    evidence = found.evidence
    free = [one.null_dimension for one in evidence if one.null_dimension > d]
    if free:
        return "uncertified", (
            f"the null space has dimension {free[0]} where {d} translations are expected: supports leave too few whole "
            "rows"
        )
    if rounding and error < rounding.spread:
        return "uncertified", (
            f"the entries are rounded to {rounding.name}, and rigid rotations cause forces of {error:.1e} of those "
            "that make them up, which is what that leaves"
        )
    loosest = min(evidence, key=lambda one: one.gap / np.sqrt(one.rows))
    doubt = error * np.sqrt(loosest.rows) / loosest.gap  # each equation may be off by as much
    if doubt > _SURE:
        return "uncertified", (
            f"rigid rotations of the nodes cause forces of {error:.1e} of those that make them up, and another field, "
            f"no translation, only {loosest.gap:.1e}: positions may be off by {doubt:.0e} of the size"
        )
    if not error <= CERTIFIED:
        return "uncertified", (
            f"no positions make rigid rotations free of forces: the largest is {error:.1e} of those that make it up; "
            "the points are the best fit"
        )
    if found.unchecked:
        count = count_of(found.unchecked, "equation of moments has", "equations of moments have")
        return "uncertified", (
            f"{count} no other to check against, so that springs between rotations and the ground would go unnoticed: "
            "supports leave too few whole rows"
        )
    if not found.strict:
        return "uncertified", (
            "rigid rotations of the nodes cause no forces, but without moments of nodes next to supports too few rows "
            "are left, and supports may resist the rotations of these nodes"
        )
    return "certified", "rigid rotations of the nodes cause no forces, and only translations change nothing"
