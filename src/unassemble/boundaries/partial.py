"""Meshes of which some entries are whole and others are not: positions where the whole ones determine them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..certificate import certify
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.cotangent import edge_weights
from ..planar.piece import left_by_map
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

    None where no part of it is determined, or all of the matrix is whole; where the matrix has the mesh's diagonal,
    too: then entries that do not fit are wrong ones. `whole` (e,): entries that may be relied
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
            given.append(PieceEntries(piece, -matrix.entries[piece.edge_rows] / (1 + shared), own, shared))
        meshes = fitted(given, scale)
    found = [(piece, mesh) for piece, mesh in zip(topology.pieces, meshes, strict=True) if mesh is not None]
    if not any(mesh.determined.any() for _, mesh in found):
        return None
    if whole is None and all(_nothing_gone(piece, matrix, mesh, scale) for piece, mesh in found):
        return None
    with clock("place"):
        topology = Topology(topology.n_vertices, topology.edges, tuple(piece for piece, _ in found), topology.method)
        parts = [(piece.vertices, mesh.determined) for piece, mesh in found]
        placement, said = placement.upon(topology, [known for _, known in parts])
        placed = [placement.apply(piece, mesh.z) for piece, mesh in found]
        factor = np.concatenate([mesh.factor for _, mesh in found]) / placement.stretch  # c of each triangle
        c, region, told = np.array([mesh.scale[0] for _, mesh in found]) / placement.stretch, None, ""
        if any(len(mesh.scale) > 1 for _, mesh in found):
            c, region = distinct(factor)
            told = f", with a factor for each of {len(c)} regions,"
        result = joined(topology, [z for z, _ in placed], c, placement.operator)
        status = node_status(result.component, parts)
        notes = [*said, *piece_notes([some for _, some in placed]), *topology_notes(topology)]
    with clock("certify"):
        points = np.nan_to_num(result.points)
        on = {"triangle": result.triangles}, {"triangle": factor}
        held = certify(matrix.edges, matrix.entries, points, *on, tensor=placement.coefficients)
        rows, spare = [], []
        for piece, mesh in found:
            if mesh.determined.any():
                rows.append(piece.edge_rows[mesh.given & mesh.determined[piece.stencil].all(axis=0)])
                factors = 0 if options.scale is not None else len(mesh.scale)
                spare.append(int(mesh.entries.sum()) - unknowns(mesh.determined, factors))
        pairs = matrix.edges[np.concatenate(rows)]
        claimed = (status[result.triangles] == 0).all(axis=1)
        verdict = partly(status, held, claimed, pairs, min(spare), told, bars=options.standard_deviations)
        sums = matrix.row_sums.copy()
        for end in held.pairs.T:
            sums += np.bincount(end, held.differences, matrix.n)
        gone = (np.abs(sums) > CERTIFIED * matrix.row_size) | (status > 0)
    if verdict is None or (len(pairs) < len(matrix.edges) and not gone.any()):
        return None
    fields, loose = verdict
    return replace(
        result,
        region=region,
        **fields,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes, *loose),
    )


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
        with np.errstate(all="ignore"):
            left = (weights - edge_weights(piece, mesh.z, mesh.factor)) / mesh.factor[piece.facing[:, 0] // 3]
    else:
        found = left_by_map(piece, weights, scale)
        if found is None:
            return False
        others, left = ~mesh.given, found[1]
    return bool((np.abs(left[others]) <= ALIKE).all())
