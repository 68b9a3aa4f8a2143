"""Coordinates from an elasticity matrix, and nothing else: the whole room on one page."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import check_matrix
from .description import described
from .doubts import with_doubts
from .halves import joined, taken_apart
from .nodal import NodalMatrix, nodal_matrix, uncoupled
from .nullspace.solution import Solution
from .ordered.rounded import Rounding, with_exact_sums
from .positions import solve
from .results import ElasticityRecovery, ScalarParts
from .rows.numbering import Numbering
from .scattered.scattered import more_careful, told_by_positions
from .unknowns import find_numbering
from .verdict import about_made_up_nodes, about_open_rows


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

    def attempt(one: Numbering) -> ElasticityRecovery:
        return _recovered(whole, one, clock, cells=cells, patch=patch, rounding=rounding)

    return _likeliest(whole, numbering, clock, attempt) if numbering.likely else attempt(numbering)


def _likeliest(
    matrix: sp.csr_array, numbering: Numbering, clock: Clock, attempt: Callable[[Numbering], ElasticityRecovery]
) -> ElasticityRecovery:
    """The recovery with nodes that likeness told, however faintly, or with others, if more rows are certified then.

    While rows are left out, others are those told with more care; if nothing is certified, those that positions tell.
    """
    failures: list[RecoveryError] = []

    def better(best: ElasticityRecovery | None, one: Numbering) -> ElasticityRecovery | None:
        try:
            found = attempt(one)
        except RecoveryError as error:
            failures.append(error)
            return best
        return found if best is None or _certified_rows(found) > _certified_rows(best) else best

    best = better(None, numbering)
    others = more_careful(matrix, numbering)
    while _certified_rows(best) < np.count_nonzero(~numbering.identity_row):
        with clock("numbering"):
            one = next(others, None)
        if one is None:
            break
        best = better(best, one)
    if not _certified_rows(best):
        with clock("numbering"):
            one = told_by_positions(matrix, numbering)
        best = best if one is None else better(best, one)
    if best is None:
        raise failures[0]
    return best


def _certified_rows(found: ElasticityRecovery | None) -> int:
    """How many rows belong to nodes with certified coordinates."""
    return 0 if found is None or not found.certified else int((found.node_status[found.node_of_row] == 0).sum())


def _recovered(
    matrix: sp.csr_array,
    numbering: Numbering,
    clock: Clock,
    *,
    cells: bool,
    patch: int | None,
    rounding: Rounding | None,
) -> ElasticityRecovery:
    """The recovery of a matrix that was looked at, with a numbering."""
    with clock("numbering"):
        nodal = nodal_matrix(matrix, numbering)
    unproven = matrix if numbering.unnamed is not None and numbering.unnamed.any() else None
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
    rounding: Rounding | None = None,
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
            and rounding is None
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
    return described(nodal, numbering, solution, clock, cells=cells, rounding=rounding)


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
