"""A scalar matrix of any planar element on one page: cells, positions, place, certificate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import SEARCHED_ROWS, Alternative
from ..certify import Certificate
from ..certify_elements import certify_elements
from ..clock import Clock
from ..elements.surface import fields_of
from ..errors import GeometryError, SolverError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import ConformingMesh
from ..scalar.held import Held
from ..scalar.noise import Noise
from ..scalar.placement import Placement
from ..scalar.solving import Task
from ..tolerances import CERTIFIED, CONFIDENCE, LARGEST_NOISE, SMALL
from ..topology import Topology, local_numbering
from ..topology.keys import contains, pair_keys
from ..words import count_of, sentences
from .fit import Fitted, deviations_of, fitted
from .parts import Part, parts_of, reversal
from .roles import Cells, ordered_cells
from .sets import node_sets


def recover_conforming(
    stored: OperatorMatrix, shown: Iterable[Cells], placement: Placement, clock: Clock, options: ScalarOptions
) -> ConformingMesh:
    """The mesh of a checked scalar matrix, certified or the nearest.

    `shown`: see :func:`shown_cells`. Raises TopologyError if rows form no cells, GeometryError if the entries fit none
    that they form.
    """
    task = Task(options=options, placement=placement, noise=Noise.known(stored, options.noise))
    failure: Exception = TopologyError("no sets of rows that are coupled to each other are cells of any known element")
    best: ConformingMesh | None = None
    remaining, even, small = iter(shown), False, stored.n <= SEARCHED_ROWS
    while best is None or not best.certified or ((small or even) and best.uniqueness != "proved"):
        with clock("cells"):
            cells = next(remaining, None)
        if cells is None:
            break
        even = cells.even
        try:
            mesh = _recovered(stored, cells, clock, task)
        except (TopologyError, GeometryError, SolverError) as error:
            failure = error
            continue
        if best is not None and best.certified and mesh.certified:
            return _ambiguous(best, mesh)
        if best is None or (not best.certified and (mesh.certified or mesh.backward_error < best.backward_error)):
            best = mesh
    if best is None:
        raise failure
    if best.uniqueness == "searched" and not small:
        note = f"other meshes were looked for in matrices of up to {SEARCHED_ROWS:,} rows only"
        return replace(best, warnings=(*best.warnings, note))
    return best


def _ambiguous(one: ConformingMesh, other: ConformingMesh) -> ConformingMesh:
    """A mesh beside which another fits."""
    rows = [
        {frozenset(cell): tuple(cell) for some in mesh.cells.values() for cell in some.tolist()}
        for mesh in (one, other)
    ]
    differ = [
        tuple(mine[key] for key in sorted(mine, key=sorted) if key not in theirs) for mine, theirs in (rows, rows[::-1])
    ]
    if not any(differ):  # the same sets in other orders
        differ = [tuple(sorted(mine.values())) for mine in rows]
    reason = f"{one.reason}, but another mesh does so as well: the matrix does not tell which sides its cells have"
    return replace(
        one,
        status="ambiguous",
        uniqueness="ambiguous",
        reason=reason,
        alternatives=(Alternative(differ[0], differ[1]),),
    )


def shown_cells(
    stored: OperatorMatrix, *, mass: bool = False, lost: NDArray[np.bool_] | None = None
) -> Iterator[Cells]:
    """Cells that the rows may form, the likeliest first; with a mass term, or others `lost` at some rows, (n,) bool."""
    numbering = local_numbering(stored.n, stored.edges)
    order = numbering.vertices
    near = OperatorMatrix(
        stored.n,
        numbering.edges,
        stored.entries[numbering.edge_rows],
        stored.diagonal[order],
        replaced=None if stored.replaced is None else stored.replaced[order],
    )
    for sets in node_sets(near, None if lost is None else lost[order]):
        with suppress(TopologyError):
            blocks, told = ordered_cells(near, sets, mass=mass, lost=lost is not None)
            yield Cells({kind: order[cells] for kind, cells in blocks.items()}, told, order, sets.even)


def _recovered(stored: OperatorMatrix, cells: Cells, clock: Clock, task: Task) -> ConformingMesh:
    with clock("cells"):
        parts = parts_of(cells)
    topology = Topology(stored.n, stored.edges, tuple(part.piece for part in parts), "cliques")
    with clock("positions"):
        fits = [_fit(stored, part, task) for part in parts]
    with clock("place"):
        mesh = JoinedParts(topology, fits, task.placement)
    with clock("certify"):
        near = written = _held(stored, mesh, mesh.points, fits, task)
        if mesh.origins.any():
            written = _held(stored, mesh, mesh.written, fits, task)
    with clock("deviations"):
        bars = deviations_of(stored.n, fits, mesh.placed, task) if task.options.standard_deviations else None
    status, uniqueness, reason = verdict(stored, fits, (near, written), task, told=cells.told)
    freedom = sum(fit.freedom for fit in fits)
    left = float(np.linalg.norm(written.certificate.differences))
    return ConformingMesh(
        **mesh.fields(),
        **written.fields(10 if status == "uncertified" else 0),
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=status,
        uniqueness=uniqueness,
        reason=reason,
        operator=task.placement.operator,
        timings=clock.timings,
        warnings=(*stored.warnings, *mesh.notes),
        standard_deviations=bars,
        estimated_noise=left / float(np.sqrt(freedom)) if freedom > 0 else None,
    )


def _fit(stored: OperatorMatrix, part: Part, task: Task) -> Fitted:
    """A part with the positions that its entries give."""
    place, there = part.stored_in(stored)
    noise = None
    if task.noise is not None:
        noise = task.noise.sigma * np.where(there, task.noise.spread[place], SMALL)
    weights = -np.where(there, stored.entries[place], 0.0)
    return fitted(part, weights, scale=task.scale, noise=noise, refine=task.options.refine)


def _held(stored: OperatorMatrix, mesh: JoinedParts, points: NDArray, fits: Sequence[Fitted], task: Task) -> Held:
    """A mesh with these points against the matrix, and against the errors of its entries."""
    known = 1 if task.scale is not None else 0
    scale = np.array([fit.scale for fit in fits])
    return Held.of(mesh.held(stored, points), stored, task.noise, sum(fit.freedom + known for fit in fits), scale)


def verdict(
    stored: OperatorMatrix, fits: Sequence[Fitted], held: Sequence[Held], task: Task, *, told: bool
) -> tuple[str, str | None, str]:
    """Status, uniqueness and reason of a mesh.

    `fits`: its parts; `held` (Held, Held): the mesh about the origins of its parts, and as it is written; `told`:
    whether the graph alone tells the cells.
    """
    near, written = held
    reason = _obstacle(fits, near, task) or _bare(stored, fits)
    if reason:
        return "uncertified", None, reason
    uniqueness = "proved" if told else "searched"
    error = written.certificate.backward_error
    if not written.passes:
        why = (
            f"the mesh fits, but not as it is written: so far from the origin its coordinates have too few digits, and "
            f"the matrix is given back to {error:.1e} (relative) only"
        )
        return "uncertified", uniqueness, why
    if written.test and written.by_noise:
        p = written.test.figures["p_value"]
        return "certified", uniqueness, f"the misfit is that of {written.test.noise} (p = {p:.2g})"
    fits_well = f"the operator re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"
    return "certified", uniqueness, fits_well


def _obstacle(fits: Sequence[Fitted], near: Held, task: Task) -> str:
    """What speaks against a mesh, the gravest first; empty if nothing does."""
    certificate, test = near.certificate, near.test
    notes = list(dict.fromkeys(note for fit in fits for note in fit.notes))
    if len(certificate.flipped):
        turned = count_of(len(certificate.flipped), "cell is", "cells are") + " flat, not convex or turned over"
        return sentences((turned, *notes))
    known = task.scale is not None
    loose = [fit for fit in fits if fit.freedom + known <= 0]
    if loose:
        row = int(loose[0].part.piece.vertices.min())
        return f"the part of row {row} has no more entries than unknowns, so that it fits proves nothing"
    if test and near.by_noise:
        if test.drowned:
            return f"noise above {test.limit:.2g} ({LARGEST_NOISE:g} of c) drowns what the entries say of angles"
        if test.coincidence:
            return "entries of so few digits may fit by chance"
        if not test.likely:
            p = min(test.figures["p_value"], test.figures["largest_p_value"])
            large = f"the misfit is too large for {test.noise} (p = {p:.1e}, where {CONFIDENCE:g} is allowed)"
            return sentences((large, *notes))
        return sentences(("the mesh that fits need not be the likeliest", *notes)) if notes else ""
    if not near.passes:
        (i, j), misfit = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
        differs = (
            f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
            f"largest, where {CERTIFIED:g} is allowed)"
        )
        return sentences((differs, *notes))
    return ""


def _bare(stored: OperatorMatrix, fits: Sequence[Fitted]) -> str:
    """A stored entry of no cell; empty if there is none."""
    covered = [pair_keys(stored.n, *fit.part.rows.T) for fit in fits]
    bare = np.flatnonzero(~contains(np.sort(np.concatenate(covered)), stored.edges @ [stored.n, 1]))
    if not len(bare):
        return ""
    i, j = stored.edges[bare[0]]
    return f"the mesh gives the matrix back, but the stored zero of rows {i} and {j} belongs to no cell"


class JoinedParts:
    """Parts put together in the numbering of the matrix, those that are mirrored turned over."""

    def __init__(self, topology: Topology, fits: Sequence[Fitted], placement: Placement):
        """Parts are the pieces of the topology."""
        n = topology.n_vertices
        self.points = np.full((n, 2), np.nan)  # of each about its origin
        self.component = topology.component
        self.blocks: dict[str, NDArray[np.int64]] = {}
        self._piece: dict[str, NDArray[np.int64]] = {}  # of each cell
        self._topology, self._fits, self._tensor = topology, fits, placement.tensor
        self._stretch = placement.stretch
        nodes, remarks = [fit.nodes for fit in fits], [fit.notes for fit in fits]
        self.placed, self.origins, self.notes = placement.placed(topology, nodes, remarks)
        for label in range(len(fits))[::-1]:  # the first part at a hinge comes last
            part, z = fits[label].part, self.placed[label]
            self.points[part.piece.vertices] = np.column_stack([z.real, z.imag])
            a, b, c = z[part.piece.triangles].T
            mirrored = (np.conj(b - a) * (c - a)).imag.sum() < 0
            for kind, cells in part.blocks.items():
                own = part.piece.vertices[cells[:, reversal(kind)] if mirrored else cells]
                piece, name = np.full(len(own), label), kind.name
                self.blocks[name] = np.concatenate([own, self.blocks.get(name, own[:0])])
                self._piece[name] = np.concatenate([piece, self._piece.get(name, piece[:0])])

        shift = self.origins[self.component]
        self.written = self.points + np.column_stack([shift.real, shift.imag])

    def held(self, matrix: OperatorMatrix, points: NDArray) -> Certificate:
        """The mesh with these points against the matrix."""
        if self._tensor:  # div(K grad) is a Laplacian in coordinates that K stretches
            z = self._tensor.to_laplacian(points @ [1, 1j])
            points = np.column_stack([z.real, z.imag])
        scale = np.array([fit.scale for fit in self._fits])
        factors = {name: scale[piece] for name, piece in self._piece.items()}
        rules = {name: rule for fit in self._fits for name, rule in fit.rule.items()}
        return certify_elements(matrix.edges, matrix.entries, points, self.blocks, factors, rules)

    def fields(self) -> dict[str, Any]:
        """What results say of the mesh, under the names that they have for it."""
        return fields_of(self.blocks) | {
            "points": self.written,
            "component": self.component,
            "hinges": self._topology.hinges,
            "scale": np.array([fit.scale for fit in self._fits]) / self._stretch,
            "n_holes": sum(fit.part.n_holes for fit in self._fits),
            "quadrature": ", ".join(dict.fromkeys(rule for fit in self._fits for rule in fit.rule.values())),
            "straight": all(fit.straight for fit in self._fits),
        }
