"""A scalar matrix on one page: recognise, solve, place, certify."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..cells import SEARCHED_ROWS, Alternative, alternatives, components_of
from ..certify import certify
from ..clock import Clock
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.hinges import join
from ..recovery import PlanarMesh
from ..tolerances import CERTIFIED, SIGMAS
from ..topology import Polygons, local_numbering, surfaces
from .deviations import coordinate_deviations
from .evidence import weigh
from .joined import JoinedMesh
from .noise import Noise, NoiseTest
from .notes import piece_notes, topology_notes, vanished_notes
from .placement import Placement
from .solving import Solved, Task, solve
from .verdict import Findings, Held, Verdict, verdict


@dataclass(frozen=True, eq=False)
class _Placed:
    """Pieces where they lie: positions and mesh relative to the origins of pieces, and points as they are written."""

    positions: list[NDArray]
    mesh: JoinedMesh
    origins: NDArray[np.complex128]
    points: NDArray[np.float64]
    notes: list[str]


def recover_scalar(
    stored: OperatorMatrix,
    placement: Placement,
    clock: Clock,
    options: ScalarOptions,
    squared_lengths: NDArray | None = None,
) -> PlanarMesh:
    """The mesh of a checked scalar matrix.

    Parameters
    ----------
    stored : OperatorMatrix
    placement : Placement
    clock : Clock
    options : ScalarOptions
    squared_lengths : (e,) float64, optional
        Of the edges, where they are known from elsewhere: they give pieces their relative sizes.
    """
    noise = Noise.known(stored, options.noise)
    return _by_digits(stored, clock, Task(options, placement, noise, squared_lengths))


def _by_digits(stored: OperatorMatrix, clock: Clock, task: Task) -> PlanarMesh:
    """The mesh of entries of as few digits as they seem to have, or else of exact ones."""
    found = _recovered(stored, clock, task)
    searched = "faces" in clock.timings  # for cells
    if searched and found.status == "uncertified" and task.noise and task.noise.digits:
        # Few digits need not be rounded ones, and errors that entries do not have hide what their cells are.
        exact = _recovered(stored, clock, replace(task, noise=None))
        return exact if exact.status != "uncertified" else found
    return found


def _recovered(stored: OperatorMatrix, clock: Clock, task: Task) -> PlanarMesh:
    """The mesh of a matrix whose entries have errors of known size, or those of assembly."""
    free_scale = task.scale is None
    with clock("topology"):
        topology = surfaces(stored.n, stored.edges, local_numbering(stored.n, stored.edges))
    if task.noise is not None:
        stored = replace(stored, errors=task.noise.sigma * task.noise.spread)
    solved = solve(topology, stored, clock, task)
    with clock("place"):
        placed = _place(solved, task)
    with clock("certify"):
        near = _held_against(stored, solved, placed.mesh, placed.mesh.points, task)
        evidence = weigh(solved, near.certificate, free_scale=free_scale, search=not near.passes)
    deviations = None
    if task.options.standard_deviations:
        with clock("deviations"):
            deviations = coordinate_deviations(solved, task, placed.positions)
    written = _held_against(stored, solved, placed.mesh, placed.points, task) if placed.origins.any() else near
    findings = Findings(
        stored, solved, placed.mesh, placed.origins, near, written, evidence, not free_scale, task.options.polished
    )

    def other_meshes() -> tuple[list[Alternative], str]:
        with clock("ambiguity") if solved.topology.method == "the numbers" else nullcontext():  # else next to nothing
            return _other_meshes(findings, task)

    return _report(findings, verdict(findings, other_meshes), placed, deviations, clock, task)


def _place(solved: Solved, task: Task) -> _Placed:
    """Every piece in its final frame, relative to its origin, hinges joined; and what is to be said about it."""
    topology, placement = solved.topology, task.placement
    origins = placement.origins(topology)
    sizes = np.ones(len(topology.pieces)) if task.squared_lengths is None else _sizes(solved, task.squared_lengths)
    placed, remarks = [], []
    for label, (piece, mesh) in enumerate(zip(topology.pieces, solved.meshes, strict=True)):
        z, more = placement.apply(piece, mesh.z, origins[label])
        placed.append(z if placement.known_positions(piece) >= 2 else sizes[label] * z)
        remarks.append((*mesh.notes, *more))
    known = np.array([placement.known_positions(piece) for piece in topology.pieces])
    placed = join(topology, placed, known)
    notes = [*piece_notes(remarks), *placement.unused(topology), *topology_notes(topology)]
    notes += [*vanished_notes(topology), *topology.failures]
    joined = JoinedMesh.of(topology, placed, solved.scales / task.stretch)
    shift = origins[joined.component]
    return _Placed(placed, joined, origins, joined.points + np.column_stack([shift.real, shift.imag]), notes)


def _sizes(solved: Solved, squared_lengths: NDArray) -> NDArray[np.float64]:
    """(pieces,) mean edge length of each piece; over all edges 1."""
    lengths = [np.sqrt(squared_lengths[piece.edge_rows]) for piece in solved.topology.pieces]
    return np.array([own.mean() for own in lengths]) / np.concatenate(lengths).mean()


def _held_against(stored: OperatorMatrix, solved: Solved, mesh: JoinedMesh, points: NDArray, task: Task) -> Held:
    """The certificate of a mesh with these points, and the test against noise."""
    noise = solved.noise
    certificate = certify(
        stored.edges,
        stored.entries,
        points,
        mesh.triangles,
        mesh.scale[mesh.triangle_piece],
        task.placement.coefficients,
    )
    if noise is None:
        return Held(certificate, None)
    misfit = certificate.differences / noise.at(certificate.pairs, stored)
    return Held(certificate, NoiseTest.of(noise, misfit, solved.freedom(free_scale=task.scale is None), solved.scales))


def _other_meshes(findings: Findings, task: Task) -> tuple[list[Alternative], str]:
    """Other meshes that fit, and whether there are none: ``"proved"``, ``"searched"`` or ``"ambiguous"``.

    Where every cell is a 3-cycle and every 3-cycle a cell the graph shows the boundary. Entries that are stored as
    zeros show it no better than those that are not.
    """
    solved, stored, mesh, noise = findings.solved, findings.stored, findings.mesh, findings.solved.noise
    shown = solved.topology.method == "3-cycles"
    zero = stored.entries == 0
    if shown and not zero.any():
        return [], "proved"
    told = noise is not None and (task.options.noise or findings.near.by_noise)  # else entries that are exact
    sigma = noise.sigma if noise and told else findings.evidence.noise or 0.0
    given = stored if told else replace(stored, errors=None)
    z = np.asarray(mesh.points @ [1, 1j], dtype=np.complex128)
    if task.placement.tensor:
        z = np.asarray(task.placement.tensor.to_laplacian(z), dtype=np.complex128)
    cells = Polygons.joined([Polygons.of_triangles(mesh.triangles[~mesh.in_polygon]), mesh.polygons])
    agree = SIGMAS * sigma / float(np.abs(solved.scales).min())
    with blas_threads(1):  # many small problems
        others = alternatives(given.without(zero), cells, z, task.scale, agree)
    return others, "ambiguous" if others else "proved" if shown else "searched"


def _report(
    findings: Findings, found: Verdict, placed: _Placed, deviations: NDArray | None, clock: Clock, task: Task
) -> PlanarMesh:
    """Everything under the names that callers know."""
    solved, evidence, mesh, held = findings.solved, findings.evidence, findings.mesh, findings.written
    topology, noise, options = solved.topology, solved.noise, task.options
    refused = found.status == "uncertified" and not found.distant
    worst, misfits = held.certificate.worst(
        10 if refused else 0,
        noise=noise.at(held.certificate.pairs, findings.stored) if noise else None,
        first=evidence.suspects,
    )
    notes = [*solved.matrix.warnings, *placed.notes]
    if options.noise and evidence.noise is not None and evidence.noise < 0.5 * options.noise:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    if found.uniqueness == "searched" and np.bincount(components_of(findings.stored)).max() > SEARCHED_ROWS:
        notes.append(f"other meshes were looked for in connected parts of up to {SEARCHED_ROWS:,} rows only")
    return PlanarMesh(
        **mesh.fields(triangulate=options.triangulate),
        points=placed.points,
        hinges=topology.hinges,
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=found.status,
        uniqueness=found.uniqueness,
        reason=found.reason.text,
        advice=found.reason.advice,
        operator=task.placement.operator,
        backward_error=held.certificate.backward_error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=tuple(notes),
        worst_entries=worst,
        worst_misfits=misfits,
        standard_deviations=deviations,
        chi_square=held.test.figures if held.test else None,
        estimated_noise=evidence.noise,
        missing_term=evidence.term.name if evidence.term else "",
        n_entries=len(held.certificate.misfits),
        n_fitting=int(np.count_nonzero(held.certificate.misfits <= CERTIFIED)),
        suspects=evidence.suspects,
        alternatives=tuple(found.others),
    )
