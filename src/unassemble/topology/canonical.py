"""A numbering of a small weighted graph that does not depend on the one it comes in.

Vertices are told apart by colour refinement: those of one colour see the same weights towards the same colours. Where
that leaves several of a colour, one of them is told apart and refinement goes on. Of the first such choice all are
tried, and the numbering with the least edge list is taken; later ones are nearly always the same but for a symmetry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .colours import Colours, apart, kinds_of
from .numbering import Numbering, local_numbering

LARGEST = 1000
"""Vertices above which the breadth-first numbering must do."""
_MOST_TRIED = 60


def settled_numbering(n: int, edges: NDArray, weights: NDArray) -> Numbering:
    """The same for the same weighted graph, in whatever order its vertices come; breadth-first on large graphs.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    weights : (e,) float64
        What is equal but for rounding counts as equal. Neither size nor sign of all together matters.
    """
    if n > LARGEST:
        return local_numbering(n, edges)
    kinds = kinds_of(weights)
    colours = Colours(n, edges, kinds)
    first = colours.refined(colours.of_twins())
    several = np.flatnonzero(np.bincount(first) > 1)
    if not len(several):
        return _numbering(edges, first)
    chosen = np.flatnonzero(first == several[0])[:_MOST_TRIED]
    numberings = [_numbering(edges, colours.discrete(apart(first, vertex))) for vertex in chosen.tolist()]
    return min(numberings, key=lambda found: (found.edges.tolist(), kinds[found.edge_rows].tolist()))


def _numbering(edges: NDArray, number: NDArray) -> Numbering:
    ends = np.sort(number[edges], axis=1)
    rows = np.lexsort(ends.T[::-1])
    return Numbering(np.argsort(number), rows, ends[rows])
