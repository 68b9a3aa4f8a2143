"""Coordinates from an elasticity matrix: the whole room on one page."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..nodes.anchoring import Request
from ..nodes.nodal import NodalMatrix, nodal_matrix, uncoupled
from ..nodes.numbering import Numbering
from ..recovery import Body
from .description import described
from .doubts import with_doubts
from .nullspace.certificate import residuals
from .positions import solve
from .springs import without_springs
from .verdict import about_made_up_nodes, about_open_rows, no_positions


def serve_body(
    matrix: OperatorMatrix,
    nodal: NodalMatrix,
    numbering: Numbering,
    clock: Clock,
    request: Request,
) -> Body:
    """Recover a solid body whose numbering is known.

    Raises
    ------
    InputError
        For anchors that do not fit.
    RecoveryError
        If no piece is determined.
    """
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled, as those of a vector Laplacian: these are scalar matrices side by side, "
            "which `operator='laplacian'` recovers"
        )
    known = request.held(numbering.node_of_row, numbering.block_size)  # before the long work
    with clock("null space"), blas_threads(1):
        nodal = with_doubts(without_springs(nodal), numbering)
        try:
            solution = solve(nodal)
        except RecoveryError as error:
            if not numbering.inferred:
                raise
            raise GeometryError(no_positions(about_open_rows(numbering) or error)) from error
        why = about_made_up_nodes(nodal, numbering, solution, request.rounding) if numbering.inferred else ""
        if why:
            raise GeometryError(no_positions(why))

    def placed_again(matrix: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        other = with_doubts(without_springs(nodal_matrix(matrix, numbering)), numbering)
        with blas_threads(1):
            again = solve(other)
        return again.points, residuals(other, again.valid, again.points)

    return described(matrix, nodal, numbering, solution, clock, request, known, placed_again)
