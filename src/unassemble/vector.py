"""The recovery of a vector-valued matrix on one page: a structure, a truss, or a solid body."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .clock import Clock
from .elasticity.recover import serve_body
from .errors import RecoveryError
from .matrix import OperatorMatrix
from .nodes import NodeNumbering, Request
from .nodes.nodal import nodal_matrix
from .operators import VectorReading
from .recovery import Recovery
from .structures import StructuralNumbering, serve_structure
from .structures.layouts import PINNED
from .structures.trusses import bars_of, serve_truss
from .tolerances import CANCELLED


def recover_vector(
    matrix: OperatorMatrix,
    reading: VectorReading,
    clock: Clock,
    *,
    anchors: Sequence[Any] | None,
    cells: bool,
    named: bool = False,
) -> Recovery:
    """Recover a vector-valued matrix whose numbering is known; see :class:`.nodes.anchoring.Request`.

    InputError for anchors that do not fit, RecoveryError if no piece is determined.
    """
    numbering, rounding = reading.numbering, reading.rounding
    request = Request(matrix, clock, anchors, cells, reading.why, rounding, named)
    space = numbering.layout.space if isinstance(numbering, StructuralNumbering) else numbering.block_size
    request.held(numbering.node_of_row, space)  # anchors that do not fit, before the long work
    if isinstance(numbering, StructuralNumbering):
        return serve_structure(numbering, request)
    with clock("numbering"):
        whole = rounding.exact if rounding else matrix.csr()
        nodal = nodal_matrix(whole, numbering)
    bars = bars_of(nodal, rounding.spread if rounding else CANCELLED)
    if bars is not None:
        return serve_truss(nodal, numbering, bars, request)
    del whole  # of a large body, memory that the long work can use
    try:
        body = serve_body(nodal, numbering, request)
    except RecoveryError:
        other = _by_rotations(numbering, request)
        if other is None:
            raise
        return other
    if body.status != "uncertified" or body.n_cells:  # what speaks against elements that were found is not to be evaded
        return body
    return _by_rotations(numbering, request) or body


def _by_rotations(numbering: NodeNumbering, request: Request) -> Recovery | None:
    """Nodes in space by rigid rotations alone, of any material and element; None where these certify nothing."""
    if numbering.block_size != PINNED.dim:
        return None
    direction = numbering.direction_of_row
    if numbering.unnamed is not None:
        direction = np.where(numbering.unnamed, -1, direction)
    same = StructuralNumbering(numbering.node_of_row, direction, numbering.kind, numbering.share, PINNED)
    try:
        found = serve_structure(same, request)
    except RecoveryError:
        return None
    return found if found.certified else None
