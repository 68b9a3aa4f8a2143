"""The face that bounds each block of an embedding from outside, which is never a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex


def outer_faces(blocks: FaceComplex, sums: NDArray) -> NDArray[np.bool_]:
    """One face of each block: its longest, among equals that of the largest angle sum.

    Parameters
    ----------
    blocks : FaceComplex
    sums : (faces,) float64
        Of angles.
    """
    block = blocks.block[blocks.order[blocks.offsets[:-1]]]
    order = np.lexsort((sums, blocks.size, block))
    last = order[np.append(np.flatnonzero(np.diff(block[order])), len(order) - 1)]
    longest = np.zeros(len(sums), dtype=bool)
    longest[last] = True
    return longest
