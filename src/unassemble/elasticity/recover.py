"""Coordinates from an elasticity matrix, and nothing else: the whole room on one page."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import check_matrix
from ..nodes.nodal import NodalMatrix, nodal_matrix, uncoupled
from ..nodes.numbering import Numbering
from ..nodes.rounded import Rounding, with_exact_sums
from ..nodes.unknowns import find_numbering
from .description import described
from .doubts import with_doubts
from .nullspace.certificate import residuals
from .positions import solve
from .results import ElasticityRecovery
from .springs import without_springs
from .verdict import about_made_up_nodes, about_open_rows, no_positions


def recover_elasticity(
    matrix: sp.csr_array,
    *,
    block_size: int | None = None,
    numbering: Numbering | None = None,
    cells: bool = True,
    patch: int | None = None,
) -> ElasticityRecovery:
    """Recover node positions from the stiffness matrix of isotropic linear elasticity.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric; unknowns may be eliminated, replaced by identity rows, or penalised.
    block_size : int, optional
        2 or 3; found where it is not given.
    numbering : Numbering, optional
        Where it is known; see :func:`.unknowns.given_numbering`.
    cells : bool
        Look for elements too.
    patch : int, optional
        Most nodes per chart; see :mod:`.atlas`.

    Raises
    ------
    MatrixError
        If the matrix is not square, symmetric and finite.
    RecoveryError
        If it is no elasticity matrix, or determines nothing.
    """
    clock = Clock()
    with clock("check"):
        whole, rounding = with_exact_sums(check_matrix(matrix).csr())
    with clock("numbering"):
        numbering = numbering or find_numbering(whole, block_size)
        nodal = nodal_matrix(whole, numbering)
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled: these are scalar matrices side by side. Recover one of them by itself"
        )
    return place_nodes(nodal, numbering, clock, cells=cells, patch=patch, rounding=rounding)


def place_nodes(
    nodal: NodalMatrix,
    numbering: Numbering,
    clock: Clock,
    *,
    cells: bool = True,
    patch: int | None = None,
    rounding: Rounding | None = None,
) -> ElasticityRecovery:
    """The recovery once the nodes are known: null space, certificate, cells; see :func:`recover_elasticity`.

    `rounding` is that of the entries, where they have few digits.
    """
    with clock("null space"), blas_threads(1):
        nodal = with_doubts(without_springs(nodal), numbering)
        try:
            solution = solve(nodal, patch)
        except RecoveryError as error:
            if not numbering.inferred:
                raise
            raise GeometryError(no_positions(about_open_rows(numbering) or error)) from error
        why = about_made_up_nodes(nodal, numbering, solution, rounding) if numbering.inferred else ""
        if why:
            raise GeometryError(no_positions(why))

    def placed_again(matrix: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        other = with_doubts(without_springs(nodal_matrix(matrix, numbering)), numbering)
        with blas_threads(1):
            again = solve(other, patch)
        return again.points, residuals(other, again.valid, again.points, again.ratio)

    return described(nodal, numbering, solution, clock, cells=cells, rounding=rounding, placed_again=placed_again)
