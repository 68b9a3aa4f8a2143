"""Meshes of any planar element that lost cells at the boundary, fitted to the entries that are whole.

Rows that were taken out leave cells of which all nodes are there beside cells of which some are not, and only the
former are looked for. Two nodes on one side of a cell are in two cells, others in one; entries of as many cells are
whole, and so are those in rows at which no cell is lost. What is guessed of the others holds what whole entries do not,
with less and less weight; in the end it is what the mesh itself has there, so that nothing pulls at a mesh that fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray

from ..certificate import certify_mesh
from ..clock import Clock
from ..conforming.affine import expected
from ..conforming.fit import Fitted, by_rule, corner_positions
from ..conforming.parts import Part, parts_of
from ..conforming.recover import joined, shown_cells
from ..errors import GeometryError, SolverError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.polish import PolishOptions, polish
from ..recovery import ConformingMesh, Examined, Placed, finish
from ..scalar.placement import Placement
from ..tolerances import ALIKE, LITTLE, ROUNDED, SMALL
from ..topology import Topology
from ..topology.keys import contains, distinct, pair_keys
from .fit import EXACT
from .judge import PartComparison, determined_by, node_status, partly, unknowns

_MOST = 3  # sets of cells, the likeliest ones
_AT_FIRST, _THEN = (1.0, 0.1, 0.01), (1e-3, 1e-4, *[1e-5] * 5)  # weights of what is guessed
_TO_THE_END = PolishOptions(settled=0.0)  # misfits of guesses are no noise


def recover_partial_elements(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> ConformingMesh | None:
    """The mesh of the cells that are complete; None where they show none that whole entries determine.

    Cells are straight. Entries between rows that were replaced are taken for unknown.
    """
    if options.noise is not None:
        return None
    lost = matrix.incomplete_rows if matrix.replaced is None else matrix.replaced
    if not lost.any():
        return None
    scale = None if options.scale is None else options.scale * placement.stretch
    for cells in islice(shown_cells(matrix, lost=lost), _MOST):
        with clock("inside"):
            try:
                parts = parts_of(cells)
            except TopologyError:
                continue
            near = _near_lost(matrix, lost, parts)
            fits = [fitted_part(matrix, part, near, scale) for part in parts]
        if any(fit is not None and fit.known.any() for fit in fits):
            return _report(matrix, [fit for fit in fits if fit is not None], placement, clock, options)
    return None


def _near_lost(matrix: OperatorMatrix, lost: NDArray[np.bool_], parts: Sequence[Part]) -> NDArray[np.bool_]:
    """(n,) rows of cells that are not complete: they do not add up, or have entries that no complete cell has.

    Of linear elements the former are all. Of others, a node of a lost cell need not be coupled to those that are gone.
    """
    if all(part.degree == 1 for part in parts):
        return lost
    covered = [pair_keys(matrix.n, *part.rows.T) for part in parts]
    bare = ~contains(distinct(np.concatenate(covered)), matrix.edges @ [matrix.n, 1])
    bare &= np.abs(matrix.entries) > ROUNDED * matrix.row_size[matrix.edges].min(axis=1)
    near = lost.copy()
    near[matrix.edges[bare]] = True
    return near


def _report(
    matrix: OperatorMatrix, fits: list[FittedPart], placement: Placement, clock: Clock, options: ScalarOptions
) -> ConformingMesh | None:
    """The mesh, if it is certified."""
    own = [fit.fit for fit in fits]
    topology = Topology(matrix.n, matrix.edges, tuple(one.part.piece for one in own), "cliques")
    told = [(fit.fit.part.piece.vertices, fit.nodes) for fit in fits]
    placement, said = placement.upon(topology, [known for _, known in told])
    pairs = np.concatenate([fit.fit.part.rows[fit.judged] for fit in fits])

    def place() -> Placed[ConformingMesh]:
        placed, origins, notes = placement.placed(topology, [fit.nodes for fit in own], [fit.notes for fit in own])
        mesh = joined(topology, own, placed, placement)
        shift = origins[mesh.component]
        points = mesh.points + np.column_stack([shift.real, shift.imag])
        mesh = replace(mesh, points=points, node_status=node_status(mesh.component, told))
        return Placed(mesh, (*matrix.warnings, *said, *notes))

    def compare(mesh: ConformingMesh) -> PartComparison:
        return PartComparison(certify_mesh(matrix, mesh, placement.coefficients), pairs)

    def examine(mesh: ConformingMesh, compared: PartComparison) -> Examined:
        status, spare = mesh.node_status, min(fit.spare for fit in fits if fit.known.any())
        claimed = np.concatenate([(status[some] == 0).all(axis=1) for some in mesh.cells.values()])
        return partly(status, compared, claimed, spare, bars=options.standard_deviations)

    found = finish(clock, place, compare, examine)
    return found if found.certified else None


@dataclass(frozen=True, eq=False)
class FittedPart:
    """A part whose whole entries fit."""

    fit: Fitted
    known: NDArray[np.bool_]  # (corners,) that are determined
    nodes: NDArray[np.bool_]  # (n,) between known corners, and told from each other
    judged: NDArray[np.bool_]  # (e,) whole entries of cells whose corners are all known
    spare: int  # how many of them are not needed to determine what is known


def fitted_part(matrix: OperatorMatrix, part: Part, near: NDArray[np.bool_], scale: float | None) -> FittedPart | None:
    """The part with positions that have its whole entries; None where none are found."""
    place, there = part.stored_in(matrix)
    weights = -np.where(there, matrix.entries[place], 0.0)
    count, most = np.zeros((2, len(weights)), dtype=np.int64)
    for kind, places in part.places.items():
        count += np.bincount(places.ravel(), minlength=len(weights))
        most[places] = np.where(kind.on_one_side, 2, 1)
    alone = near[part.rows].all(axis=1)  # entries of which other cells may have a part
    whole = np.asarray(~alone | (count == most) if matrix.replaced is None else ~alone)
    if whole.sum() <= 2 * part.n_corners - 3:
        return None
    trust = np.where(whole, np.where(count == 1, 1.0, LITTLE**2), np.where(there, SMALL, 0.0))
    shared = expected(part.places, weights / count, trust)
    for guess in (np.where(whole, weights, shared), np.where(whole, weights, weights / 2)):
        try:
            start, c = corner_positions(part, guess, None)  # the energy of guesses is not that of c
        except (GeometryError, SolverError):
            continue
        rules = list(by_rule(part, guess, start, c))
        begun = _faded(rules[0], whole, _AT_FIRST, scale)
        for one in rules:
            fit = _faded(replace(begun, entries=one.entries, rule=one.rule), whole, _THEN, scale)
            if not _size(fit, whole) <= EXACT or not (fit.entries.areas(fit.z) > 0).all():
                continue
            w = fit.entries.weights(fit.z)
            jacobian = fit.entries.jacobian(fit.z, np.ones(len(w))).matrix
            slopes = np.zeros((len(w), 0)) if scale is not None else w[:, None]
            known, used, _ = determined_by(jacobian, slopes, whole, fit.z, part.piece, fit.misfit / fit.scale)
            twins = _twins(part, weights / fit.scale, whole, near[part.piece.vertices])
            known &= ~twins[: part.n_corners]
            judged = whole.copy()
            for kind, cells in part.blocks.items():
                judged[part.places[kind][~known[cells[:, : kind.corners]].all(axis=1)]] = False
            spare = int((used & judged).sum()) - unknowns(known, 1 if scale is None else 0)
            return FittedPart(fit, known, (part.from_corners() @ ~known == 0) & ~twins, judged, spare)
    return None


def _twins(part: Part, weights: NDArray, whole: NDArray[np.bool_], near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes `near` what is lost that have the same whole entries as another one of the same cells."""
    times = np.bincount(np.concatenate([cells.ravel() for cells in part.blocks.values()]), minlength=part.n)
    alike = []
    for kind, cells in part.blocks.items():
        k = kind.nodes
        own, given = np.zeros((len(cells), k, k)), np.zeros((len(cells), k, k), dtype=bool)
        for i, j in (np.triu_indices(k, 1), np.triu_indices(k, 1)[::-1]):
            own[:, i, j], given[:, i, j] = weights[part.places[kind]], whole[part.places[kind]]
        for a, b in combinations(range(k), 2):
            others = [c for c in range(k) if c not in (a, b)]
            differ = np.where(given[:, a] | given[:, b], np.abs(own[:, a] - own[:, b]), 0.0)[:, others].max(axis=1)
            alike.append(np.sort(cells[differ <= ALIKE][:, [a, b]], axis=1))
    pairs, count = np.unique(np.concatenate(alike), axis=0, return_counts=True)
    one, other = pairs.T
    some = near[one] & near[other] & (count == times[one]) & (count == times[other])
    twins = np.zeros(part.n, dtype=bool)
    twins[one[some]] = twins[other[some]] = True
    return twins


def _size(fit: Fitted, whole: NDArray[np.bool_]) -> float:
    """Root mean square misfit of whole entries, relative to c."""
    return float(np.sqrt(np.mean((fit.misfit / fit.scale)[whole] ** 2)))


def _faded(start: Fitted, whole: NDArray[np.bool_], fading: Sequence[float], scale: float | None) -> Fitted:
    """One fit after the other, with such weights of what is guessed; small ones only hold the mesh where it is."""
    fit = start
    for weight in fading:
        spread = np.where(whole, 1.0, 1 / weight)
        try:
            found = polish(fit.entries, fit.weights, fit.z, scale=scale, spread=spread, options=_TO_THE_END)
        except SolverError:
            break
        own = found.scale * fit.entries.weights(found.z)
        new = replace(fit, z=found.z, scale=found.scale)
        if not np.isfinite(_size(new, whole)) or (weight == _THEN[-1] and _size(new, whole) > _size(fit, whole) / 2):
            break
        fit = replace(new, weights=np.where(whole, fit.weights, own)) if weight <= SMALL else new
    return fit
