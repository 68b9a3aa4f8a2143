"""Which cells a graph is made of: two nodes that only one cell has in common show that cell.

All nodes of a cell are coupled to each other. Where a pair belongs to one cell only, its common neighbours are the
other nodes of that cell, so that these form a clique: of four for bilinear quadrilaterals, whose diagonals are such
pairs, of six for quadratic triangles, and so on. Neighbouring cells share the nodes of a side. Linear triangles and
tetrahedra have no such pairs inside of a mesh; of the latter nearly every pair lies in a clique of four.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..budget import AT_ONCE
from ..tolerances import MOST, NEARLY_ALL

_OFTEN = 0.15  # share of pairs that show their cell: a fifth of those of quadratic tetrahedra, more of all others

CELLS = {
    # nodes of a cell, and those that neighbours share: kind, and name
    (4, 2): ("quadrilaterals", "bilinear elements on quadrilaterals"),
    (8, 4): ("hexahedra", "trilinear elements on hexahedra"),
    (6, 3): ("quadratic", "quadratic elements on triangles"),
    (8, 3): ("quadratic", "serendipity elements on quadrilaterals"),
    (9, 3): ("quadratic", "biquadratic elements on quadrilaterals"),
    (10, 6): ("tetrahedra", "quadratic elements on tetrahedra"),
    (20, 8): ("hexahedra", "serendipity elements on hexahedra"),
    (27, 9): ("hexahedra", "triquadratic elements on hexahedra"),
    (10, 4): ("cubic", "cubic elements on triangles"),
    (16, 4): ("cubic", "bicubic elements on quadrilaterals"),
}


@dataclass(frozen=True)
class CliqueShares:
    """What pairs of coupled rows have in common."""

    nodes: int  # of a cell, where pairs show such; else 0
    shared: int  # nodes that neighbouring ones of these have in common
    often: float  # share of pairs that show a cell
    # share of pairs that lie in a clique of four, and of three
    in_fours: float
    in_threes: float
    # to how many others, in the mean, the common neighbours of a pair are coupled among these: two, where the cells
    # around an edge are tetrahedra and close a ring, or less where they do not; some more by chance
    around: float
    twins: float  # share of rows with the neighbours of another row, and coupled to it: several unknowns of one node


def cells_of(n: int, edges: NDArray[np.int64]) -> CliqueShares:
    """Look at some pairs i < j of a graph, of which there is at least one, all near to each other."""
    most = 1500  # pairs to look at, in a part of four times as many rows
    graph = sp.csr_array((np.ones(len(edges), np.int32), edges.T), shape=(n, n))
    graph = graph + graph.T
    rows = csgraph.breadth_first_order(graph, int(edges[0, 0]), directed=False, return_predecessors=False)[: 4 * most]
    near = graph[rows][:, rows].tocsr()
    inner = np.diff(near.indptr) == np.diff(graph.indptr)[rows]  # those with all of their neighbours
    pairs = np.column_stack(sp.triu(near, 1).nonzero())
    pairs = pairs[inner[pairs].any(axis=1)] if inner.any() else pairs
    most = min(most, max(100, int(AT_ONCE / max(np.diff(near.indptr).mean(), 1) ** 2)))  # each takes a degree squared
    pairs = np.random.default_rng(0).permutation(pairs)[:most]  # every second one may be all of one kind, on a grid
    i, j = pairs.T
    common = sp.csr_array(near[i].multiply(near[j]))  # (pairs, rows)
    count, within = common.sum(axis=1), sp.csr_array((common @ near).multiply(common)).sum(axis=1)
    clique = (count > 0) & (within == count * (count - 1))
    found = np.bincount(count[clique], minlength=1)
    size = int(found.argmax()) + 2
    told = found.max() >= max(MOST * found.sum(), _OFTEN * len(pairs), 1)
    shared = 0
    if told:
        ends = np.tile(np.arange(len(pairs)), 2), np.concatenate([i, j])
        nodes = common + sp.csr_array((np.ones(len(ends[0]), np.int32), ends), shape=common.shape)
        overlap = (nodes := nodes[clique & (count == size - 2)]) @ nodes.T
        shared = int(overlap.data.max(initial=0, where=overlap.data < size))
    keys = np.random.default_rng(0).integers(2**40, size=near.shape[0])
    key = near @ keys + keys  # of equal neighbourhoods equal; and exact, in integers
    _, which, alone = np.unique(key, return_inverse=True, return_counts=True)
    shares = found.max() / len(pairs), (within > 0).mean(), (count > 0).mean(), (within / np.maximum(count, 1)).mean()
    often, fours, threes, around = map(float, shares)
    return CliqueShares(size if told else 0, shared, often, fours, threes, around, float((alone[which] > 1).mean()))


def often(share: float) -> bool:
    """Whether a share is more than chance or boundaries leave."""
    return share >= _OFTEN


def mostly(share: float) -> bool:
    """Whether a share is that of a rule, boundaries being exceptions."""
    return share >= NEARLY_ALL
