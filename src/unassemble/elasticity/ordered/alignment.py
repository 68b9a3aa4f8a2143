"""Two lists of rows put side by side, in order: which of one goes with which of the other, and whether that is sure.

A pair weighs the more the more alike its rows are, and the heaviest set of pairs that do not cross is wanted, as in
the alignment of sequences; see Needleman and Wunsch (1970).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_POWER = 4  # rows of one node are alike to 0.9 and more, those of neighbours to 0.6 or so
_LEAST = 0.3  # weight that a pair has to beat to be better than none
_ALMOST = 0.6  # of the likeness to a row's likest; pairs below are no candidates
_CLOSE = 0.05  # weight that another alignment may have less and still count as one


def aligned(r: NDArray[np.int64], s: NDArray[np.int64], likeness: NDArray[np.float64]) -> NDArray[np.int64]:
    """Places of pairs of the heaviest alignment, without those that one nearly as heavy would replace.

    Parameters
    ----------
    r, s : (k,) int64
        Places in two lists, each pair once.
    likeness : (k,) float64
        At most 1.
    """
    if not len(r):
        return np.empty(0, dtype=np.int64)
    best_r, best_s = np.zeros(r.max() + 1), np.zeros(s.max() + 1)
    np.maximum.at(best_r, r, likeness)
    np.maximum.at(best_s, s, likeness)
    weight = likeness**_POWER - _LEAST
    some = np.flatnonzero((weight > 0) & (likeness >= _ALMOST * np.minimum(best_r[r], best_s[s])))
    if not len(some):
        return some
    r, s, weight = r[some], s[some], weight[some]
    through = _heaviest(r, s, weight) + _heaviest(r.max() - r, s.max() - s, weight) - weight
    close = through > through.max() - _CLOSE
    only = (np.bincount(r, close)[r] == 1) & (np.bincount(s, close)[s] == 1)
    return some[close & only]


def _heaviest(r: NDArray[np.int64], s: NDArray[np.int64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) weight of the heaviest chain of pairs, r and s increasing, that ends with each pair.

    Maxima over all smaller s are kept in a binary indexed tree.
    """
    size = int(s.max()) + 1
    most = [0.0] * (size + 1)
    total = np.empty(len(r))
    order = np.lexsort((-s, r))  # of pairs with one r none comes to stand before another
    for place, at, own in zip(order.tolist(), s[order].tolist(), weight[order].tolist(), strict=True):
        before, k = 0.0, at
        while k > 0:
            before = max(before, most[k])
            k &= k - 1
        total[place] = before + own
        k = at + 1
        while k <= size:
            most[k] = max(most[k], before + own)
            k += k & -k
    return total
