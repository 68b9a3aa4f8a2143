"""A scalar matrix on one page: recognise, solve, place, certify."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .. import certify as certificates
from ..cells import Alternative, alternatives
from ..clock import Clock
from ..linalg import AnalysisAhead, blas_threads, factorisation
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.hinges import free_images, join
from ..planar.pencil import pencil_pattern
from ..planar.piece import PieceMesh
from ..recovery import PlanarMesh
from ..tolerances import SUSPICIOUS
from ..topology import Polygons, Topology, local_numbering, surfaces, triangles_everywhere
from .deviations import coordinate_deviations
from .evidence import pooled_noise, weigh
from .factors import Factors, discord
from .joined import JoinedMesh
from .noise import Noise, NoiseTest
from .notes import image_notes, origin_notes, piece_notes, topology_notes, vanished_notes
from .placement import Placement
from .reservations import ambiguous, far_away, nothing_to_spare
from .solving import solve
from .verdict import decides, passes, verdict

_SMALL = 1e-3
_SIGMAS = 10.0  # noise by which numbers that a reading takes for equal may differ


def recover_scalar(stored: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions) -> PlanarMesh:
    """The mesh of a checked scalar matrix."""
    noise = Noise.known(stored, options.noise)
    found = _recovered(stored, placement, clock, options, noise)
    searched = "faces" in clock.timings  # for cells
    if searched and found.status == "uncertified" and noise and noise.digits:
        # Few digits need not be rounded ones, and errors that entries do not have hide what their cells are.
        exact = _recovered(stored, placement, clock, options, None)
        return exact if exact.status != "uncertified" else found
    return found


def _recovered(
    stored: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions, noise: Noise | None
) -> PlanarMesh:
    """The mesh of a matrix whose entries have errors of known size, or those of assembly."""
    scale = options.scale
    # With a tensor, c L is what is left of c div(K grad): its factor is c sqrt(det K).
    stretch = placement.tensor.root_determinant if placement.tensor else 1.0
    known = None if scale is None else scale * stretch
    with clock("topology"):
        numbering = local_numbering(stored.n, stored.edges)
        analyse: AnalysisAhead | None = None
        # Most matrices are those of a single piece, and its pencil has their pattern. Others may be large and dense,
        # or lack the diagonals of their cells.
        planar = options.method == "conformal" and len(stored.edges) < 3 * stored.n
        if planar and triangles_everywhere(stored.n, numbering.edges):
            used = stored.entries[numbering.edge_rows] != 0
            analyse = AnalysisAhead(pencil_pattern(stored.n, numbering.edges[used]), options.threads)
        topology = surfaces(stored.n, stored.edges, numbering)
    if noise is not None:
        stored = replace(stored, errors=noise.sigma * noise.spread)
    matrix, topology, meshes, factors, noise = solve(
        topology,
        stored,
        clock,
        method=options.method,
        scale=known,
        refine=options.refine,
        noise=noise,
        analyse=analyse or factorisation,
    )
    with clock("place"):
        origins = placement.origins(topology)
        placed, notes = _place(topology, placement, origins, meshes)
        mesh = JoinedMesh.of(topology, placed, np.array([m.scale for m in meshes]) / stretch)
        shift = origins[mesh.component]
        points = mesh.points + np.column_stack([shift.real, shift.imag])
    with clock("certify"):
        freedom = _freedom(topology, factors, scale)
        scales = np.array([m.scale for m in meshes])
        certificate, test = _held_against(stored, mesh, mesh.points, placement, noise, freedom, scales)
        # A misfit at rounding level, or one that noise explains, hides no wrong entry.
        search = not passes(certificate, test)
        search |= not decides(certificate, test) and certificate.backward_error > SUSPICIOUS
        evidence = weigh(
            topology,
            matrix,
            meshes,
            certificate,
            freedom,
            free_scale=scale is None,
            search=search,
            known_noise=noise,
        )
    deviations = None
    if options.standard_deviations:
        with clock("deviations"):
            sigma = noise.sigma if noise else pooled_noise(topology, matrix, meshes, freedom)
            deviations = coordinate_deviations(topology, placement, placed, meshes, sigma, factors, free=scale is None)
    trouble = [note for m in meshes for note in m.notes]
    doubt = max(m.doubt for m in meshes)
    apart = discord(topology, factors, certificate.backward_error, noise)
    status, reason = verdict(
        topology, certificate, test, matrix, evidence, scales, trouble, doubt, apart, polished=options.refine
    )
    if status == "certified":
        loose = certificates.without_spare_equations(
            stored.edges, mesh.points, mesh.triangles, known_scale=scale is not None
        )
        if len(loose):
            status, reason = nothing_to_spare(certificate, loose)
    others: list[Alternative] = []
    uniqueness: str | None = None
    if status == "certified":
        with clock("ambiguity") if topology.method == "the numbers" else nullcontext():  # else next to nothing
            told = noise and (options.noise or decides(certificate, test))  # else entries that are exact
            sigma = noise.sigma if noise and told else evidence.noise or 0.0
            agree = _SIGMAS * sigma / float(np.abs(scales).min())
            given = stored if told else replace(stored, errors=None)
            others, uniqueness = _uniqueness(topology, given, placement, mesh, agree, known)
    if others:
        status, reason = ambiguous(others, certificate)
    distant = False
    if origins.any():
        near = certificate
        certificate, test = _held_against(stored, mesh, points, placement, noise, freedom, scales)
        distant = status == "certified" and not passes(certificate, test)
        if distant:
            status, reason = far_away(origins, certificate, near)
    worst, misfits = certificate.worst(
        10 if status == "uncertified" and not distant else 0,
        noise=noise.at(certificate.pairs, stored) if noise else None,
        first=evidence.suspects,
    )
    if options.noise and evidence.noise is not None and evidence.noise < 0.5 * options.noise:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    # What a misfit that small lacks is digits, and not triangles.
    if status == "uncertified" and not (others or noise or distant or certificate.backward_error < _SMALL):
        notes += origin_notes(stored, evidence.suspects)
    polygons = Polygons.none() if options.triangulate else mesh.polygons
    return PlanarMesh(
        points=points,
        triangles=mesh.triangles if options.triangulate else mesh.triangles[~mesh.in_polygon],
        component=mesh.component,
        hinges=topology.hinges,
        scale=mesh.scale,
        polygons_offsets=polygons.offsets,
        polygons_data=polygons.vertices,
        boundary=mesh.boundary,
        boundary_offsets=mesh.boundary_offsets,
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=status,
        uniqueness=uniqueness,
        reason=reason,
        operator="anisotropic laplacian" if placement.tensor else "laplacian",
        backward_error=certificate.backward_error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes),
        worst_entries=worst,
        worst_misfits=misfits,
        standard_deviations=deviations,
        chi_square=test.figures if test else None,
        estimated_noise=evidence.noise,
        suspects=evidence.suspects,
        alternatives=tuple(others),
    )


def _uniqueness(
    topology: Topology,
    stored: OperatorMatrix,
    placement: Placement,
    mesh: JoinedMesh,
    agree: float,
    known: float | None,
) -> tuple[list[Alternative], str]:
    """Other meshes that fit, and whether there are none: ``"proved"``, ``"searched"`` or ``"ambiguous"``.

    Where every cell is a 3-cycle and every 3-cycle a cell the graph shows the boundary. Entries that are stored as
    zeros show it no better than those that are not.
    """
    shown = topology.method == "3-cycles"
    zero = stored.entries == 0
    others: list[Alternative] = []
    if not shown or zero.any():
        z = np.asarray(mesh.points @ [1, 1j], dtype=np.complex128)
        if placement.tensor:
            z = np.asarray(placement.tensor.to_laplacian(z), dtype=np.complex128)
        cells = Polygons.joined([Polygons.of_triangles(mesh.triangles[~mesh.in_polygon]), mesh.polygons])
        with blas_threads(1):  # many small problems
            others = alternatives(stored.without(zero), cells, z, known, agree)
    return others, "ambiguous" if others else "proved" if shown else "searched"


def _held_against(
    stored: OperatorMatrix,
    mesh: JoinedMesh,
    points: NDArray,
    placement: Placement,
    noise: Noise | None,
    freedom: int,
    scales: NDArray,
) -> tuple[certificates.Certificate, NoiseTest | None]:
    """The certificate of a mesh with these points, and the test against noise."""
    tensor = placement.tensor
    certificate = certificates.certify(
        stored.edges,
        stored.entries,
        points,
        mesh.triangles,
        mesh.scale[mesh.triangle_piece],
        (tensor.kxx, tensor.kxy, tensor.kyy) if tensor else None,
    )
    if noise is None:
        return certificate, None
    misfit = certificate.differences / noise.at(certificate.pairs, stored)
    return certificate, NoiseTest.of(noise, misfit, freedom, scales)


def _place(
    topology: Topology, placement: Placement, origins: NDArray, meshes: list[PieceMesh]
) -> tuple[list[NDArray], list[str]]:
    """Every piece in its final frame, relative to its origin, hinges joined; and what is to be said about it."""
    placed, remarks = [], []
    for label, (piece, mesh) in enumerate(zip(topology.pieces, meshes, strict=True)):
        z, more = placement.apply(piece, mesh.z, origins[label])
        placed.append(z)
        remarks.append((*mesh.notes, *more))
    notes = piece_notes(remarks)
    known = np.array([placement.known_positions(piece) for piece in topology.pieces])
    placed = join(topology, placed, known)
    notes += placement.unused(topology)
    images = image_notes(topology, free_images(topology, placed))
    notes += [*topology_notes(topology), *images, *vanished_notes(topology), *topology.failures]
    return placed, notes


def _freedom(topology: Topology, factors: Factors, scale: float | None) -> int:
    """Entries less fitted unknowns: 2 v - 4 coordinates of each piece, as far as rings do not tie them, and each c."""
    coordinates = sum(2 * piece.n_vertices - 4 for piece in topology.pieces) - int(factors.closings.sum())
    return len(topology.edges) - coordinates - (factors.count if scale is None else 0)
