"""A scalar matrix on one page: recognise, solve, place, certify."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..cells import SEARCHED_ROWS, Alternative, alternatives
from ..certify import certify
from ..clock import Clock
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.cotangent import edge_weights
from ..planar.deviations import covariances
from ..planar.normal import WeightJacobian, distant_pair
from ..recovery import PlanarMesh
from ..tolerances import SIGMAS
from ..topology import Polygons
from ..topology.numbering import connected
from .evidence import pooled_noise, weigh
from .held import Held
from .joined import JoinedMesh
from .noise import Noise
from .notes import vanished_notes
from .placement import Placement
from .solving import Solved, Task, solve
from .verdict import Findings, Verdict, verdict


def recover_scalar(
    stored: OperatorMatrix,
    placement: Placement,
    clock: Clock,
    options: ScalarOptions,
    squared_lengths: NDArray | None = None,
) -> PlanarMesh:
    """The mesh of a checked scalar matrix, of as few digits as its entries seem to have, or else of exact ones.

    `squared_lengths` (e,): of the edges, where they are known from elsewhere: they give pieces their relative sizes.
    """
    task = Task(options, placement, Noise.known(stored, options.noise), squared_lengths)
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
        topology = stored.surfaces
    if task.noise is not None:
        stored = replace(stored, errors=task.noise.sigma * task.noise.spread)
    solved = solve(topology, stored, clock, task)
    topology = solved.topology
    with clock("place"):
        sizes = None
        if task.squared_lengths is not None:  # mean edge length of each piece; over all edges 1
            lengths = [np.sqrt(task.squared_lengths[piece.edge_rows]) for piece in topology.pieces]
            sizes = np.array([own.mean() for own in lengths]) / np.concatenate(lengths).mean()
        z, remarks = [mesh.z for mesh in solved.meshes], [mesh.notes for mesh in solved.meshes]
        placed, origins, notes = task.placement.placed(topology, z, remarks, sizes)
        mesh = JoinedMesh.of(topology, placed, solved.scales / task.placement.stretch)
    with clock("certify"):
        near = _held_against(stored, solved, mesh, mesh.points, task)
        evidence = weigh(solved, near.certificate, free_scale=free_scale, search=not near.passes)
    deviations = None
    if task.options.standard_deviations:
        with clock("deviations"):
            deviations = _deviations(solved, task, placed)
    written = _held_against(stored, solved, mesh, mesh.shifted(origins), task) if origins.any() else near
    findings = Findings(stored, solved, mesh, origins, near, written, evidence, not free_scale, task.options.polished)
    notes = [*solved.matrix.warnings, *notes, *vanished_notes(topology), *topology.failures]
    return _report(
        findings, verdict(findings, partial(_other_meshes, findings, clock, task)), notes, deviations, clock, task
    )


def _deviations(solved: Solved, task: Task, placed: list[NDArray]) -> NDArray:
    """(n, 2) standard deviations in the final frame, in which pieces are `placed`, (k,) each."""
    pieces, meshes, tensor = solved.topology.pieces, solved.meshes, task.placement.tensor
    free = task.scale is None
    sigma = solved.noise.sigma if solved.noise else pooled_noise(solved, solved.freedom(free_scale=free))
    result = np.full((solved.topology.n_vertices, 2), np.nan)
    for p in range(len(pieces))[::-1]:  # the first piece at a hinge comes last
        z = tensor.to_laplacian(placed[p]) if tensor else placed[p]
        jacobian, stretch = WeightJacobian(pieces[p], z, meshes[p].spread), tensor.root if tensor else None
        weights = edge_weights(pieces[p], z) / jacobian.spread
        covariance = covariances(jacobian, weights, z, distant_pair(z), free_scale=free, stretch=stretch)
        own = sigma / abs(meshes[p].scale)
        result[pieces[p].vertices] = own * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result


def _held_against(stored: OperatorMatrix, solved: Solved, mesh: JoinedMesh, points: NDArray, task: Task) -> Held:
    """The certificate of a mesh with these points, and the test against noise."""
    noise, factors, tensor = solved.noise, mesh.scale[mesh.triangle_piece], task.placement.coefficients
    certificate = certify(stored.edges, stored.entries, points, mesh.triangles, factors, tensor)
    return Held.of(certificate, stored, noise, solved.freedom(free_scale=task.scale is None), solved.scales)


def _other_meshes(findings: Findings, clock: Clock, task: Task) -> tuple[list[Alternative], str]:
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
    with clock("ambiguity"), blas_threads(1):  # many small problems
        others = alternatives(given.without(zero), cells, z, task.scale, agree)
    return others, "ambiguous" if others else "proved" if shown else "searched"


def _report(
    findings: Findings, found: Verdict, notes: list[str], deviations: NDArray | None, clock: Clock, task: Task
) -> PlanarMesh:
    """Everything under the names that callers know."""
    solved, evidence, mesh, held = findings.solved, findings.evidence, findings.mesh, findings.written
    topology, options = solved.topology, task.options
    refused = found.status == "uncertified" and found.uniqueness is None
    if options.noise and evidence.noise is not None and evidence.noise < 0.5 * options.noise:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    component = connected(findings.stored.n, *findings.stored.edges.T)[1]
    if found.uniqueness == "searched" and np.bincount(component).max() > SEARCHED_ROWS:
        notes.append(f"other meshes were looked for in connected parts of up to {SEARCHED_ROWS:,} rows only")
    return PlanarMesh(
        **mesh.fields(triangulate=options.triangulate),
        **held.fields(10 if refused else 0, evidence.suspects),
        points=mesh.shifted(findings.origins),
        hinges=topology.hinges,
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=found.status,
        uniqueness=found.uniqueness,
        reason=found.reason.text,
        advice=found.reason.advice,
        operator=task.placement.operator,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=tuple(notes),
        standard_deviations=deviations,
        estimated_noise=evidence.noise,
        missing_term=evidence.term.name if evidence.term else "",
        suspects=evidence.suspects,
        alternatives=tuple(found.others),
    )
