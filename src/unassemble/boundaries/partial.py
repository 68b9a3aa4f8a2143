"""Meshes of which some entries are whole and others are not: positions where the whole ones determine them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..certify import certify
from ..clock import Clock
from ..errors import GeometryError, SolverError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.cotangent import edge_weights
from ..planar.piece import positions
from ..recovery import PlanarMesh
from ..scalar.joined import joined
from ..scalar.notes import piece_notes, topology_notes
from ..scalar.placement import Placement
from ..tolerances import ALIKE, CERTIFIED
from ..topology import Piece, Topology
from .inside import InsideMesh, PieceEntries, fit_inside
from .judge import node_status, partly, unknowns

Meshes = Sequence[InsideMesh | None]


def _one_factor(given: Sequence[PieceEntries], scale: float | None) -> Meshes:
    """Meshes of pieces that have one factor c each."""
    return [fit_inside(own, scale) for own in given]


def recover_partial(
    matrix: OperatorMatrix,
    whole: NDArray[np.bool_] | None,
    placement: Placement,
    clock: Clock,
    options: ScalarOptions,
    fitted: Callable[[Sequence[PieceEntries], float | None], Meshes] = _one_factor,
) -> PlanarMesh | None:
    """The mesh of the 3-cycles of a matrix, fitted to entries that are those of its triangles and no others.

    None where no part of it is determined, or all of the matrix is whole. `whole` (e,): entries that may be relied
    upon; None for those that have triangles on both sides, and those of rows that add up to zero where others do not.
    `fitted`: meshes of pieces, None for those that have none.
    """
    if options.method != "conformal" or options.noise is not None:
        return None
    with clock("topology"):
        topology = matrix.surfaces
    if not topology.pieces:
        return None
    scale = None if options.scale is None else options.scale * placement.stretch
    with clock("inside"):
        given: list[PieceEntries] = []
        for piece in topology.pieces:
            own = _given(piece, matrix, whole)
            shared = ~own if whole is None else np.zeros_like(own)
            given.append(PieceEntries(piece, -matrix.entries[piece.edge_rows], own, shared))
        meshes = fitted(given, scale)
    meshes = [mesh if mesh is not None and mesh.exact else None for mesh in meshes]  # others have no positions
    if not any(mesh is not None and mesh.determined.any() for mesh in meshes):
        return None
    pairs = list(zip(topology.pieces, meshes, strict=True))
    if whole is None and all(mesh is None or _nothing_gone(piece, matrix, mesh, scale) for piece, mesh in pairs):
        return None
    with clock("place"):
        placed = _Placed.of(topology, meshes, placement)
    return _report(matrix, placed, placement, clock, options)


def distinct(scale: NDArray) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Factors that are not the same but for rounding, in ascending order, and which of them each one is."""
    order = np.argsort(scale)
    ends = scale[order]
    new = np.append(True, np.diff(ends) > CERTIFIED * np.abs(ends[1:]))
    label = np.empty(len(scale), dtype=np.int64)
    label[order] = np.cumsum(new) - 1
    return ends[new], label


