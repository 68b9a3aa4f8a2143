"""Meshes of which some entries are whole and others are not: positions where the whole ones determine them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..certificate import certify_mesh
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.cotangent import edge_weights
from ..planar.piece import left_by_map
from ..recovery import Examined, Placed, PlanarMesh, finish
from ..scalar.joined import joined
from ..scalar.notes import piece_notes, topology_notes
from ..scalar.placement import Placement
from ..tolerances import ALIKE, CERTIFIED
from ..topology import Piece, Topology
from ..words import Reason
from .inside import InsideMesh, PieceEntries, fit_inside
from .judge import PartComparison, node_status, partly, unknowns

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

    Returns None if no vertex is determined, or if all of the matrix is whole, its diagonal included: then entries that
    do not fit are wrong ones. `whole` (e,): entries that may be relied upon; None for those that have triangles on both
    sides, and those of rows that add up to zero where others do not.
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
    part = _Part(matrix, topology, found, placement, options)
    result = finish(clock, part.place, part.compare, part.examine)
    return result if result.certified else None


@dataclass(eq=False)
class _Part:
    """Pieces of which a part is determined: where they are put, and what they are worth there."""

    matrix: OperatorMatrix
    topology: Topology
    found: Sequence[tuple[Piece, InsideMesh]]
    placement: Placement
    options: ScalarOptions

    def place(self) -> Placed[PlanarMesh]:
        """Each piece by what is determined of it."""
        pieces, old = tuple(piece for piece, _ in self.found), self.topology
        topology = Topology(old.n_vertices, old.edges, pieces, old.method)
        parts = [(piece.vertices, mesh.determined) for piece, mesh in self.found]
        placement, said = self.placement.upon(topology, [known for _, known in parts])
        placed = [placement.apply(piece, mesh.z) for piece, mesh in self.found]
        factors, region = np.array([mesh.scale[0] for _, mesh in self.found]) / placement.stretch, None
        if any(len(mesh.scale) > 1 for _, mesh in self.found):
            of_triangles = np.concatenate([mesh.factor for _, mesh in self.found])
            factors, region = distinct(of_triangles / placement.stretch)
        mesh = joined(topology, [z for z, _ in placed], factors, placement.operator)
        notes = [*said, *piece_notes([some for _, some in placed]), *topology_notes(topology)]
        status = node_status(mesh.component, parts)
        return Placed(replace(mesh, region=region, node_status=status), (*self.matrix.warnings, *notes))

    def compare(self, mesh: PlanarMesh) -> PartComparison:
        """With the entries that are whole at points that are determined."""
        rows = [
            piece.edge_rows[part.given & part.determined[piece.stencil].all(axis=0)] for piece, part in self._determined
        ]
        pairs = self.matrix.edges[np.concatenate(rows)]
        return PartComparison(certify_mesh(self.matrix, mesh, self.placement.coefficients), pairs)

    def examine(self, mesh: PlanarMesh, compared: PartComparison) -> Examined:
        """Whether entries are given back, some to spare; a whole mesh with its diagonal is not what is meant."""
        spare = []
        for _, part in self._determined:
            factors = 0 if self.options.scale is not None else len(part.scale)
            spare.append(int(part.entries.sum()) - unknowns(part.determined, factors))
        claimed = (mesh.node_status[mesh.triangles] == 0).all(axis=1)
        told = "" if mesh.region is None else f", with a factor for each of {len(mesh.scale)} regions,"
        bars = self.options.standard_deviations
        found = partly(mesh.node_status, compared, claimed, min(spare), told, bars=bars)
        if len(compared.pairs) == len(self.matrix.edges) or self._something_gone(mesh, compared):
            return found
        whole = Reason("all of the matrix is whole, so that entries which do not fit are wrong ones")
        return replace(found, findings=replace(found.findings, objections=(whole, *found.findings.objections)))

    @property
    def _determined(self) -> list[tuple[Piece, InsideMesh]]:
        """Pieces of which something is determined."""
        return [(piece, mesh) for piece, mesh in self.found if mesh.determined.any()]

    def _something_gone(self, mesh: PlanarMesh, compared: PartComparison) -> bool:
        """Whether some row has not the mesh's diagonal, or no position."""
        sums, certificate = self.matrix.row_sums.copy(), compared.certificate
        for end in certificate.pairs.T:
            sums += np.bincount(end, certificate.differences, self.matrix.n)
        return bool(((np.abs(sums) > CERTIFIED * self.matrix.row_size) | (mesh.node_status > 0)).any())


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
