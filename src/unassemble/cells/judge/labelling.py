"""A labelling of the graph: some candidates taken for cells, solved, and held against the matrix."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...matrix.operator import row_sizes
from ...planar.cotangent import weights_of_all
from ...planar.hinges import gap
from ...planar.piece import PieceMesh
from ...tolerances import ALIKE
from ...topology import Piece, Topology
from ...topology.keys import pair_keys, with_sides
from ...topology.pieces import planar_pieces
from ..candidates.candidates import Candidates
from .maps import map_of
from .triangulation import triangulation
from .within_errors import GAP, beyond, polished


@dataclass(frozen=True, eq=False)
class Labelling:
    """Cells, the triangulated pieces that they make, and how the weights of these fit."""

    candidates: Candidates
    labels: NDArray[np.bool_]  # (cells,) what is taken for a cell
    edges: NDArray[np.int64]  # (e', 2) those of the graph, with the vanished ones of the cells' triangles
    weights: NDArray[np.float64]  # (e',) zero for these
    pieces: tuple[Piece, ...]  # empty where the cells do not make planar surfaces
    meshes: tuple[PieceMesh | None, ...]  # None where a piece has no positions
    # (e',) |c w - a| relative to the smaller of both rows' largest entries, at most 1; 1 on edges of no piece. Where
    # errors of the weights are known, and it is not far beyond them, less what they explain.
    misfit: NDArray[np.float64]

    @classmethod
    def unsolved(cls, candidates: Candidates, labels: NDArray[np.bool_]) -> Labelling:
        """Triangulate the cells, without positions."""
        n = candidates.n_vertices
        triangles = triangulation(candidates, labels)
        edges, given, opposite = with_sides(n, candidates.edges, triangles)
        weights = np.zeros(len(edges))
        weights[given] = candidates.weights
        pieces = planar_pieces(n, edges, triangles, opposite) or ()
        return cls(candidates, labels, edges, weights, pieces, (None,) * len(pieces), misfits(n, edges, weights, []))

    @classmethod
    def of(
        cls, candidates: Candidates, labels: NDArray[np.bool_], known: dict[bytes, PieceMesh | None] | None = None
    ) -> Labelling:
        """Triangulate the cells and solve every piece, but for those `known`, to which new ones are added."""
        bare = cls.unsolved(candidates, labels)
        weights = bare.weights
        known = {} if known is None else known
        names = [_key_of(piece) for piece in bare.pieces]
        for name, piece in zip(names, bare.pieces, strict=True):
            if name not in known:
                known[name] = map_of(piece, weights[piece.edge_rows])
        return bare.placed(tuple(known[name] for name in names))

    def placed(self, meshes: tuple[PieceMesh | None, ...]) -> Labelling:
        """With positions of each piece, or None."""
        candidates, n, edges = self.candidates, self.candidates.n_vertices, self.edges
        solved = [(piece, mesh) for piece, mesh in zip(self.pieces, meshes, strict=True) if mesh]
        misfit = misfits(n, edges, self.weights, solved)
        errors = self._errors
        better = None if errors is None else polished(solved, self.weights, errors, misfit, candidates.scale)
        if better is None or errors is None:
            errors = None
        else:
            solved, meshes = better, tuple(mesh for _, mesh in better)
            misfit = beyond(n, edges, solved, self.weights, errors)
        _add_discord(n, edges, solved, misfit, candidates.scale, errors)
        misfit[np.isin(edges, _crowded(candidates, self.labels)).any(axis=1)] = 1.0
        return replace(self, meshes=meshes, misfit=misfit)

    @cached_property
    def _errors(self) -> NDArray[np.float64] | None:
        """(e',) standard deviations, 0 for what has vanished; None where they are not known, or nothing is solved."""
        given, n = self.candidates.errors, self.candidates.n_vertices
        if given is None or not self.pieces or not given.any():
            return None
        errors = np.zeros(len(self.edges))
        keys = pair_keys(n, *self.edges.T)
        errors[np.searchsorted(keys, pair_keys(n, *self.candidates.edges.T))] = given
        return errors

    @property
    def fits(self) -> bool:
        """Whether every entry is reproduced."""
        return bool(len(self.pieces) and (self.misfit <= ALIKE).all())

    @cached_property
    def size(self) -> float:
        """Root mean square of the misfit."""
        return float(np.sqrt(np.mean(self.misfit**2))) if self.pieces else np.inf

    @property
    def mean_misfit(self) -> float:
        """Where little is wrong this is smaller than where all is wrong a little."""
        return float(self.misfit.mean())

    @property
    def scale(self) -> float:
        """The c that is known, or that of the largest piece; 1 where nothing is solved."""
        solved = [(piece.n_vertices, mesh.scale) for piece, mesh in zip(self.pieces, self.meshes, strict=True) if mesh]
        return self.candidates.scale or max(solved, default=(0, 1.0))[1]


def _crowded(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Vertices with more than four right angles: the mesh would wind around them more than once."""
    apex = candidates.cells.vertices[candidates.cells.offsets[:-1] + 1]
    return np.flatnonzero(np.bincount(apex[labels & candidates.corner], minlength=candidates.n_vertices) > 4)


def misfits(n: int, edges: NDArray, weights: NDArray, solved: list[tuple[Piece, PieceMesh]]) -> NDArray[np.float64]:
    """(e,) |c w - a| relative to the smaller of both rows' largest entries, at most 1; 1 on edges of no piece."""
    misfit = np.where(weights != 0, 1.0, 0.0)
    size = row_sizes(n, edges, np.abs(weights))
    if not solved:
        return misfit
    rows = np.concatenate([piece.edge_rows for piece, _ in solved])
    scale = np.repeat([mesh.scale for _, mesh in solved], [len(piece.edge_rows) for piece, _ in solved])
    smaller = size[edges[rows]].min(axis=1)
    with np.errstate(all="ignore"):  # flat triangles fit nothing
        fitted = weights_of_all(*zip(*((piece, mesh.z) for piece, mesh in solved), strict=True))
        left = np.abs(scale * fitted - weights[rows]) / smaller
    misfit[rows] = np.where(left < 1, left, 1.0)
    return misfit


def _add_discord(
    n: int,
    edges: NDArray,
    solved: list[tuple[Piece, PieceMesh]],
    misfit: NDArray,
    scale: float | None,
    errors: NDArray | None,
) -> None:
    """Raise the misfit where pieces do not go together: another scale, or rings of pieces that do not close.

    Small pieces by themselves fit nearly everything. What `errors` (e,) explain is left out.
    """
    if not solved or (len(solved) == 1 and scale is None):
        return
    add_differing_factors(solved, misfit, scale)
    if (misfit > ALIKE).any():  # whether rings close is the last question, and the dearest
        return
    topology = Topology(n, edges, tuple(piece for piece, _ in solved), "")
    closed = 0.0 if errors is None else GAP * float(errors.max()) / min(abs(mesh.scale) for _, mesh in solved)
    left = gap(topology, [mesh.z / np.abs(mesh.z).max() for _, mesh in solved], max(ALIKE, closed))
    left = left if left > closed else 0.0
    at_hinges = np.isin(edges, topology.hinges).any(axis=1)
    misfit[at_hinges] = np.maximum(misfit[at_hinges], min(left, 1.0))


def add_differing_factors(solved: list[tuple[Piece, PieceMesh]], misfit: NDArray, scale: float | None) -> None:
    """Raise the misfit of pieces with another factor than is known, or than the largest has, by that difference."""
    scale = scale or max(solved, key=lambda item: item[0].n_vertices)[1].scale
    apart = np.minimum(np.abs(np.array([mesh.scale for _, mesh in solved]) / scale - 1), 1.0)
    rows = np.concatenate([piece.edge_rows for piece, _ in solved])
    misfit[rows] = np.maximum(misfit[rows], np.repeat(apart, [len(piece.edge_rows) for piece, _ in solved]))


def even(misfit: NDArray) -> bool:
    """Whether a misfit is small and spread evenly, as that of errors in the entries is, and that of wrong cells is not.

    Of normal errors half are above 0.67 times their root mean square.
    """
    if not misfit.max(initial=0.0) < 1:  # squares of more may overflow
        return False
    size = float(np.sqrt(np.mean(misfit**2)))
    return size < 0.03 and float(misfit.max()) < 8 * size and float(np.median(misfit)) > 0.3 * size


def _key_of(piece: Piece) -> bytes:
    """The same for the same triangles in the same orientation, which positions go with."""
    triangles = piece.vertices[piece.triangles]
    first = triangles.argmin(axis=1)[:, None]
    triangles = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return triangles[np.lexsort(triangles.T)].tobytes()
