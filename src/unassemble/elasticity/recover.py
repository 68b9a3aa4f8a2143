"""Coordinates from an elasticity matrix: the whole room on one page."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import BodyCertificate, Findings, certify_body, certify_positions
from ..elements.surface import fields_of
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..nodes.anchoring import Request, anchored, mechanical_fields
from ..nodes.nodal import NodalMatrix, determined, nodal_matrix, uncoupled
from ..nodes.numbering import NodeNumbering
from ..nodes.rounded import Known, Rounding, known_to
from ..recovery import Body, Examined, Placed, finish
from ..tolerances import ALIKE, CERTIFIED, PENALTY, PLACED, SIGMAS
from ..words import GIVE_NUMBERING, Reason
from .doubts import guessed_directions, notes, unborne, unchecked, unconfirmed
from .materials.cells import RecognisedCells, recognise_cells
from .nullspace.identities import lame_ratio, poisson_ratio
from .nullspace.placing import Solution, without_springs
from .nullspace.residuals import residuals
from .positions import solve
from .verdict import (
    NOTHING_CHECKED,
    RESTS_ON_PLANES,
    WEAK_AND_UNKNOWN,
    against_body,
    beside_cells,
    contrast,
    examined,
    given_back,
    hidden_by_digits,
    hidden_elements,
    no_positions,
)


def serve_body(nodal: NodalMatrix, numbering: NodeNumbering, request: Request) -> Body:
    """Recover a solid body; InputError for anchors that do not fit, RecoveryError if no piece is determined."""
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled, as those of a vector Laplacian: these are scalar matrices side by side, "
            "which `operator='laplacian'` recovers"
        )
    with request.clock("null space"), blas_threads(1):
        nodal = without_springs(nodal)
        try:
            solution = solve(nodal)
        except RecoveryError as error:
            if not numbering.inferred:
                raise
            raise GeometryError(no_positions(error)) from error
    made_up = numbering.inferred and numbering.incomplete and (numbering.odd or numbering.common < 1)
    if made_up and not solution.exact and request.rounding is None:  # points of rows of several nodes are none
        raise GeometryError(no_positions("none fit exactly, as where constraints tie unknowns together"))
    return _described(nodal, numbering, solution, request)


def _described(nodal: NodalMatrix, numbering: NodeNumbering, solution: Solution, request: Request) -> Body:
    """The body, with its certificate, material and cells, and the sentences that go with them."""
    cells, rounding = request.cells, request.rounding

    def placed_again(matrix: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        other = without_springs(nodal_matrix(matrix, numbering))
        with blas_threads(1):
            again = solve(other)
        return again.points, residuals(other, again.valid, again.points)

    with request.clock("certify"):
        misfits = residuals(nodal, solution.valid, solution.points)
        error = float(np.abs(misfits).max()) if len(misfits) else float("nan")
        spread = rounding.spread if rounding else 0.0
        near = not error >= max(ALIKE, spread)  # NaN where only elements can tell
        ratio = _lame_ratio(nodal, solution) if near else None
    found = RecognisedCells()
    if (cells or solution.straight or solution.hanging is not None) and near:
        with request.clock("cells"):
            found = recognise_cells(nodal, solution.points, ratio, max(CERTIFIED, spread))
    bar = None
    if rounding and near and not any(solution.freedoms):
        with request.clock("certify"):
            bar = known_to(solution.points, solution.component, misfits, rounding, placed_again, sized=False)
    sure, objections = examined(nodal, solution, error, found, numbering, rounding, bar)
    alone = not objections and not found.certified
    lone = unchecked(nodal, solution, found) if not objections else np.zeros(nodal.n, dtype=bool)
    if lone.any() and not (cells or found.certified):  # only elements can confirm them
        return _described(nodal, numbering, solution, replace(request, cells=True))
    simplex = nodal.n <= nodal.dim + 1  # whose rows may all depend on one
    if alone and (simplex or not (determined(solution.points) & ~lone).any()):
        objections.append(NOTHING_CHECKED)
        lone = np.zeros_like(lone)
    withheld = np.zeros(nodal.n, dtype=bool)
    if not objections and (found.certified or numbering.open_row is not None or not numbering.incomplete):
        withheld = unconfirmed(nodal, numbering, solution.points, found.shown)
    hanging = unborne(nodal, solution, found)
    if hanging.any() and (hanging | withheld | ~determined(solution.points)).all():
        objections.insert(0, RESTS_ON_PLANES)
        hanging = np.zeros(nodal.n, dtype=bool)  # said of all of them
    kept = ~(withheld | hanging | lone)
    placed = np.where(kept[:, None], solution.points, np.nan)
    shown = found.among(kept)
    loose = ~determined(placed)
    component = np.where(loose, -1, solution.component)
    bulk, shear = np.abs(found.lame).T
    bodies = [placed[component == k] for k in range(component.max(initial=-1) + 1)]
    if loose.all():
        objections.append(NOTHING_CHECKED)
    if any(map(_flat, bodies)):
        objections.append(Reason("the points lie in one line or plane, and no solid body does"))
    if found.hidden > 0 and not rounding:
        objections.append(hidden_elements(found.hidden))
    if alone and cells and contrast(nodal) > 1 / ALIKE:
        objections.append(WEAK_AND_UNKNOWN)
    if (shear <= ALIKE * bulk).any():
        objections.append(Reason("elements have no shear stiffness: any vectors that cancel are such"))
    guessed = guessed_directions(numbering, loose)
    masks, asked = (withheld, hanging, lone), shown if cells else None
    said = (*solution.warnings, *notes(nodal, solution, asked, loose, masks, int(guessed.sum())))
    if found.hidden > 0 and rounding:  # holes look the same
        said = (*said, hidden_by_digits(found.hidden))
    rows = replace(numbering, direction_of_row=np.where(guessed, -1, numbering.direction_of_row))
    free = "the sign of the scale is free: with a mesh its point reflection fits the matrix as well"
    another = None
    if len(nodal.indices) == nodal.n**2 and not request.named:
        # Of a rectangle, say, rows along y with those of opposite corners: those of its mirror image.
        another = Reason(
            "all nodes are coupled, as those of one element: which rows are of one node may be another choice",
            sure,
            advice=GIVE_NUMBERING,
        )
    allowed = np.full(len(numbering.node_of_row), CERTIFIED)
    if request.rounding:
        allowed = np.maximum(allowed, _rounded_rows(request.rounding, nodal, solution, bar))
    with request.clock("place"):
        moved = anchored(request, rows, placed, component, 1.0, free=free)
    objections.extend(moved.objections(sure))

    def place() -> Placed[Body]:
        lame, scale = _in_units(shown, component, moved.factor, nodal.dim)
        body = Body(
            **fields_of(shown.blocks),
            **mechanical_fields(request, rows, moved.points, component, solution.evidence),
            scale=scale,
            operator="elasticity",
            position_error=bar.error if bar and bar.explained else None,
            poisson_ratio=None if ratio is None else poisson_ratio(ratio),
            lame=lame,
        )
        return Placed(body, (*request.matrix.warnings, *said, *moved.notes))

    def compare(body: Body) -> BodyComparison:
        fit = found.backward_error if found.certified else error
        return BodyComparison(_certificate(request, body, elements=found.certified), allowed, fit)

    def examine(_: Body, compared: BodyComparison) -> Examined:
        certificate, most = compared.certificate, float(allowed.max())
        unlike = list(against_body(certificate, compared.foreign[0], allowed))
        against = dict.fromkeys([*objections, *unlike])
        beside = len(certificate.silent(allowed))
        fits = given_back(sure, compared.backward_error, beside, len(allowed), exact=request.rounding is None)
        remarks = [beside_cells(beside)] if beside and not unlike else []  # not of wrong entries
        return Examined(Findings(fits, compared.backward_error, tuple(against), another, allowed=most), remarks)

    return finish(request.clock, place, compare, examine)


@dataclass(frozen=True, eq=False)
class BodyComparison:
    """A body as it is written, compared with its matrix."""

    certificate: BodyCertificate
    allowed: NDArray[np.float64]  # (N,) how far off entries may be, relative to their row
    fit: float  # what the fit that found the body left

    @cached_property
    def foreign(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Entries (k, 2) that the elements leave and no others have, the largest first, and their sizes."""
        return self.certificate.of_no_element(np.maximum(PLACED, self.allowed))

    @property
    def backward_error(self) -> float:
        """That of the certificate or, of a body of which it can compare nothing, that of the fit."""
        error = self.certificate.backward_error
        return max(self.fit if np.isnan(error) else error, self.foreign[1].max(initial=0.0))

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, and their misfits; those that no elements have, if all others fit."""
        pairs, misfits = self.certificate.worst(count, self.allowed)
        return (pairs, misfits) if len(pairs) else (self.foreign[0][:count], self.foreign[1][:count])


def _rounded_rows(rounding: Rounding, nodal: NodalMatrix, solution: Solution, bar: Known | None) -> NDArray[np.float64]:
    """(N,) how far off entries with few digits may be, relative to their row: they, and those of positions from them.

    Decimals are few for weak rows. Positions that are off by some part of the diameter change the entries of the
    shortest distance most.
    """
    largest = _largest_off_diagonal(rounding.exact)
    own = np.where(np.abs(rounding.exact.diagonal()) > PENALTY * largest, 0.0, np.abs(rounding.unit.diagonal()))
    unit = np.maximum(_largest_off_diagonal(rounding.unit), own)  # penalties are not compared
    known = determined(solution.points)
    pair = known[nodal.node] & known[nodal.indices] & (nodal.node != nodal.indices)
    apart = solution.points[nodal.node[pair]] - solution.points[nodal.indices[pair]]
    shortest = np.linalg.norm(apart, axis=1).min(initial=np.inf)
    diameter = np.linalg.norm(np.ptp(solution.points[known], axis=0)) if known.any() else 0.0
    moved = bar.error * diameter / shortest if bar and shortest > 0 else 0.0
    return rounding.spread + SIGMAS * (unit / np.where(largest > 0, largest, np.inf) + moved)


def _largest_off_diagonal(matrix: sp.csr_array) -> NDArray[np.float64]:
    """(N,) largest magnitude of the entries of each row off the diagonal."""
    entry = matrix.tocoo()
    off = entry.row != entry.col
    largest = np.zeros(matrix.shape[0])
    np.maximum.at(largest, entry.row[off], np.abs(entry.data[off]))
    return largest


def _certificate(request: Request, body: Body, *, elements: bool) -> BodyCertificate:
    """The certificate of the body as it is written: of its elements, or of the positions where none re-assemble."""
    matrix = request.rounding.exact if request.rounding else request.matrix.csr()
    assert body.node_of_row is not None
    assert body.direction_of_row is not None
    given = matrix, body.node_of_row, body.direction_of_row, body.points
    if elements and len(body.lame):
        return certify_body(*given, body.cells, body.lame)
    return certify_positions(*given)


def _lame_ratio(nodal: NodalMatrix, solution: Solution) -> float | None:
    """The number lambda / mu as boundary terms have it, or elements that told the axes of all pieces; None if none is.

    Boundary terms go with the points, of which nothing but translation and scale may be free.
    """
    if any(solution.freedoms) or 0 < len(solution.straight) < len(solution.evidence):
        return None
    if not solution.straight:
        return lame_ratio(nodal, solution.valid, solution.points)
    return solution.straight[0] if np.ptp([poisson_ratio(one) for one in solution.straight]) < ALIKE else None


def _flat(points: NDArray[np.float64]) -> bool:
    """Whether the nodes of a piece do not span space, so that no element there has a volume."""
    if not len(points):
        return False
    values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(values[-1] <= ALIKE * values[0])


def _in_units(found: RecognisedCells, component: NDArray, factor: NDArray, d: int) -> tuple[NDArray, NDArray]:
    """Lame coefficients of the cells, and the mean shear modulus of each piece, for the size that it was given.

    Entries go like the modulus times length to the power d - 2.
    """
    scale = np.full(len(factor), np.nan)
    if not found.certified:
        return np.empty((0, 2)), scale
    piece = component[np.concatenate([cells[:, 0] for cells in found.blocks.values()])]
    lame = found.lame / np.where(np.isnan(factor), 1.0, np.abs(factor))[piece, None] ** (d - 2)
    count = np.bincount(piece, minlength=len(factor))
    some = count > 0
    scale[some] = np.bincount(piece, lame[:, 1], len(factor))[some] / count[some]
    return lame, scale
