"""Coordinates from an elasticity matrix, and nothing else: the whole room on one page."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import check_matrix
from ..words import count_of
from .doubts import guessed_directions, unborne, unconfirmed, with_doubts
from .elements.cells import no_cells, recognise_cells
from .halves import joined, taken_apart
from .nodal import NodalMatrix, determined, nodal_matrix, uncoupled
from .nullspace.certificate import largest_residual
from .nullspace.material import poisson_ratio
from .nullspace.solution import Solution
from .ordered.rounded import SPREADS, with_exact_sums
from .positions import solve
from .results import ElasticityRecovery, ScalarParts
from .rows.numbering import Numbering
from .unknowns import find_numbering
from .verdict import (
    NOTHING_SHOWN,
    RESTS_ON_PLANES,
    about_cells,
    about_made_up_nodes,
    about_nodes,
    about_open_rows,
    of_few_digits,
    verdict,
)

_SAME = 1e-6  # difference up to which Poisson's ratios of pieces are one
_NEAR = 1e-6  # residual up to which positions are good enough to look for elements


def scalar_parts(matrix: sp.csr_array, *, block_size: int | None = None) -> ScalarParts | None:
    """Take a vector Laplacian apart; None for matrices that couple directions or have no nodes of several unknowns."""
    matrix = sp.csr_array(matrix)
    numbering = find_numbering(matrix, block_size)
    nodal = nodal_matrix(matrix, numbering)
    return parts_of(matrix, nodal, numbering) if uncoupled(nodal) else None


def parts_of(matrix: sp.csr_array, nodal: NodalMatrix, numbering: Numbering) -> ScalarParts:
    """The scalar matrices of uncoupled directions."""
    nodes = tuple(np.flatnonzero(nodal.row_of[:, a] >= 0) for a in range(nodal.dim))
    rows = [nodal.row_of[here, a] for a, here in enumerate(nodes)]
    return ScalarParts(tuple(sp.csr_array(matrix[r][:, r]) for r in rows), nodes, numbering)


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
    unproven = whole if numbering.unnamed is not None and numbering.unnamed.any() else None
    del whole
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled: these are scalar matrices side by side; recover one of them by itself"
        )
    return place_nodes(nodal, numbering, clock, cells=cells, patch=patch, rounding=rounding, whole=unproven)


def place_nodes(
    nodal: NodalMatrix,
    numbering: Numbering,
    clock: Clock,
    *,
    cells: bool = True,
    patch: int | None = None,
    rounding: float = 0.0,
    whole: sp.csr_array | None = None,
) -> ElasticityRecovery:
    """The recovery once the nodes are known: null space, certificate, cells; see :func:`recover_elasticity`.

    `rounding` is that of the entries, where they have few digits; `whole` is the matrix, where the direction of some
    rows is not proven.
    """
    with clock("null space"), blas_threads(1):
        nodal = with_doubts(nodal, numbering)
        try:
            nodal, solution = _solved(nodal, numbering, whole, patch)
        except RecoveryError as error:
            if numbering.kind == "given" or (numbering.common == 1 and not numbering.incomplete):
                raise
            if about_open_rows(numbering):
                raise GeometryError(f"no positions were found: {about_open_rows(numbering)}") from error
            raise GeometryError(
                f"{error}; but which rows belong to one node, and to which direction, was inferred and may be wrong: "
                "give the numbering if it is known"
            ) from error
        if numbering.kind != "given" and not solution.unique:
            nodal, numbering, solution = _row_by_row(nodal, numbering, solution, patch)
            why = about_made_up_nodes(nodal, numbering, solution)
            if why:
                raise GeometryError(f"no positions were found: {why}")
        if (
            not solution.exact
            and not rounding
            and numbering.kind != "given"
            and (numbering.odd or numbering.common < 1)
            and numbering.incomplete
        ):
            raise GeometryError(
                "no positions fit the matrix exactly; which rows belong to one node was inferred, where some nodes "
                "lack rows, and is probably wrong, unless constraints tie unknowns together: give the numbering if it "
                "is known"
            )
        nodal, numbering, solution = _rejoined(nodal, numbering, solution, patch)
    return _describe(nodal, numbering, solution, clock, cells, rounding)


def _solved(
    nodal: NodalMatrix, numbering: Numbering, whole: sp.csr_array | None, patch: int | None
) -> tuple[NodalMatrix, Solution]:
    """Positions; where none fit exactly, once more without the rows whose direction nothing proves."""
    try:
        solution = solve(nodal, patch)
    except RecoveryError:
        if whole is None:
            raise
    else:
        if whole is None or (solution.exact and not any(solution.freedoms)):
            return nodal, solution
    nodal = with_doubts(nodal_matrix(whole, numbering, left_out=numbering.unnamed), numbering)
    return nodal, solve(nodal, patch)


def _row_by_row(
    nodal: NodalMatrix, numbering: Numbering, solution: Solution, patch: int | None
) -> tuple[NodalMatrix, Numbering, Solution]:
    """Rows that may have been joined to the wrong nodes placed each by itself, if all positions are unique then."""
    apart = taken_apart(nodal, numbering)
    if apart is not None:
        other = with_doubts(*apart)
        try:
            better = solve(other, patch)
        except RecoveryError:
            return nodal, numbering, solution
        if better.unique:
            return other, apart[1], better
    return nodal, numbering, solution


def _rejoined(
    nodal: NodalMatrix, numbering: Numbering, solution: Solution, patch: int | None
) -> tuple[NodalMatrix, Numbering, Solution]:
    """Halves of nodes that lie in one place joined, unless positions were unique and are not any more.

    More rows are whole then, among them some that touch halves of which no row told the place.
    """
    better = joined(nodal, numbering, solution.points, solution.component)
    if better is None:
        return nodal, numbering, solution
    other = with_doubts(*better)
    try:
        again = solve(other, patch)
    except RecoveryError:
        return nodal, numbering, solution
    return (other, better[1], again) if again.unique or not solution.unique else (nodal, numbering, solution)


def _describe(
    nodal: NodalMatrix, numbering: Numbering, solution: Solution, clock: Clock, want_cells: bool, rounding: float
) -> ElasticityRecovery:
    """Certificate, material, cells and the sentences that go with them."""
    points = solution.points
    with clock("certify"):
        error = largest_residual(nodal, solution.valid, points, solution.ratio)
        near = not error >= max(_NEAR, SPREADS * rounding)  # NaN where only elements can tell
        ratio = _poisson_ratio(nodal, solution, points) if near else None
    found = no_cells()
    lame_ratio = None if ratio is None else 2 * ratio / (1 - 2 * ratio)
    if (want_cells or solution.straight or solution.hanging is not None) and near:
        with clock("cells"):
            found = recognise_cells(nodal, points, lame_ratio, solution.corners)
    if solution.cautious is not None and not found.certified:
        return _describe(nodal, numbering, solution.cautious, clock, want_cells, rounding)
    backward = found.backward_error if found.certified else error
    status, reason = verdict(nodal, solution, error, found, numbering)
    if rounding and near and not any(solution.freedoms):
        status, reason = "uncertified", of_few_digits(rounding, error)
    elif rounding:
        reason = f"{reason}; the entries are rounded to {rounding:.0e} of themselves, which may hide what rows lack"
    withheld = np.zeros(nodal.n, dtype=bool)
    if status == "certified" and (found.certified or numbering.open_row is not None or not numbering.incomplete):
        withheld = unconfirmed(nodal, numbering, points, found.shown)
    if withheld.any():
        points = np.where(withheld[:, None], np.nan, points)
        found = found.among(~withheld)
    hanging = unborne(nodal, solution, found)
    if hanging.any() and (hanging | ~determined(points)).all():
        status, reason = "uncertified", RESTS_ON_PLANES
    elif hanging.any():
        points = np.where(hanging[:, None], np.nan, points)
        found = found.among(~hanging)
    loose = ~determined(points)
    if status == "certified" and loose.all():
        status, reason = "uncertified", NOTHING_SHOWN
    component = np.where(loose, -1, solution.component)
    warnings = list(solution.warnings)
    if want_cells:
        warnings += about_cells(found)
    warnings += about_nodes(nodal, loose, withheld, hanging & loose)
    if solution.planes:
        warnings.append(
            "nodes that lack a direction were taken to lie in planes across it, which fits, to determine others"
        )
    if solution.straight:
        warnings.append(
            "the body is homogeneous and held all around, where the identities leave an affine map free; the elements "
            "determined it"
        )
    if solution.ratio is not None:
        warnings.append("Poisson's ratio, read off the nodes that determine it, was used to determine others")
    guessed = guessed_directions(numbering, loose)
    if guessed.any():
        warnings.append(
            f"which directions {count_of(int(guessed.sum()), 'row', 'rows')} of nodes without coordinates belong to is "
            "not proven: `direction_of_row` is -1 there, and rigid-body modes are zero"
        )
    direction = np.where(guessed, -1, numbering.direction_of_row)
    return ElasticityRecovery(
        points, numbering.node_of_row, direction, np.asarray(loose, dtype=np.int8), component,
        solution.evidence, ratio, found, backward, status, reason, numbering.kind, tuple(warnings), clock.timings,
    )  # fmt: skip


def _poisson_ratio(nodal: NodalMatrix, solution: Solution, points: NDArray[np.float64]) -> float | None:
    """Poisson's ratio as the boundary terms have it, and as the elements that told axes have it; None if they differ.

    None too where more than translation and scale is free, since boundary terms go with the points.
    """
    if any(solution.freedoms):
        return None
    told = [ratio / (2 * (1 + ratio)) for ratio in solution.straight]
    if len(solution.straight) < len(solution.evidence):
        nu = poisson_ratio(nodal, solution.valid, points)
        if nu is None:
            return None
        told.append(nu)
    return told[0] if np.ptp(told) < _SAME else None
