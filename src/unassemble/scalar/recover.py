"""A scalar matrix of linear triangles: recognise, solve, place; and what comes after that, for any element."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..cells import SEARCHED_ROWS, Alternative, alternatives
from ..clock import Clock
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.deviations import covariances
from ..planar.normal import distant_pair
from ..recovery import PlanarMesh
from ..tolerances import SIGMAS
from ..topology import Polygons
from ..topology.numbering import connected
from .evidence import pooled_noise, weigh
from .held import Held, held
from .joined import joined
from .noise import Noise
from .notes import vanished_notes
from .placement import Placement
from .solving import Solved, Task, solve
from .verdict import Findings, verdict


def recover_scalar(
    stored: OperatorMatrix,
    placement: Placement,
    clock: Clock,
    options: ScalarOptions,
    squared_lengths: NDArray | None = None,
) -> PlanarMesh:
    """The mesh of a checked scalar matrix whose entries have errors of known size, or those of assembly.

    `squared_lengths` (e,): of the edges, where they are known from elsewhere: they give pieces their relative sizes.
    """
    task = Task(options, placement, Noise.known(stored, options.noise))
    with clock("topology"):
        topology = stored.surfaces
    if task.noise is not None:
        stored = replace(stored, errors=task.noise.sigma * task.noise.spread)
    solved, sizes = solve(topology, stored, clock, task), None
    topology = solved.topology
    if squared_lengths is not None:  # mean edge length of each piece; over all edges 1
        lengths = [np.sqrt(squared_lengths[piece.edge_rows]) for piece in topology.pieces]
        sizes = np.array([own.mean() for own in lengths]) / np.concatenate(lengths).mean()

    def drawn(placed: list[NDArray]) -> PlanarMesh:
        return joined(topology, placed, solved.scales / placement.stretch, placement.operator)

    said = (*vanished_notes(topology), *topology.failures)
    found = finished(solved, drawn, partial(_other_meshes, clock), said, clock, sizes)
    return found.triangulated() if options.triangulate else found


def finished(
    solved: Solved,
    drawn: Callable[[list[NDArray]], PlanarMesh],
    other_meshes: Callable[[Findings], tuple[list[Alternative], str]],
    notes: Sequence[str],
    clock: Clock,
    sizes: NDArray[np.float64] | None = None,
) -> PlanarMesh:
    """From positions of pieces of any element to the answer: place, certificate, evidence, error bars and verdict.

    `drawn`: pieces at positions, (k,) each, as a mesh; `other_meshes`: those that fit as well, and the uniqueness;
    `notes`: what is to be said; `sizes` (pieces,): of pieces whose size nothing else tells.
    """
    topology, placement, options = solved.topology, solved.task.placement, solved.task.options
    with clock("place"):
        nodes, remarks = [mesh.nodes for mesh in solved.meshes], [mesh.notes for mesh in solved.meshes]
        placed, origins, said = placement.placed(topology, nodes, remarks, sizes)
        mesh = drawn(placed)
        shift = origins[topology.component]
        written = mesh.points + np.column_stack([shift.real, shift.imag])
    with clock("certify"):
        near = far = Held(held(solved.stored, mesh, placement.coefficients), solved)
        if origins.any():
            far = Held(held(solved.stored, replace(mesh, points=written), placement.coefficients), solved)
        evidence = weigh(solved, near.certificate, search=not near.passes)
    deviations = None
    if options.standard_deviations:
        with clock("deviations"):
            deviations = _deviations(solved, placed)
    status, uniqueness, reason, others = verdict(Findings(solved, mesh, origins, near, far, evidence), other_meshes)
    notes = [*solved.stored.warnings, *said, *notes]
    if options.noise and evidence.noise is not None and evidence.noise < 0.5 * options.noise:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    if uniqueness == "searched" and not small(solved.stored):
        notes.append(f"other meshes were looked for in connected parts of up to {SEARCHED_ROWS:,} rows only")
    refused = status == "uncertified" and uniqueness is None
    return replace(
        mesh,
        **far.fields(10 if refused else 0, evidence.suspects),
        points=written,
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=status,
        uniqueness=uniqueness,
        reason=reason.text,
        advice=reason.advice,
        timings=clock.timings,
        warnings=tuple(notes),
        standard_deviations=deviations,
        estimated_noise=evidence.noise,
        missing_term=evidence.term.name if evidence.term else "",
        suspects=evidence.suspects,
        alternatives=tuple(others),
    )


def small(stored: OperatorMatrix) -> bool:
    """Whether other meshes are looked for in all of a matrix."""
    return bool(np.bincount(connected(stored.n, *stored.edges.T)[1]).max() <= SEARCHED_ROWS)


def _deviations(solved: Solved, placed: list[NDArray]) -> NDArray:
    """(n, 2) standard deviations in the final frame, in which pieces are `placed`, (k,) each."""
    pieces, tensor = solved.topology.pieces, solved.task.placement.tensor
    sigma = solved.noise.sigma if solved.noise else pooled_noise(solved)
    result = np.full((solved.topology.n_vertices, 2), np.nan)
    for p in range(len(pieces))[::-1]:  # the first piece at a hinge comes last
        model, mesh = solved.models[p], solved.meshes[p]
        nodes = tensor.to_laplacian(placed[p]) if tensor else placed[p]
        z = nodes[: model.n]
        weights = model.weights(z)
        spread = np.ones(len(weights)) if mesh.spread is None else mesh.spread
        covariance = covariances(
            model.jacobian(z, spread),
            weights / spread,
            nodes,
            distant_pair(z),
            free_scale=solved.task.free_scale,
            stretch=tensor.root if tensor else None,
            nodes=model.nodes,
        )
        own = sigma / abs(mesh.scale)
        result[pieces[p].vertices] = own * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result


def _other_meshes(clock: Clock, findings: Findings) -> tuple[list[Alternative], str]:
    """Other meshes that fit, and whether there are none: ``"proved"``, ``"searched"`` or ``"ambiguous"``.

    Where every cell is a 3-cycle and every 3-cycle a cell the graph shows the boundary. Entries that are stored as
    zeros show it no better than those that are not.
    """
    solved, mesh, task = findings.solved, findings.mesh, findings.solved.task
    stored, noise = solved.stored, solved.noise
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
    polygons = Polygons(mesh.polygons_offsets, mesh.polygons_data)
    cells = Polygons.joined([Polygons.of_triangles(mesh.triangles), polygons])
    agree = SIGMAS * sigma / float(np.abs(solved.scales).min())
    with clock("ambiguity"), blas_threads(1):  # many small problems
        others = alternatives(given.without(zero), cells, z, task.scale, agree)
    return others, "ambiguous" if others else "proved" if shown else "searched"
