"""A labelling of the graph: some candidates taken for cells, solved, and held against the matrix."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import GeometryError, SolverError
from ...planar.conformal import conformal_map
from ...planar.hinges import gap
from ...planar.piece import PieceMesh
from ...tolerances import ALIKE, SMALL
from ...topology import Piece, Topology
from ...topology.keys import contains, pair_keys, with_sides
from ...topology.pieces import planar_pieces
from ..candidates.candidates import Candidates
from .within_errors import Placed, misfits, polished

_FACTORISATIONS = 4  # what takes more has wrong cells


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
        triangles = triangulated(candidates, labels)
        edges, given, opposite = with_sides(n, candidates.edges, triangles)
        weights = np.zeros(len(edges))
        weights[given] = candidates.weights
        pieces = planar_pieces(n, edges, triangles, opposite) or ()
        misfit = np.where(weights != 0, 1.0, 0.0)
        return cls(candidates, labels, edges, weights, pieces, (None,) * len(pieces), misfit)

    @classmethod
    def of(
        cls, candidates: Candidates, labels: NDArray[np.bool_], known: dict[bytes, PieceMesh | None] | None = None
    ) -> Labelling:
        """Triangulate the cells and solve every piece, but for those `known`, to which new ones are added."""
        bare = cls.unsolved(candidates, labels)
        n, edges, weights, known = candidates.n_vertices, bare.edges, bare.weights, {} if known is None else known
        placed: Placed = []
        for piece in bare.pieces:
            # The same for the same triangles in the same orientation, which positions go with.
            triangles = piece.vertices[piece.triangles]
            first = triangles.argmin(axis=1)[:, None]
            triangles = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
            name = triangles[np.lexsort(triangles.T)].tobytes()
            if name not in known:
                known[name] = _map_of(piece, weights[piece.edge_rows])
            if (mesh := known[name]) is not None:
                placed.append((piece, mesh))
        misfit, errors = misfits(n, edges, weights, placed), bare._errors
        better = None if errors is None else polished(placed, weights, errors, misfit, candidates.scale)
        if better is None:
            errors = None
        else:
            placed, misfit = better, misfits(n, edges, weights, better, errors)
        _add_discord(n, edges, placed, misfit, candidates.scale, errors)
        # Vertices with more than four right angles: the mesh would wind around them more than once.
        apex = candidates.cells.vertices[candidates.cells.offsets[:-1] + 1]
        crowded = np.bincount(apex[labels & candidates.corner], minlength=n) > 4
        misfit[crowded[edges].any(axis=1)] = 1.0
        found = dict(placed)
        return replace(bare, meshes=tuple(map(found.get, bare.pieces)), misfit=misfit)

    @property
    def _errors(self) -> NDArray[np.float64] | None:
        """(e,) standard deviations, small for what has vanished; None where they are not known, or nothing is there."""
        given, n = self.candidates.errors, self.candidates.n_vertices
        if given is None or not self.pieces or not given.any():
            return None
        errors = np.full(len(self.edges), SMALL * np.median(given[given > 0]))
        keys = pair_keys(n, *self.edges.T)
        place = np.searchsorted(keys, pair_keys(n, *self.candidates.edges.T))
        errors[place] = np.maximum(errors[place], given)
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


def triangulated(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(m, 3) triangles of the chosen cells, longer ones in fans.

    The apex of a fan moves on where a diagonal would be an edge already, of the graph or of another cell.
    """
    n, cells = candidates.n_vertices, candidates.cells.chosen(labels, np.arange(candidates.n_vertices))
    given, shift = candidates.edges[:, 0] * n + candidates.edges[:, 1], np.zeros(cells.count, dtype=np.int64)
    for _ in range(int(candidates.cells.size.max())):
        triangles, cell, outline = cells.fans(shift)
        diagonal = ~outline[:, 2]  # each belongs to the triangle before it
        key, owner = pair_keys(n, *triangles[diagonal][:, [2, 0]].T), cell[diagonal]
        value, place, count = np.unique(key, return_inverse=True, return_counts=True)
        clash = contains(given, value) | (count > 1)
        if not clash.any():
            break
        moved = owner[clash[place]]
        # Of two cells that want the same diagonal one keeps it.
        keeps = np.unique(key[clash[place]], return_index=True)[1]
        moved = np.setdiff1d(moved, moved[keeps][count[clash] > 1])
        shift[moved] += 1
    return triangles


def _add_discord(
    n: int, edges: NDArray, placed: Placed, misfit: NDArray, scale: float | None, errors: NDArray | None
) -> None:
    """Raise the misfit where pieces do not go together: another scale, or rings of pieces that do not close.

    Small pieces by themselves fit nearly everything. What `errors` (e,) explain is left out.
    """
    if not placed or (len(placed) == 1 and scale is None):
        return
    add_differing_factors(placed, misfit, scale)
    if (misfit > ALIKE).any():  # whether rings close is the last question, and the dearest
        return
    topology = Topology(n, edges, tuple(piece for piece, _ in placed), "")
    # In units of their size and of the errors over c, what these may leave open.
    closed = 0.0 if errors is None else 30.0 * float(errors.max()) / min(abs(mesh.scale) for _, mesh in placed)
    left = gap(topology, [mesh.z / np.abs(mesh.z).max() for _, mesh in placed], max(ALIKE, closed))
    left = left if left > closed else 0.0
    at_hinges = np.isin(edges, topology.hinges).any(axis=1)
    misfit[at_hinges] = np.maximum(misfit[at_hinges], min(left, 1.0))


def add_differing_factors(placed: Placed, misfit: NDArray, scale: float | None) -> None:
    """Raise the misfit of pieces with another factor than is known, or than the largest has, by that difference."""
    scale = scale or max(placed, key=lambda item: item[0].n_vertices)[1].scale
    apart = np.minimum(np.abs(np.array([mesh.scale for _, mesh in placed]) / scale - 1), 1.0)
    rows = np.concatenate([piece.edge_rows for piece, _ in placed])
    misfit[rows] = np.maximum(misfit[rows], np.repeat(apart, [len(piece.edge_rows) for piece, _ in placed]))


def even(misfit: NDArray) -> bool:
    """Whether a misfit is small and spread evenly, as that of errors in the entries is, and that of wrong cells is not.

    Of normal errors half are above 0.67 times their root mean square.
    """
    if not misfit.max(initial=0.0) < 1:  # squares of more may overflow
        return False
    size = float(np.sqrt(np.mean(misfit**2)))
    return size < 0.03 and float(misfit.max()) < 8 * size and float(np.median(misfit)) > 0.3 * size


def _map_of(piece: Piece, weights: NDArray) -> PieceMesh | None:
    """The conformal map; None where the entries allow none.

    `weights` (e,): -A_ij of its edges.
    """
    try:
        found = conformal_map(piece, weights, sharp=False, most=_FACTORISATIONS)
    except (GeometryError, SolverError):
        return None
    return PieceMesh(found.z, found.scale) if np.isfinite(found.z).all() and found.scale else None
