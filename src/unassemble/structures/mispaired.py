"""Nodes whose rows were not joined rightly, which their couplings show."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.constants import row_sizes
from ..nodes.nodal import determined
from ..tolerances import CANCELLED
from .layouts import PLANE
from .members import balanced
from .nodes import Nodes


def mispaired(
    nodes: Nodes, points: NDArray[np.float64], inner: NDArray[np.bool_], allowed: float
) -> tuple[int, int] | None:
    """Two nodes that are not coupled as elements couple them, if there are any.

    The equations for coordinates add up the columns of each direction, and so hardly tell which row of one direction
    and which of another are one node's. The couplings do: elements join whole nodes, so that two nodes meet in several
    directions or in none. In space each coordinate acts on two directions, which contradict each other where their rows
    are not one node's; the coordinates of a plate act on one direction. Those of a plane frame have a direction each,
    so that all depends on the pairing: its nodes have to be joined by members, and no two of them to have the same
    neighbours. What was condensed joins the nodes next to it otherwise; these need a member to another node. `inner`
    (n,) are nodes whose forces are touched neither by supports nor by what was condensed.
    """
    n, b = nodes.n, nodes.layout.block_size
    coo, size = nodes.matrix.tocoo(), np.minimum(np.abs(nodes.matrix.diagonal()), row_sizes(nodes.matrix))
    real = np.abs(coo.data) > CANCELLED * np.sqrt(size[coo.row] * size[coo.col])  # penalties are no measure
    (i, one), (j, other) = np.divmod(coo.row[real], b), np.divmod(coo.col[real], b)
    near, meeting = _counts(i, j, n), _counts(i[one == other], j[one == other], n)
    first, second = sp.triu(near, 1).nonzero()
    shared = (nodes.present[first] & nodes.present[second]).sum(axis=1)
    known = determined(points)
    strange = np.asarray(meeting[first, second]).ravel() < np.minimum(shared, 2)
    if not nodes.layout.rotations:  # bars along an axis have one direction
        strange &= ~balanced(nodes, points, first, second, allowed)[0]
    if nodes.layout == PLANE:
        pattern = (near > 0).astype(np.int32)
        degree, common = np.diff(near.indptr), np.asarray((pattern @ pattern)[first, second]).ravel()
        twins = (common == degree[first]) & (common == degree[second])
        balances, whole = balanced(nodes, points, first, second, allowed)
        joined = np.zeros(n, dtype=bool)
        joined[first[whole & balances]] = joined[second[whole & balances]] = True
        excused = ~inner[first] & ~inner[second] & joined[first] & joined[second]
        strange |= twins | (whole & ~balances & ~excused)
    strange &= known[first] | known[second]
    k = int(np.argmax(strange)) if strange.any() else None
    return None if k is None else (int(first[k]), int(second[k]))


def _counts(i: NDArray, j: NDArray, n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(n, n))
