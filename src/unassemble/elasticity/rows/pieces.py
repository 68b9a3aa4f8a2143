"""Which rows may be one node's, as far as the order of nodes goes: that is the same in every direction.

Rows of nodes already known divide the rows of two directions into pieces, one after the other in both; rows of
different pieces cannot belong together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def pieces(node: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N, d) for each row and another direction, how many nodes that have both come before the row.

    Rows r and s of directions c and b can only be one node's if ``piece[r, b] == piece[s, c]``.

    Parameters
    ----------
    node, direction : (N,) int64
        Rows of each direction stand in the order of nodes.
    d : int
    """
    n = int(node.max(initial=-1)) + 1
    has = np.zeros((n, d), dtype=bool)
    has[node, direction] = True
    piece = np.zeros((len(node), d), dtype=np.int64)
    for c in range(d):
        rows = np.flatnonzero(direction == c)
        both = has[node[rows]]
        piece[rows] = np.cumsum(both, axis=0) - both
    return piece
