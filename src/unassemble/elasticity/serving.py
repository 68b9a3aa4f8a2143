"""Solid bodies served as every other matrix: what was asked for in, one Body out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..elements.kinds import KINDS
from ..elements.surface import boundary_loops
from ..matrix import OperatorMatrix
from ..nodes.anchoring import anchored, checked_anchors, digits_lost, near_enough
from ..nodes.nodal import NodalMatrix
from ..nodes.numbering import Numbering
from ..nodes.rounded import Rounding
from ..recovery import Body
from ..tolerances import LAST_DIGITS
from ..words import Reason
from .materials.cells import Cells
from .recover import place_nodes
from .results import ElasticityRecovery


@dataclass(frozen=True)
class Request:
    """What is asked for, and what is known beside the matrix.

    Attributes
    ----------
    anchors : sequence of (row, x, y) or (row, x, y, z), optional
    cells : bool
        Look for elements too.
    choice : str
        Why the matrix was taken for one of elasticity.
    rounding : Rounding, optional
        Of the entries, where they have few digits.
    """

    anchors: Sequence[Any] | None
    cells: bool
    choice: str
    rounding: Rounding | None


def serve_body(
    matrix: OperatorMatrix, nodal: NodalMatrix, numbering: Numbering, clock: Clock, request: Request
) -> Body:
    """Recover a solid body whose numbering is known.

    Raises
    ------
    InputError
        For anchors that do not fit.
    RecoveryError
        If no piece is determined.
    """
    checked_anchors(request.anchors, numbering.node_of_row, numbering.block_size)  # before the long work
    found = place_nodes(nodal, numbering, clock, cells=request.cells, rounding=request.rounding)
    known = checked_anchors(request.anchors, found.node_of_row, numbering.block_size)
    points, factor, notes = anchored(found.points, found.component, len(found.evidence), known)
    status, reason = found.status, Reason(found.reason, found.advice)
    if status == "certified" and _flat(found):
        status, reason = "uncertified", Reason("the points lie in one line or plane, and no solid body does")
    status, reason = near_enough(status, reason, digits_lost(points, found.points, found.component, factor))
    lame, scale = _in_units(found, factor)
    if np.isnan(factor).any():
        notes.append("the sign of the scale is free: with a mesh its point reflection fits the matrix as well")
    return Body(
        **_cell_fields(found.cells),
        points=points,
        component=found.component,
        scale=scale,
        node_status=found.node_status,
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason.text,
        advice=reason.advice,
        operator="elasticity",
        backward_error=found.backward_error,
        position_error=found.position_error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *found.warnings, *notes),
        node_of_row=found.node_of_row,
        direction_of_row=found.direction_of_row,
        numbering=found.numbering,
        choice=request.choice,
        poisson_ratio=found.poisson_ratio,
        lame=lame,
        evidence=found.evidence,
    )


def _flat(found: ElasticityRecovery) -> bool:
    """Whether the nodes of a piece do not span space, so that no element there has a volume."""
    d = found.points.shape[1]
    for piece in range(len(found.evidence)):
        x = found.points[found.component == piece]
        spread = np.linalg.eigvalsh(np.cov(x.T, bias=True)) if len(x) > d else np.zeros(d)
        if spread[0] <= LAST_DIGITS * max(spread[-1], 1.0):  # mean edges have length one
            return True
    return False


_FIELD = {"triangle": "triangles", "quad": "quads", "tetra": "tetrahedra", "hexahedron": "hexahedra"}


def _cell_fields(found: Cells) -> dict[str, Any]:
    """Corners of the cells by their name in a Body, their further nodes, and in the plane their boundary."""
    fields = {}
    for name, cells in found.blocks.items():
        kind = KINDS[name]
        fields[_FIELD[kind.base]] = np.ascontiguousarray(cells[:, : kind.corners])
        if kind.quadratic:
            fields["mid_nodes"] = np.ascontiguousarray(cells[:, kind.corners :])
    if any(KINDS[name].dim == 2 for name in found.blocks):
        fields["boundary"], fields["boundary_offsets"] = boundary_loops(found.blocks)
    return fields


def _in_units(found: ElasticityRecovery, factor: NDArray) -> tuple[NDArray, NDArray]:
    """Lame coefficients of the cells, and the mean shear modulus of each piece, for the size that it was given.

    Entries go like the modulus times length to the power d - 2.
    """
    d = found.points.shape[1]
    pieces = len(found.evidence)
    scale = np.full(pieces, np.nan)
    if not found.cells.certified:
        return np.empty((0, 2)), scale
    piece = found.component[found.cells.first_nodes]
    lame = found.cells.lame / np.where(np.isnan(factor), 1.0, np.abs(factor))[piece, None] ** (d - 2)
    count = np.bincount(piece, minlength=pieces)
    some = count > 0
    scale[some] = np.bincount(piece, lame[:, 1], pieces)[some] / count[some]
    return lame, scale
