"""A scalar matrix of linear triangles: recognise, solve, place; and what comes after that, for any element."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..cells import SEARCHED_ROWS, alternatives
from ..certificate import certify_mesh
from ..clock import Clock
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.deviations import covariances
from ..planar.normal import distant_pair
from ..recovery import Examined, Placed, PlanarMesh, finish
from ..tolerances import SIGMAS
from ..topology import Polygons
from ..topology.numbering import connected
from .evidence import pooled_noise, weigh
from .findings import Finished, Others, Twice, findings
from .held import PlanarComparison
from .joined import joined
from .noise import Noise
from .notes import vanished_notes
from .placement import Placement
from .solving import Solved, Task, solve


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
    other_meshes: Callable[[Finished], Others],
    notes: Sequence[str],
    clock: Clock,
    sizes: NDArray[np.float64] | None = None,
) -> PlanarMesh:
    """From positions of pieces of any element to the answer.

    `drawn`: pieces at positions, (k,) each, as a mesh; `other_meshes`: those that fit as well, and the uniqueness;
    `notes`: what is to be said; `sizes` (pieces,): of pieces whose size nothing else tells.
    """
    end = _PlanarEnd(solved, drawn, other_meshes, notes, clock, sizes)
    return finish(clock, end.place, end.compare, end.examine)


@dataclass(eq=False)
class _PlanarEnd:
    """Where pieces are put, and what is found out about them there; see :func:`finished`."""

    solved: Solved
    drawn: Callable[[list[NDArray]], PlanarMesh]
    other_meshes: Callable[[Finished], Others]
    notes: Sequence[str]
    clock: Clock
    sizes: NDArray[np.float64] | None
    # set by `place`: positions of each piece, (k,), relative to its origin, and the mesh of these
    placed: list[NDArray] = field(default_factory=list)
    origins: NDArray[np.complex128] = field(default_factory=lambda: np.empty(0, np.complex128))
    near: PlanarMesh | None = None

    def place(self) -> Placed[PlanarMesh]:
        """Pieces in their final frames; the mesh keeps its digits if it is far from the origin."""
        solved, topology = self.solved, self.solved.topology
        nodes, remarks = [mesh.nodes for mesh in solved.meshes], [mesh.notes for mesh in solved.meshes]
        self.placed, self.origins, said = solved.task.placement.placed(topology, nodes, remarks, self.sizes)
        self.near = near = self.drawn(self.placed)
        shift = self.origins[topology.component]
        written = replace(
            near,
            points=near.points + np.column_stack([shift.real, shift.imag]),
            node_status=(topology.multiplicity == 0).astype(np.int8),
        )
        return Placed(written, (*solved.stored.warnings, *said, *self.notes))

    def compare(self, mesh: PlanarMesh) -> Twice:
        """The mesh about its origins, and as it is written."""
        solved, tensor = self.solved, self.solved.task.placement.coefficients
        assert self.near is not None
        near = written = PlanarComparison(certify_mesh(solved.stored, self.near, tensor), solved)
        if self.origins.any():
            written = PlanarComparison(certify_mesh(solved.stored, mesh, tensor), solved)
        return Twice(near, written, weigh(solved, near.certificate, search=not near.passes))

    def examine(self, _: PlanarMesh, compared: Twice) -> Examined:
        """What speaks for the mesh and against it, and its error bars."""
        options, evidence = self.solved.task.options, compared.evidence
        assert self.near is not None
        found, others = findings(Finished(self.solved, self.near, self.origins, compared), self.other_meshes)
        notes = []
        if options.noise and evidence.noise is not None and evidence.noise < 0.5 * options.noise:
            generous = f"the misfit is that of a standard deviation of {evidence.noise:.2g}"
            notes.append(f"the noise given is generous: {generous}")
        if not (found.objections or others) and found.unique == "searched" and not small(self.solved.stored):
            notes.append(f"other meshes were looked for in connected parts of up to {SEARCHED_ROWS:,} rows only")
        deviations = None
        if options.standard_deviations:
            with self.clock("deviations"):
                deviations = _deviations(self.solved, self.placed)
        fields = {
            **compared.written.fields(),
            "standard_deviations": deviations,
            "estimated_noise": evidence.noise,
            "missing_term": evidence.term.name if evidence.term else "",
            "suspects": evidence.suspects,
            "alternatives": tuple(others),
        }
        return Examined(found, notes, fields)


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


def _other_meshes(clock: Clock, finished: Finished) -> Others:
    """Other meshes that fit, and whether it is proved that there are no more.

    Where every cell is a 3-cycle and every 3-cycle a cell the graph shows the boundary. Entries that are stored as
    zeros show it no better than those that are not.
    """
    solved, mesh, task = finished.solved, finished.mesh, finished.solved.task
    stored, noise = solved.stored, solved.noise
    shown = solved.topology.method == "3-cycles"
    zero = stored.entries == 0
    if shown and not zero.any():
        return [], "proved"
    told = noise is not None and (task.options.noise or finished.near.by_noise)  # else entries that are exact
    sigma = noise.sigma if noise and told else finished.evidence.noise or 0.0
    given = stored if told else replace(stored, errors=None)
    z = np.asarray(mesh.points @ [1, 1j], dtype=np.complex128)
    if task.placement.tensor:
        z = np.asarray(task.placement.tensor.to_laplacian(z), dtype=np.complex128)
    polygons = Polygons(mesh.polygons_offsets, mesh.polygons_data)
    cells = Polygons.joined([Polygons.of_triangles(mesh.triangles), polygons])
    agree = SIGMAS * sigma / float(np.abs(solved.scales).min())
    with clock("ambiguity"), blas_threads(1):  # many small problems
        others = alternatives(given.without(zero), cells, z, task.scale, agree)
    return others, "proved" if shown else "searched"
