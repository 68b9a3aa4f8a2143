"""The two usual orders of unknowns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ORDERS = ("interleaved", "by component")


class Reading(NamedTuple):
    """Nodes and directions of rows, and what is not sure about them, where that is known; (N,) each."""

    node: NDArray[np.int64]
    direction: NDArray[np.int64]
    open_row: NDArray[np.bool_] | None = None
    unnamed: NDArray[np.bool_] | None = None


def regular(order: int, b: int, kind: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Node and direction of each row of a matrix whose nodes have all their b unknowns, in one of the two orders."""
    row = np.arange(order)
    return (row // b, row % b) if kind == "interleaved" else (row % (order // b), row // (order // b))
