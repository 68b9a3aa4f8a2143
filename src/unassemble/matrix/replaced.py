"""Rows that a boundary condition has replaced by those of the identity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..words import count_of
from .symmetry import Triangles


def from_columns(diagonal: NDArray, pairs: Triangles) -> tuple[Triangles, NDArray[np.bool_] | None, tuple[str, ...]]:
    """Entries of rows without any off the diagonal, taken from their columns where these were kept.

    Returns
    -------
    pairs : Triangles
    replaced : (n,) bool or None
        Such rows; None where there are none with a column.
    warnings : tuple of str
    """
    n = len(diagonal)
    row, column = np.zeros(n), np.zeros(n)
    for end, own, other in ((0, pairs.upper, pairs.lower), (1, pairs.lower, pairs.upper)):
        np.maximum.at(row, pairs.edges[:, end], np.abs(own))
        np.maximum.at(column, pairs.edges[:, end], np.abs(other))
    replaced = (row == 0) & (column > 0) & (diagonal != 0)
    first, second = replaced[pairs.edges].T
    one_sided = ((pairs.upper == 0) != (pairs.lower == 0)) & ~first & ~second
    if not replaced.any() or one_sided.any():  # of a triangle stored by itself the last row has nothing else either
        return pairs, None, ()
    upper, lower = np.where(first, pairs.lower, pairs.upper), np.where(second, pairs.upper, pairs.lower)
    warning = (
        f"{count_of(int(replaced.sum()), 'row has', 'rows have')} nothing off the diagonal while the columns have, as "
        "where a boundary condition was put in: entries were taken from the columns"
    )
    return replace(pairs, upper=upper, lower=lower, one_sided=0), replaced, (warning,)
