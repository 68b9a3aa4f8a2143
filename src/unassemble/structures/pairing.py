"""Whether the rows that a numbering takes for one node belong together, by what each of them couples to.

The equations for coordinates add up the columns of each direction, and so hardly tell which row of one direction and
which of another are one node's. The couplings do: elements join whole nodes, so that two nodes meet in several
directions or in none, and what a member between them transmits balances by itself.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.nodal import determined
from .layouts import PLANE
from .nodes import Nodes

_COUPLED = 1e-9  # of sqrt(A_ii A_jj)
_BALANCED = 1e-8  # of the largest term: what is left where the forces of a member balance


def mispaired(nodes: Nodes, points: NDArray[np.float64]) -> tuple[int, int] | None:
    """Two nodes that are not coupled as elements couple them, if there are any.

    In space each coordinate acts on two directions, which contradict each other where their rows are not one node's;
    the coordinates of a plate act on one direction. Those of a plane frame have a direction each, so that all depends
    on the pairing: its nodes have to be joined by members, and no two of them to have the same neighbours.

    Parameters
    ----------
    nodes : Nodes
    points : (n, dim) float64
        NaN where not determined.
    """
    n, b = nodes.n, nodes.layout.block_size
    coo, diagonal = nodes.matrix.tocoo(), np.abs(nodes.matrix.diagonal())
    real = np.abs(coo.data) > _COUPLED * np.sqrt(diagonal[coo.row] * diagonal[coo.col])
    (i, one), (j, other) = np.divmod(coo.row[real], b), np.divmod(coo.col[real], b)
    near, meeting = _counts(i, j, n), _counts(i[one == other], j[one == other], n)
    first, second = sp.triu(near, 1).nonzero()
    shared = (nodes.present[first] & nodes.present[second]).sum(axis=1)
    strange = np.asarray(meeting[first, second]).ravel() < np.minimum(shared, 2)
    if nodes.layout == PLANE:
        pattern = (near > 0).astype(np.int32)
        degree, common = np.diff(near.indptr), np.asarray((pattern @ pattern)[first, second]).ravel()
        twins = (common == degree[first]) & (common == degree[second])
        strange |= twins | ~_balanced(nodes, points, first, second)
    k = int(np.argmax(strange)) if strange.any() else None
    return None if k is None else (int(first[k]), int(second[k]))


def _counts(i: NDArray, j: NDArray, n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(n, n))


def _balanced(nodes: Nodes, points: NDArray, i: NDArray, j: NDArray) -> NDArray[np.bool_]:
    """Pairs whose block is a member's, whatever its section; those that are not known as a whole count as such.

    Forces at both ends balance for every motion of one of them: with T the motion of node i that goes with one of node
    j, T^T A_ij is minus the member's own block of node j, and symmetric.
    """
    b = nodes.layout.block_size
    every, place = np.arange(b), b * np.column_stack([i, j])
    rows, columns = place[:, 0, None, None] + every[:, None], place[:, 1, None, None] + every
    block = np.asarray(nodes.matrix[np.broadcast_to(rows, (len(i), b, b)).ravel(),
                                    np.broadcast_to(columns, (len(i), b, b)).ravel()]).reshape(-1, b, b)  # fmt: skip
    turn = nodes.layout.rigid_motions(points[i] - points[j]).transpose(0, 2, 1)
    left = turn @ block
    off = np.abs(left - left.transpose(0, 2, 1)).max(axis=(1, 2), initial=0)
    whole = (nodes.present[i] & nodes.present[j]).all(axis=1) & determined(points)[i] & determined(points)[j]
    size = (np.abs(turn) @ np.abs(block)).max(axis=(1, 2), initial=0)
    return np.asarray(~whole | (off <= _BALANCED * size))
