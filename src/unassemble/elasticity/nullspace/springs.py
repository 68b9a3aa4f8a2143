"""Springs, of which no linear field knows: what hangs on them alone has no position."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...nodes.nodal import NodalMatrix, determined, valid_pairs
from ...tolerances import ALIKE


def without_springs(nodal: NodalMatrix) -> NodalMatrix:
    """The matrix without blocks between two nodes that have no neighbour in common, and what they add to diagonals.

    A spring adds a block S to the rows of its two nodes, and takes it off between them. In the identities it stands for
    S (x_i - x_j), which vanishes for nodes in one place and is wrong for all others, since no linear field knows a
    spring. So a node that hangs on springs alone would be drawn onto its neighbours; it has no position. Two nodes of
    an element are coupled to its other nodes, too: a pair with no neighbour in common belongs to none.

    One of the two has whole rows, at least: next to eliminated nodes the neighbours in common may be gone.
    """
    i, j = nodal.node, nodal.indices
    graph = sp.csr_array((np.ones(len(j), dtype=np.int32), j, nodal.indptr), shape=(nodal.n, nodal.n))
    common = sp.csr_array((graph @ graph).multiply(graph))
    common.sort_indices()  # as those of the graph, so that places are the same
    alone = (common.data <= 2) & (i != j) & (nodal.data != 0).any(axis=(1, 2))  # each of the two is its own neighbour
    if not alone.any():
        return nodal
    whole = np.asarray(valid_pairs(nodal).all(axis=(1, 2)))
    alone &= whole[i] | whole[j]
    data = nodal.data.copy()
    np.add.at(data, np.flatnonzero(i == j)[i[alone]], data[alone])
    data[alone] = 0
    held = np.bincount(i, (data != 0).any(axis=(1, 2)) & (i != j), nodal.n) > 0
    return replace(nodal, data=data, size=np.where(held, nodal.size, 0.0))


def drawn_together(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) nodes in the place of one that they are coupled to, without whole rows that couple to nodes elsewhere.

    A web of springs that touches a body in one node is drawn there, whatever its nodes have in common. Bodies in
    contact have nodes upon each other that have rows of elements. Mean edges of the points have length one.
    """
    i, j, present = nodal.node, nodal.indices, nodal.row_of >= 0
    live = (i != j) & (nodal.data != 0).any(axis=(1, 2))
    away = np.abs(points[i] - points[j]).max(axis=1)
    near = live & (away <= ALIKE)
    near &= (present[i] & present[j]).any(axis=1)  # those with no direction in common may be halves of one node
    elsewhere = np.bincount(i, live & (away > ALIKE), nodal.n) > 0
    own = valid.reshape(nodal.n, -1).all(axis=1) & elsewhere
    return np.asarray((np.bincount(i, near, nodal.n) > 0) & ~own & determined(points))
