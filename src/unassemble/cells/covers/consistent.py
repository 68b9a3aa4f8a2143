"""Whether numbered cells can be put together, and a few that cannot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ...planar.cotangent import edge_weights
from ...planar.hinges import gap
from ...planar.images import growing_images
from ...topology import Piece, Topology
from ...topology.keys import with_sides
from ...topology.pieces import planar_pieces
from .numbered import Numbered

FITS = 1e-6
"""Misfit of weights in units of c, and of positions in units of the largest piece, that rounding leaves."""

_NO_EDGES = np.empty((0, 2), np.int64)


@dataclass(frozen=True, eq=False)
class _Solved:
    edges: NDArray[np.int64]
    pieces: tuple[Piece, ...]
    positions: list[NDArray]


class Assembly:
    """Tests of choices of cells; any part of a choice that passes would pass as well.

    Parameters
    ----------
    cells : Numbered
    fits : float
        Misfit of weights, and what rings of pieces may leave open.
    """

    def __init__(self, cells: Numbered, fits: float = FITS):
        self._cells, self._fits = cells, fits
        self._known: dict[bytes, NDArray | None] = {}

    def conflict(self, chosen: NDArray[np.int64]) -> NDArray[np.int64] | None:
        """Of some cells (rows) a few that no mesh has together; None if all make a mesh."""
        parts = self._parts(chosen)
        wrong = next((part for part in parts if not self._maps(part)), None)
        if wrong is not None:
            return _least(wrong, lambda some: not self._maps(some))
        if self._closes(chosen):
            return None
        # Pieces, of which there are fewer than cells, and a quicker test, which may miss how rings close.
        numbers = np.arange(len(parts))
        if not self._seem_open(parts, numbers):
            return chosen
        return np.concatenate([parts[k] for k in _least(numbers, lambda some: self._seem_open(parts, some))])

    def _parts(self, chosen: NDArray) -> list[NDArray]:
        """Cells that hang together by edges, neighbours next to each other."""
        edge = self._cells.edge[chosen]
        cell, place = np.nonzero(edge >= 0)
        n, e = len(chosen), len(self._cells.shapes.edges)
        graph = sp.coo_array((np.ones(len(cell)), (cell, n + edge[cell, place])), shape=(n + e, n + e)).tocsr()
        label = csgraph.connected_components(graph, directed=False)[1][:n]
        parts = []
        for k in np.unique(label):
            order = csgraph.breadth_first_order(graph, int(np.argmax(label == k)), False, return_predecessors=False)
            parts.append(chosen[order[order < n]])
        return parts

    def _maps(self, chosen: NDArray) -> bool:
        return self._positions(chosen) is not None

    def _closes(self, chosen: NDArray) -> bool:
        """Whether rings of pieces close."""
        solved = self._positions(chosen)
        if solved is None:
            return False
        return (
            gap(Topology(self._cells.shapes.n_vertices, solved.edges, solved.pieces, ""), solved.positions, self._fits)
            <= self._fits
        )

    def _seem_open(self, parts: list[NDArray], numbers: NDArray) -> bool:
        """Whether no mirror images were found with which rings of some parts close."""
        solved = self._positions(np.concatenate([parts[k] for k in numbers]))
        if solved is None:
            return True
        count = np.bincount(np.concatenate([piece.vertices for piece in solved.pieces]))
        shared = [count[piece.vertices] > 1 for piece in solved.pieces]
        vertices = [piece.vertices[own] for piece, own in zip(solved.pieces, shared, strict=True)]
        return not growing_images(
            vertices, [z[own] for z, own in zip(solved.positions, shared, strict=True)], self._fits
        )

    def _positions(self, chosen: NDArray) -> _Solved | None:
        """Pieces and positions; None if the cells do not make planar surfaces with these cotangents."""
        shapes, cells = self._cells.shapes, self._cells
        n = shapes.n_vertices
        triangles = shapes.triangles(cells.cell[chosen])
        edges, _, opposite = with_sides(n, _NO_EDGES, triangles)
        pieces = planar_pieces(n, edges, triangles, opposite)
        if not pieces:
            return None
        edge, place = cells.edge[chosen], np.nonzero(cells.slot[chosen] >= 0)
        ends = shapes.edges[edge[place]] @ [n, 1]
        weights = np.bincount(
            np.searchsorted(edges @ [n, 1], ends), cells.cotangents[chosen][place] / 2, minlength=len(edges)
        )
        positions = []
        for piece in pieces:
            name = piece.vertices[piece.triangles].tobytes() + np.round(weights[piece.edge_rows], 6).tobytes()
            if name not in self._known:
                self._known[name] = _laid_out(piece, weights[piece.edge_rows], self._fits)
            z = self._known[name]
            if z is None:
                return None
            positions.append(z)
        return _Solved(edges, pieces, positions)


def _least(items: NDArray, bad: Callable[[NDArray], bool]) -> NDArray:
    """Of items that are bad together a few that are, of which none can be spared.

    Junker, QuickXplain, AAAI 2004: it asks about as many times as these are, times a logarithm.
    """

    def needed(before: NDArray, added: bool, rest: NDArray) -> NDArray:
        if added and bad(before):
            return rest[:0]
        if len(rest) == 1:
            return rest
        one, other = np.split(rest, [len(rest) // 2])
        second = needed(np.concatenate([before, one]), True, other)
        first = needed(np.concatenate([before, second]), len(second) > 0, one)
        return np.concatenate([first, second])

    return needed(items[:0], False, items)


def _laid_out(piece: Piece, weights: NDArray, fits: float) -> NDArray | None:
    """The conformal map of a piece whose c is 1, with two vertices held; None if there is none."""
    n = piece.n_vertices
    form = np.zeros((n, n), dtype=np.complex128)
    i, j = piece.edges.T
    form[i, j] = form[j, i] = -weights / 2
    np.fill_diagonal(form, -form.sum(axis=1))
    np.add.at(form, (piece.boundary[:, 0], piece.boundary[:, 1]), 0.25j)
    np.add.at(form, (piece.boundary[:, 1], piece.boundary[:, 0]), -0.25j)
    held = piece.boundary[0]
    free = np.setdiff1d(np.arange(n), held)
    z = np.zeros(n, dtype=np.complex128)
    z[held[1]] = 1
    try:
        z[free] = np.linalg.solve(form[np.ix_(free, free)], -form[free, held[1]])
    except np.linalg.LinAlgError:
        return None
    with np.errstate(all="ignore"):
        misfit = np.abs(edge_weights(piece, z) - weights)
    return z / np.abs(z).max() if (misfit <= fits).all() else None
