"""A graph read with its vertices in other orders.

What a search comes to depends on little things, such as which of two vertices has the lower number: where it ends not
far from the mesh, it may get there from elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..topology import Numbering
from .candidates.cell_set import CellSet
from .reading import Reading

_ORDERS = 5

Read = Callable[[int, NDArray, NDArray, float | None, NDArray | None], Reading | None]


def read_in_other_orders(
    read: Read, n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None
) -> Reading[CellSet] | None:
    """The first reading in a few other orders that fits; None if there is none.

    Parameters
    ----------
    read : callable
        As :func:`unassemble.cells.search.read_cells`, with these parameters.
    n, edges, weights, scale, errors
        Of the graph.
    """
    rng = np.random.default_rng(0)
    same = Numbering(np.arange(n), np.arange(len(edges)), edges)
    for _ in range(_ORDERS):
        other = same.shuffled(rng)
        rows = other.edge_rows
        found = read(n, other.edges, weights[rows], scale, None if errors is None else errors[rows])
        if found is not None and found.fits:
            cells = found.candidates.cells.chosen(found.labels, other.vertices)
            every = CellSet(n, edges, weights, scale, cells, found.candidates.corner[found.labels], errors=errors)
            return Reading.of(every, np.ones(cells.count, dtype=bool))
    return None
