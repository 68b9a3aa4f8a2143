"""Everything that may be a cell in any drawing of a graph: 3-cycles, 4-cycles, and pairs of edges at a vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...topology.adjacency import adjacency
from ...topology.cycles import three_cycles
from ...topology.faces import around, joined
from ...topology.keys import pair_keys
from ...topology.short_cycles import chordless_four_cycles

_BEFORE = np.array([[2, 0, 1, 3], [3, 0, 1, 2]])  # the side before each, of three and of four
_PLACES = np.arange(4)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Triangles, triangles a-b-c whose side a-c, facing a right angle, has no entry, and undivided quadrilaterals.

    Attributes
    ----------
    n_vertices : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    vertices : (k, 4) int64
        In running order; -1 after the third of a triangle.
    sides : (k, 4) int64
        Rows of `edges`, from each vertex to the next; -1 where there is none.
    """

    n_vertices: int
    edges: NDArray[np.int64]
    vertices: NDArray[np.int64]
    sides: NDArray[np.int64]

    @classmethod
    def of(cls, n: int, edges: NDArray, most: int) -> Shapes | None:
        """Find them all; None if there are more than `most`."""
        degree = np.bincount(edges.ravel(), minlength=n)
        if (degree * (degree - 1) // 2).sum() > most:
            return None
        triangles, opposite = three_cycles(n, edges)
        quads = chordless_four_cycles(n, edges, np.ones(len(edges), dtype=bool))
        corners = _open_wedges(n, edges)
        a, b, c = corners.T
        rows = edges[:, 0] * n + edges[:, 1]
        ends = np.column_stack([np.searchsorted(rows, pair_keys(n, *pair)) for pair in ((a, b), (b, c))])
        return cls(
            n,
            edges,
            np.concatenate([_padded(triangles), _padded(corners), quads]),
            np.concatenate([_padded(opposite[:, [2, 0, 1]]), _padded(ends), around(n, edges, quads) >> 1]),
        )

    def __len__(self) -> int:
        return len(self.vertices)

    @property
    def stored(self) -> NDArray[np.bool_]:
        """(k, 4) sides that have an entry."""
        return self.sides >= 0

    @property
    def corner(self) -> NDArray[np.bool_]:
        """(k,) triangles without the side that faces their second vertex."""
        return self.sides[:, 2] < 0

    @property
    def size(self) -> NDArray[np.int64]:
        """(k,) number of vertices."""
        return np.asarray((self.vertices >= 0).sum(axis=1))

    @property
    def before(self) -> NDArray[np.int64]:
        """(k, 4) place of the side that ends at each vertex."""
        return _BEFORE[self.size - 3]

    @property
    def vanished(self) -> NDArray[np.int64]:
        """(k,) key of the pair of vertices at the ends of a corner; -1 of others."""
        ends = pair_keys(self.n_vertices, self.vertices[:, 0], self.vertices[:, 2])
        return np.where(self.corner, ends, -1)

    def triangles(self, cells: NDArray) -> NDArray[np.int64]:
        """(m, 3) of some cells, quadrilaterals divided by the diagonal from their first vertex."""
        own = self.vertices[cells]
        return np.concatenate([own[:, :3], own[own[:, 3] >= 0][:, [0, 2, 3]]])


def _padded(rows: NDArray) -> NDArray[np.int64]:
    """(k, 4) with -1 after the last."""
    return np.pad(rows.astype(np.int64), ((0, 0), (0, 4 - rows.shape[1])), constant_values=-1)


def _open_wedges(n: int, edges: NDArray) -> NDArray[np.int64]:
    """(k, 3) vertices a, b, c of pairs of edges a-b, b-c, a-c being none."""
    graph = adjacency(n, edges)
    middle = np.repeat(np.arange(n), np.diff(graph.indptr))
    near = graph.indices.astype(np.int64)
    found = []
    for step in range(1, int(np.diff(graph.indptr).max(initial=0))):
        one = np.flatnonzero(middle[step:] == middle[:-step])
        found.append(np.column_stack([near[one], middle[one], near[one + step]]))
    wedges = np.concatenate([np.empty((0, 3), np.int64), *found])
    return wedges[~joined(n, edges, wedges[:, 0], wedges[:, 2])]
