"""Candidates whose labels are turned over together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Move = tuple[int, ...]


def turned(labels: NDArray[np.bool_], move: Move) -> NDArray[np.bool_]:
    """The labels (cells,) after a move."""
    after = labels.copy()
    after[list(move)] ^= True
    return after
