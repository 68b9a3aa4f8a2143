"""Edge-connected pieces of a mesh, taken apart at the vertices that they share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..topology.pieces import edge_connected

if TYPE_CHECKING:
    from ..recovery import PlanarMesh


@dataclass(frozen=True, eq=False)
class Pieces:
    """A mesh in which each piece has vertices of its own.

    Attributes
    ----------
    vertices : (k,) int64
        The mesh's vertex behind each new one.
    piece : (k,) int64
        -1 for vertices of no triangle.
    group : (count,) int64
        Label of each piece; those joined by hinges share one.
    triangles, boundary, hinges, pairs
        As in :class:`unassemble.plot.layout.Drawing`, in new numbers.
    """

    vertices: NDArray[np.int64]
    piece: NDArray[np.int64]
    group: NDArray[np.int64]
    triangles: NDArray[np.int64]
    boundary: NDArray[np.int64]
    hinges: NDArray[np.int64]
    pairs: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of pieces."""
        return len(self.group)

    @property
    def of_triangle(self) -> NDArray[np.int64]:
        """(m,) piece of each triangle."""
        return self.piece[self.triangles[:, 0]]


def together(recovery: PlanarMesh, triangles: NDArray) -> Pieces:
    """The pieces of a mesh without hinges: nothing is renumbered."""
    return Pieces(
        np.arange(recovery.n_points),
        recovery.component,
        np.arange(recovery.n_components),
        triangles,
        recovery.boundary,
        recovery.hinges,
        recovery.worst_entries,
    )


def apart(recovery: PlanarMesh, triangles: NDArray) -> Pieces:
    """The pieces of a mesh with hinges, each of which becomes one vertex for each of its pieces."""
    n = recovery.n_points
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    half_edges = tail * n + head
    order = np.argsort(half_edges)
    owner = np.repeat(edge_connected(n, triangles), 3)

    def piece_of(edges: NDArray) -> NDArray:
        """Piece of directed edges, -1 where there is none."""
        key = edges[:, 0] * n + edges[:, 1]
        place = order[np.searchsorted(half_edges, key, sorter=order).clip(max=len(order) - 1)]
        return np.where(half_edges[place] == key, owner[place], -1)

    keys, corner = np.unique(owner * n + tail, return_inverse=True)
    of_pairs = np.maximum(piece_of(recovery.worst_entries), piece_of(recovery.worst_entries[:, ::-1]))
    pairs = recovery.worst_entries[of_pairs >= 0]
    vertices, piece = keys % n, keys // n
    return Pieces(
        vertices,
        piece,
        _joined(n, vertices, piece),
        corner.reshape(-1, 3),
        np.searchsorted(keys, piece_of(recovery.boundary)[:, None] * n + recovery.boundary),
        np.flatnonzero(np.isin(vertices, recovery.hinges)),
        np.searchsorted(keys, of_pairs[of_pairs >= 0, None] * n + pairs),
    )


def _joined(n: int, vertices: NDArray, piece: NDArray) -> NDArray:
    """Label of each piece; those that share a vertex, or are linked by such, have the same."""
    count = int(piece.max()) + 1
    graph = sp.csr_array((np.ones(len(piece), np.int8), (piece, count + vertices)), shape=(count + n, count + n))
    return np.unique(csgraph.connected_components(graph, directed=False)[1][:count], return_inverse=True)[1]
