"""What peeling has left open, cluster by cluster: each is a smaller mesh of its own, with c known.

Triangles of which all is known separate others from each other; what they leave of the weights of edges belongs to the
clusters in between. So the cost of reading these grows with their number, and not with the size of the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ...topology.faces import from_cycles
from ...topology.keys import Grouped
from ..candidates.candidates import Candidates
from ..labels.descent import Descent
from ..labels.effort import Effort
from ..reading import Reading
from .patches import arcs_across
from .peeling import NOTHING, Peeled

_SOLVES = 500  # for small changes of what is open in one cluster; the hardest that was read took 300


def with_clusters(
    triangles: NDArray[np.int64], sides: NDArray[np.int64], edges: NDArray, weights: NDArray, c: float, known: Peeled
) -> NDArray[np.int64] | None:
    """(k, 3) the cells among some triangles, what is open having been read; None where a cluster cannot be read.

    Parameters
    ----------
    triangles : (m, 3) int64
        Vertices of each triangle that may be a cell.
    sides : (m, 3) int64
        Its edges.
    edges : (e, 2) int64
    weights : (e,) float64
        -A_ij of each edge.
    c : float
    known : Peeled
        From these weights and c.
    """
    found = [triangles[known.whole & (known.state > 0)]]
    left = np.where(np.abs(known.left) <= NOTHING * (1 + np.abs(2 * weights / c)), 0.0, known.left * c / 2)
    for rows in _clusters(sides, known):
        if known.state[rows].all():
            found.append(triangles[rows])
            continue
        own = np.unique(sides[rows])
        vertices, ends = np.unique(edges[own], return_inverse=True)
        cluster = np.searchsorted(vertices, triangles[rows])
        cells = _read(len(vertices), ends.reshape(-1, 2), left[own], c, cluster, cluster[known.state[rows] == 0])
        if cells is None:
            return None
        found.append(vertices[cells])
    return np.concatenate(found)


def _clusters(sides: NDArray[np.int64], known: Peeled) -> Iterator[NDArray[np.int64]]:
    """Triangles that share edges, of those of which not all is known; the smallest clusters first."""
    m, across = len(sides), arcs_across(sides)
    one, other = np.arange(3 * m) // 3, across // 3
    joined = (across >= 0) & ~known.whole[one] & ~known.whole[other]
    graph = sp.coo_array((np.ones(joined.sum(), np.int8), (one[joined], other[joined])), shape=(m, m))
    count, label = csgraph.connected_components(graph, directed=False)
    by_label = Grouped(np.where(known.whole, -1, label), count)
    size = np.diff(by_label.start)
    for k in np.argsort(size, kind="stable")[np.count_nonzero(size == 0) :].tolist():
        yield by_label.order[by_label.start[k] : by_label.start[k + 1]]


def _read(
    n: int, edges: NDArray, weights: NDArray, c: float, triangles: NDArray[np.int64], open_ones: NDArray[np.int64]
) -> NDArray | None:
    """(k, 3) cells of one cluster, at first all of its triangles: some of those that are open may be holes."""
    drawing = from_cycles(n, edges, [triangles])
    if drawing is None:
        return None
    candidates = Candidates.of(drawing, weights, c)
    reading = Reading.of(candidates, _labels(candidates, triangles))
    if not reading.fits:
        reading = Descent(reading, free=_labels(candidates, open_ones)).run(Effort(_SOLVES))
    chosen = reading.candidates.cells.chosen(reading.labels, np.arange(n))
    return chosen.vertices.reshape(-1, 3) if reading.fits and (chosen.size == 3).all() else None


def _labels(candidates: Candidates, triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(cells,) which candidates are some triangles (m, 3), of its faces."""
    labels = (candidates.size == 3) & ~candidates.corner & ~candidates.outer
    start = candidates.cells.offsets[:-1][labels]
    names = np.sort(candidates.cells.vertices[start[:, None] + np.arange(3)], axis=1)
    key = [candidates.n_vertices**2, candidates.n_vertices, 1]
    labels[labels] = np.isin(names @ key, np.sort(triangles, axis=1) @ key)
    return labels
