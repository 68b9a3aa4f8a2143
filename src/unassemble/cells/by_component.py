"""The connected components of a graph with the pieces that lie in each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..topology import Numbering, Piece, components
from ..topology.keys import Grouped


def with_pieces(n: int, edges: NDArray[np.int64], pieces: Sequence[Piece]) -> list[tuple[Numbering, list[Piece]]]:
    """Each component, the largest first, and its pieces in their order; in linear time.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    pieces : sequence of Piece
        None of which belongs to two components.
    """
    parts = components(n, edges)
    label = np.full(n, -1)
    for k, part in enumerate(parts):
        label[part.vertices] = k
    own = Grouped(label[np.array([piece.vertices[0] for piece in pieces], dtype=np.int64)], len(parts))
    bounds, order = own.start.tolist(), own.order.tolist()
    return [(part, [pieces[j] for j in order[bounds[k] : bounds[k + 1]]]) for k, part in enumerate(parts)]