def _given(piece: Piece, matrix: OperatorMatrix, whole: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """(e,) entries of a piece that are whole if all of its triangles are there."""
    if whole is not None:
        return whole[piece.edge_rows]
    incomplete = matrix.incomplete_rows[piece.vertices]
    return np.asarray(piece.inner | (incomplete.any() & ~incomplete[piece.edges].all(axis=1)))


def _nothing_gone(piece: Piece, matrix: OperatorMatrix, mesh: InsideMesh, scale: float | None) -> bool:
    """Whether the other entries of a piece are whole as well: on what is determined, or else by a conformal map."""
    weights = -matrix.entries[piece.edge_rows]
    others = ~mesh.given & mesh.determined[piece.stencil].all(axis=0)
    if others.any():
        z, factor = mesh.z, mesh.factor
    else:
        try:
            whole = positions(piece, weights, scale=scale, sharp=False)
        except (GeometryError, SolverError):
            return False
        others, z, factor = ~mesh.given, whole.z, np.full(len(piece.triangles), whole.scale)
    with np.errstate(all="ignore"):
        misfit = np.abs(weights - edge_weights(piece, z, factor))[others]
    return bool((misfit <= ALIKE * np.abs(factor[piece.facing[others, 0] // 3])).all())


@dataclass(frozen=True, eq=False)
class _Placed:
    """Pieces that have positions, in their final frames."""

    topology: Topology  # of these pieces
    meshes: list[InsideMesh]
    mesh: PlanarMesh
    factor: NDArray[np.float64]  # (m,) c of each triangle
    region: NDArray[np.int64] | None  # (m,) where there are several in a piece; `mesh.scale` is that of regions then
    status: NDArray[np.int8]  # (n,) as in :class:`..recovery.Recovery`
    notes: list[str]

    @classmethod
    def of(cls, topology: Topology, meshes: Meshes, placement: Placement) -> _Placed:
        """Placed by anchors, or in the canonical frame of each."""
        found = [(piece, mesh) for piece, mesh in zip(topology.pieces, meshes, strict=True) if mesh is not None]
        topology = Topology(topology.n_vertices, topology.edges, tuple(piece for piece, _ in found), topology.method)
        parts = [(piece.vertices, mesh.determined) for piece, mesh in found]
        placement, said = placement.upon(topology.n_vertices, parts)
        placed = [placement.apply(piece, mesh.z) for piece, mesh in found]
        factor = np.concatenate([mesh.factor for _, mesh in found]) / placement.stretch
        scale, region = np.array([mesh.scale[0] for _, mesh in found]) / placement.stretch, None
        if any(len(mesh.scale) > 1 for _, mesh in found):
            scale, region = distinct(factor)
        mesh = joined(topology, [z for z, _ in placed], scale, placement.operator)
        notes = [*piece_notes([some for _, some in placed]), *placement.unused(topology), *topology_notes(topology)]
        status = node_status(mesh.component, parts)
        return cls(topology, [own for _, own in found], mesh, factor, region, status, [*said, *notes])


def _report(
    matrix: OperatorMatrix, placed: _Placed, placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh | None:
    """The mesh, if whole entries between determined vertices, fitted or not, are those of it as it is written.

    None, too, where the matrix has the mesh's diagonal: then entries that do not fit are wrong ones.
    """
    mesh, topology, status = placed.mesh, placed.topology, placed.status
    with clock("certify"):
        points = np.nan_to_num(mesh.points)
        on = {"triangle": mesh.triangles}, {"triangle": placed.factor}
        found = certify(matrix.edges, matrix.entries, points, *on, tensor=placement.coefficients)
        rows, spare = [], []
        for piece, inside in zip(topology.pieces, placed.meshes, strict=True):
            if inside.determined.any():
                rows.append(piece.edge_rows[inside.given & inside.determined[piece.stencil].all(axis=0)])
                factors = 0 if options.scale is not None else len(inside.scale)
                spare.append(int(inside.entries.sum()) - unknowns(inside.determined, factors))
        pairs = matrix.edges[np.concatenate(rows)]
        error = float(
            found.misfits[np.searchsorted(found.pairs @ [matrix.n, 1], pairs @ [matrix.n, 1])].max(initial=0.0)
        )
        flipped = (status[mesh.triangles[found.flipped]] == 0).all(axis=1).any()
        sums = matrix.row_sums.copy()
        for end in found.pairs.T:
            sums += np.bincount(end, found.differences, matrix.n)
        gone = (np.abs(sums) > CERTIFIED * matrix.row_size) | (status > 0)
    wrong = len(pairs) < len(matrix.edges) and not gone.any()
    if flipped or wrong or not (error <= CERTIFIED and min(spare) > 0):
        return None
    told = "" if placed.region is None else f", with a factor for each of {len(mesh.scale)} regions,"
    fields, loose = partly(status, len(pairs), error, told, bars=options.standard_deviations)
    return replace(
        mesh,
        region=placed.region,
        **fields,
        timings=clock.timings,
        warnings=(*matrix.warnings, *placed.notes, *loose),
    )
