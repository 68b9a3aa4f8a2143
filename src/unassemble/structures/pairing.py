"""Whether the rows that a numbering takes for one node belong together, by what each of them couples to.

The equations for coordinates add up the columns of each direction, and so hardly tell which row of one direction and
which of another are one node's. The couplings do: elements join whole nodes, so that two nodes meet in several
directions or in none, and the rows of different nodes have different neighbours.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .layouts import PLANE
from .nodes import Nodes

_COUPLED = 1e-9  # of sqrt(A_ii A_jj)
_ALIKE = 1e-9  # how far a member's block of displacements may be from symmetric, relative to its largest entry
_APART = 1e-6  # of the largest coordinate: nodes whose coordinates differ


def mispaired(nodes: Nodes, points: NDArray[np.float64]) -> tuple[int, int] | None:
    """Two nodes that no element joins as they are coupled, or of which nothing tells whose rows are whose.

    Parameters
    ----------
    nodes : Nodes
    points : (n, dim) float64
        NaN where not determined.

    Returns
    -------
    (int, int) or None
        None where the couplings show that rows of one node are one node's, as far as coordinates depend on it. In
        space they depend on two directions each, which would contradict each other; of a plate on one direction; of a
        plane frame, whose rows have a coordinate each, all of it is at stake.
    """
    n, b = nodes.n, nodes.layout.block_size
    coo, diagonal = nodes.matrix.tocoo(), np.abs(nodes.matrix.diagonal())
    real = np.abs(coo.data) > _COUPLED * np.sqrt(diagonal[coo.row] * diagonal[coo.col])
    (i, one), (j, other) = np.divmod(coo.row[real], b), np.divmod(coo.col[real], b)
    near = _counts(i, j, n)
    meeting = _counts(i[one == other], j[one == other], n)
    upper = sp.triu(near, 1).tocoo()
    shared = (nodes.present[upper.row] & nodes.present[upper.col]).sum(axis=1)
    few = np.asarray(meeting[upper.row, upper.col]).ravel() < np.minimum(shared, 2)
    if few.any():
        first = int(np.argmax(few))
        return int(upper.row[first]), int(upper.col[first])
    if nodes.layout != PLANE:
        return None
    for direction in range(len(PLANE.displacements)):
        own = one == direction
        for first, second in _exchangeable(_counts(i[own], j[own], n), near):
            step = np.abs(points[first] - points[second])
            if step[1 - direction] > _APART * np.nanmax(np.abs(points)) and not _member(nodes, near, first, second):
                return int(first), int(second)
    return None


def _counts(i: NDArray, j: NDArray, n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(n, n))


def _exchangeable(reach: sp.csr_array, near: sp.csr_array) -> NDArray[np.int64]:
    """(k, 2) nodes whose rows of a direction reach only neighbours of the other, so that these could change places."""
    number = np.diff(reach.indptr)
    pattern = [
        sp.csr_array((np.ones(part.nnz, np.int32), part.indices, part.indptr), part.shape) for part in (reach, near)
    ]
    within = (pattern[0] @ pattern[1]).tocoo()
    fits = within.data == number[within.row]
    fitting = _counts(within.row[fits], within.col[fits], len(number))
    return np.column_stack(sp.triu(fitting * fitting.T, 1).nonzero())


def _member(nodes: Nodes, near: sp.csr_array, i: int, j: int) -> bool:
    """Whether the displacements of two nodes meet as those at the ends of a member do, each direction with the other.

    Where they have no other neighbours, sums say so of any two rows.
    """
    b = nodes.layout.block_size
    block = nodes.matrix[i * b : i * b + 2, j * b : j * b + 2].toarray()
    across = np.abs(block[0, 1])
    others = len(near[[i, j]].indices) > 4
    return bool(others and across > 0 and np.abs(block[0, 1] - block[1, 0]) <= _ALIKE * across)
