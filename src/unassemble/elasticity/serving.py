"""Vector-valued matrices served as every other: what was asked for in, one Recovery out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import RecoveryError
from ..matrix import OperatorMatrix, check_matrix
from ..recovery import Recovery
from ..structures.bars import bars_of
from ..structures.trusses import serve_truss
from .anchoring import anchored, checked_anchors, digits_lost, near_enough
from .elements.cells import Cells
from .elements.kinds import KINDS
from .elements.surface import boundary_loops
from .nodal import nodal_matrix, uncoupled
from .recover import parts_of, place_nodes
from .results import ElasticityRecovery, ScalarParts
from .rows.numbering import Numbering

if TYPE_CHECKING:
    from ..operators import VectorReading

_THIN = 1e-14  # of the largest variance of the coordinates: rounding
_SAME = 1e-12  # relative difference up to which the matrices of two directions are one

Scalar = Callable[[OperatorMatrix, Sequence[Any]], Recovery]


def serve(
    matrix: OperatorMatrix,
    reading: VectorReading,
    clock: Clock,
    *,
    anchors: Sequence[Any] | None,
    cells: bool,
    scalar: Scalar,
) -> Recovery:
    """Recover a vector-valued matrix whose numbering is known.

    Parameters
    ----------
    matrix : OperatorMatrix
    reading : VectorReading
        Whose numbering is a Numbering.
    clock : Clock
    anchors : sequence of (row, x, y) or (row, x, y, z), optional
    cells : bool
        Look for elements too.
    scalar : callable
        Recovers a scalar matrix with anchors, for directions that are not coupled.
    """
    numbering, choice = cast("Numbering", reading.numbering), reading.why
    with clock("numbering"):
        whole, rounding = reading.exact or (matrix.csr(), 0.0)
        nodal = nodal_matrix(whole, numbering)
    if uncoupled(nodal):
        parts = parts_of(whole, nodal, numbering)
        return replace(_vector_laplacian(parts, matrix, anchors, scalar), choice=choice, timings=clock.timings)
    bars = bars_of(nodal)
    if bars is not None:
        return serve_truss(matrix, nodal, numbering, bars, clock, anchors=anchors, choice=choice)
    unproven = whole if numbering.unnamed is not None and numbering.unnamed.any() else None
    del whole
    checked_anchors(anchors, numbering.node_of_row, numbering.block_size)  # before the long work
    found = place_nodes(nodal, numbering, clock, cells=cells, rounding=rounding, whole=unproven)
    known = checked_anchors(anchors, found.node_of_row, numbering.block_size)
    points, factor, notes = anchored(found.points, found.component, len(found.evidence), known)
    status, reason = found.status, found.reason
    if status == "certified" and _flat(found):
        status, reason = "uncertified", "the points lie in one line or plane, and no solid body does"
    status, reason = near_enough(status, reason, digits_lost(points, found.points, found.component, factor))
    lame, scale = _in_units(found, factor)
    if np.isnan(factor).any():
        notes.append("the sign of the scale is free: with a mesh its point reflection fits the matrix as well")
    return Recovery(
        **_cell_fields(found.cells),
        points=points,
        component=found.component,
        scale=scale,
        node_status=found.node_status,
        status=status,
        reason=reason,
        operator="elasticity",
        backward_error=found.backward_error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *found.warnings, *notes),
        node_of_row=found.node_of_row,
        direction_of_row=found.direction_of_row,
        numbering=found.numbering,
        choice=choice,
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
        if spread[0] <= _THIN * max(spread[-1], 1.0):  # mean edges have length one: in a single point all is rounding
            return True
    return False


_FIELD = {"triangle": "triangles", "quad": "quads", "tetra": "tetrahedra", "hexahedron": "hexahedra"}


def _cell_fields(found: Cells) -> dict[str, Any]:
    """Corners of the cells by their name in a Recovery, their further nodes, and in the plane their boundary."""
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


def _vector_laplacian(
    parts: ScalarParts, matrix: OperatorMatrix, anchors: Sequence[Any] | None, scalar: Scalar
) -> Recovery:
    """Each direction as the scalar matrix that it is; the mesh is that of the direction with most nodes."""
    numbering = parts.numbering
    lead = int(np.argmax([len(nodes) for nodes in parts.nodes]))
    nodes = parts.nodes[lead]
    place = np.full(numbering.n_nodes, -1)
    place[nodes] = np.arange(len(nodes))
    anchor_nodes, where = checked_anchors(anchors, numbering.node_of_row, 2)
    here = place[anchor_nodes] >= 0
    known = [(int(k), *xy) for k, xy in zip(place[anchor_nodes[here]], where[here].tolist(), strict=True)]
    try:
        mesh = scalar(check_matrix(parts.matrices[lead]), known)
        others = [
            scalar(check_matrix(part), ())
            for k, part in enumerate(parts.matrices)
            if k != lead and not _same(part, parts.matrices[lead])
        ]
    except RecoveryError as error:
        raise type(error)(f"the directions are not coupled (a vector Laplacian), and of one: {error}") from error
    worst = max([mesh, *others], key=lambda one: (not one.certified, one.backward_error))
    n = numbering.n_nodes
    points, component = np.full((n, 2), np.nan), np.full(n, -1)
    points[nodes], component[nodes] = mesh.points, mesh.component
    status = np.ones(n, np.int8)
    status[nodes] = mesh.node_status
    notes = ["the directions are not coupled: each was treated as a scalar matrix"]
    if others:
        notes.append("the directions have different matrices; the mesh is that of the one with most nodes")
    return replace(
        mesh,
        points=points,
        triangles=nodes[mesh.triangles],
        component=component,
        hinges=nodes[mesh.hinges],
        boundary=nodes[mesh.boundary],
        node_status=status,
        worst_entries=numbering_rows(parts, lead)[mesh.worst_entries],
        status=worst.status,
        reason=worst.reason,
        backward_error=worst.backward_error,
        operator="vector laplacian",
        warnings=(*matrix.warnings, *mesh.warnings, *notes),
        node_of_row=numbering.node_of_row,
        direction_of_row=numbering.direction_of_row,
        numbering=numbering.kind,
    )


def numbering_rows(parts: ScalarParts, direction: int) -> NDArray[np.int64]:
    """Matrix row of each row of a direction's scalar matrix."""
    numbering = parts.numbering
    row_of = np.full(numbering.n_nodes, -1)
    rows = np.flatnonzero((numbering.direction_of_row == direction) & ~numbering.identity_row)
    row_of[numbering.node_of_row[rows]] = rows
    return row_of[parts.nodes[direction]]


def _same(one: sp.csr_array, other: sp.csr_array) -> bool:
    return one.shape == other.shape and bool(abs(one - other).max() <= _SAME * abs(other).max())
