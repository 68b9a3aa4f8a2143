"""Coordinates from an elasticity matrix, and nothing else: the whole room on one page."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import check_matrix
from ..words import count_of
from .cells import Cells, no_cells, recognise_cells
from .certificate import largest_residual
from .doubts import unconfirmed, with_doubts
from .halves import joined
from .material import poisson_ratio
from .nodal import NodalMatrix, determined, nodal_matrix, uncoupled, without_trace
from .positions import Solution, solve
from .results import ElasticityRecovery, ScalarParts
from .rounded import with_exact_sums
from .unknowns import Numbering, find_numbering

CERTIFIED = 1e-9
_NEAR = 1e-6  # residual up to which positions are good enough to look for elements
_SPREADS = 20  # times the rounding of the entries: what an identity may be off by
_NEARLY = 2e-7  # gap at which entries rounded to 1e-15 still give coordinates to 1e-8


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
    del whole
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled: these are scalar matrices side by side; recover one of them by itself"
        )
    return place_nodes(nodal, numbering, clock, cells=cells, patch=patch, rounding=rounding)


def place_nodes(
    nodal: NodalMatrix,
    numbering: Numbering,
    clock: Clock,
    *,
    cells: bool = True,
    patch: int | None = None,
    rounding: float = 0.0,
) -> ElasticityRecovery:
    """The recovery once the nodes are known: null space, certificate, cells; see :func:`recover_elasticity`.

    `rounding` is that of the entries, where they have few digits.
    """
    with clock("null space"), blas_threads(1):
        nodal = with_doubts(nodal, numbering)
        try:
            solution = solve(nodal, patch)
        except RecoveryError as error:
            if numbering.kind == "given" or (numbering.common == 1 and not numbering.incomplete):
                raise
            raise GeometryError(
                f"{error}; but which rows belong to one node, and to which direction, was inferred and may be wrong: "
                "give the numbering if it is known"
            ) from error
        if (
            not solution.exact
            and numbering.kind != "given"
            and (numbering.odd or numbering.common < 1)
            and numbering.incomplete
        ):
            raise GeometryError(
                "no positions fit the matrix exactly; which rows belong to one node was inferred, where some nodes "
                "lack rows, and is probably wrong: give the numbering if it is known"
            )
        better = joined(nodal, numbering, solution.points, solution.component)
        if better is not None:
            nodal, numbering = better
            nodal = with_doubts(nodal, numbering)
            solution = solve(nodal, patch)
    return _describe(nodal, numbering, solution, clock, cells, rounding)


def _describe(
    nodal: NodalMatrix, numbering: Numbering, solution: Solution, clock: Clock, want_cells: bool, rounding: float
) -> ElasticityRecovery:
    """Certificate, material, cells and the sentences that go with them."""
    points = solution.points
    with clock("certify"):
        error = largest_residual(nodal, solution.valid, points, solution.ratio)
        near = error < max(_NEAR, _SPREADS * rounding)
        ratio = poisson_ratio(nodal, solution.valid, points) if near else None
    found = no_cells(nodal.dim)
    if want_cells and near:
        with clock("cells"):
            found = recognise_cells(nodal, points, None if ratio is None else 2 * ratio / (1 - 2 * ratio))
    backward = found.backward_error if found.certified else error
    status, reason = _verdict(nodal, solution, error, found, numbering)
    if rounding and near:
        status, reason = "uncertified", _of_few_digits(rounding, error)
    withheld = np.zeros(nodal.n, dtype=bool)
    if status == "certified" and found.certified:
        withheld = unconfirmed(nodal, points, found.cells)
        points = np.where(withheld[:, None], np.nan, points)
    loose = ~determined(points)
    component = np.where(loose, -1, solution.component)
    warnings = list(solution.warnings)
    if want_cells:
        warnings += _about_cells(found)
    if withheld.any():
        warnings.append(
            f"{count_of(int(withheld.sum()), 'node belongs', 'nodes belong')} to no element that re-assembles; since "
            "it was inferred which rows make up a node, no coordinates are given there"
        )
    if (loose & ~withheld).any():
        warnings.append(
            f"{count_of(int((loose & ~withheld).sum()), 'node is', 'nodes are')} tied to eliminated unknowns only and "
            "not determined"
        )
    if solution.planes:
        warnings.append(
            "nodes that lack a direction were taken to lie in planes across it, which fits, to determine others"
        )
    if solution.ratio is not None:
        warnings.append("Poisson's ratio, read off the nodes that determine it, was used to determine others")
    return ElasticityRecovery(
        points, numbering.node_of_row, numbering.direction_of_row, np.asarray(loose, dtype=np.int8), component,
        solution.evidence, ratio, found, backward, status, reason, numbering.kind, tuple(warnings), clock.timings,
    )  # fmt: skip


def _about_cells(found: Cells) -> list[str]:
    if not found.recognised:
        return [
            "no elements were recognised: looked for are linear and quadratic triangles, quadrilaterals, tetrahedra "
            "and hexahedra, of one kind throughout"
        ]
    if not found.certified:
        return [
            "the elements were read off the graph and are not certified: no material was found with which they "
            "re-assemble to the matrix"
        ]
    if found.varying:
        return ["the material differs within elements: their Lame coefficients are means"]
    return []


def _of_few_digits(rounding: float, error: float) -> str:
    return (
        f"the entries are rounded to {rounding:.0e} of themselves, and the identities hold to {error:.1e}, which is "
        "what that leaves; rows away from supports were made to annihilate translations exactly"
    )


_FREEDOMS = {
    "axes": "each axis keeps a scale of its own",
    "affine": "an affine map stays free, since the material around every valid row is homogeneous",
    "hourglass": "fields that move points in one direction only may be added in each: hourglass modes of reduced "
    "integration, or smooth ones where a homogeneous body is held on its whole boundary; the points are the smoothest "
    "that fit",
}


def _verdict(
    nodal: NodalMatrix, solution: Solution, error: float, found: Cells, numbering: Numbering
) -> tuple[str, str]:
    remaining = [_FREEDOMS[name] for name in solution.freedoms if name]
    if remaining:
        return "uncertified", f"the null space is larger than it should be: {remaining[0]}"
    nearly = min((one.gap for one in solution.evidence if one.gap > 0), default=1.0)
    if solution.exact and nearly < _NEARLY:
        return "uncertified", (
            f"a field that is no translation or scale satisfies the identities up to {nearly:.1e}: nodes that it moves "
            "feel the rounding of the entries, magnified by as much, and may be wrong by more than 1e-8"
        )
    if not solution.exact:
        worst = max(solution.evidence, key=lambda one: one.residual)
        return "uncertified", (
            f"no exact null vector exists (singular value {worst.residual:.1e}, that of the next field "
            f"{worst.gap:.1e}); the points are the best fit, as for materials that are not isotropic, or elements that "
            "do not reproduce linear functions"
        )
    if not solution.strict:
        return "uncertified", (
            "supports leave too few rows that are surely whole; rows whose entries add up to zero were taken for "
            "whole, which they need not be"
        )
    if numbering.kind != "given" and numbering.incomplete | (numbering.kind == "pattern") and _torn(nodal, solution):
        return "uncertified", (
            "which direction each row belongs to was inferred from the entries, and not without contradiction: coupled "
            "nodes came out as separate pieces; give the numbering if it is known"
        )
    if found.certified and found.backward_error <= CERTIFIED:
        return "certified", f"the matrix re-assembled on the {count_of(found.n_cells, 'element')} is the given one"
    odd = int(without_trace(nodal).any(axis=1).sum())
    if odd:
        return "uncertified", (
            f"{count_of(odd, 'node lacks', 'nodes lack')} directions although no row next to it misses anything: its "
            "rows belong to other nodes, and neither pattern nor positions tell to which; give the numbering if it is "
            "known"
        )
    if numbering.incomplete and numbering.kind != "given" and numbering.common < 1:
        return "uncertified", (
            "which rows belong to one node was inferred, where some nodes lack rows and others do not store entries "
            "that vanished; only elements that re-assemble to the matrix would show that the inference is right"
        )
    if error <= CERTIFIED:
        return "certified", "the valid identities hold to rounding, and only translations and scale satisfy them"
    return "uncertified", f"the largest residual of a valid identity is {error:.1e}"


def _torn(nodal: NodalMatrix, solution: Solution) -> bool:
    """Whether nodes of different pieces are connected through the matrix."""
    graph = sp.csr_array((np.ones(len(nodal.indices), np.int8), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    label = sp.csgraph.connected_components(graph, directed=False)[1]
    known = solution.component >= 0
    pairs = np.unique(np.column_stack([label, solution.component])[known], axis=0)
    return len(np.unique(pairs[:, 0])) < len(pairs)
