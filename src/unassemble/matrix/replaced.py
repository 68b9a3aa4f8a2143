"""Rows that a boundary condition has replaced by those of the identity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..tolerances import SUMMED
from ..words import count_of
from .symmetry import Triangles


def from_columns(diagonal: NDArray, pairs: Triangles) -> tuple[Triangles, NDArray[np.bool_] | None, tuple[str, ...]]:
    """Entries of rows without any off the diagonal, which is not zero, taken from their columns where these were kept.

    Returns `replaced` (n,): such rows; None where there are none with a column.
    """
    row, column = np.zeros(len(diagonal)), np.zeros(len(diagonal))
    for end, own, other in ((0, pairs.upper, pairs.lower), (1, pairs.lower, pairs.upper)):
        np.maximum.at(row, pairs.edges[:, end], np.abs(own))
        np.maximum.at(column, pairs.edges[:, end], np.abs(other))
    replaced = (row == 0) & (column > 0) & (diagonal != 0)
    if not replaced.any():
        return pairs, None, ()
    first, second = replaced[pairs.edges].T
    rest = ~(first | second)
    size = np.maximum(row, column).max()
    if not pairs.upper[rest].any() or (np.abs(pairs.upper - pairs.lower)[rest] > SUMMED * size).any():
        return pairs, None, ()  # not symmetric for other reasons
    upper, lower = np.where(first, pairs.lower, pairs.upper), np.where(second, pairs.upper, pairs.lower)
    warning = (
        f"{count_of(int(replaced.sum()), 'row has', 'rows have')} nothing off the diagonal while the columns have, as "
        "where a boundary condition was put in: entries were taken from the columns"
    )
    return replace(pairs, upper=upper, lower=lower, one_sided=0), replaced, (warning,)
