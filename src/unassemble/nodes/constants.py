"""Constants, the first evidence of directions: in rows that lack nothing, entries of each direction add up to zero."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CANCELLED, PENALTY
from .grouping import by_direction, pattern_of


def row_sizes(matrix: sp.csr_array) -> NDArray[np.float64]:
    """(N,) sums of absolute entries off the diagonal, where there may be a penalty; zero for rows of the identity."""
    entry = matrix.tocoo()
    off = np.where(entry.row == entry.col, 0.0, np.abs(entry.data))
    return np.asarray(np.bincount(entry.row, off, matrix.shape[0]), dtype=np.float64)


def with_penalty(matrix: sp.csr_array, size: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) rows of given sizes with a penalty on the diagonal."""
    return np.asarray(np.abs(matrix.diagonal()) > PENALTY * size)


def without_penalties(matrix: sp.csr_array) -> sp.csr_array:
    """The same with diagonal entries that have a penalty replaced by what makes their rows add up to zero.

    That is what assembly put there if the row is whole. Beside a penalty its other entries would tell nothing.
    """
    own, penalised = matrix.diagonal(), with_penalty(matrix, row_sizes(matrix))
    if not penalised.any():
        return matrix
    whole = matrix.copy()
    whole.setdiag(0)
    whole.setdiag(np.where(penalised, -np.asarray(whole.sum(axis=1)).ravel(), own))
    return whole


def adding_up(matrix: sp.csr_array, size: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) rows of given sizes that add up to zero over all directions together."""
    return np.asarray(np.abs(np.asarray(matrix.sum(axis=1)).ravel()) <= CANCELLED * size)


def annihilated_share(matrix: sp.csr_array, direction: NDArray, d: int, *, searched: bool = False) -> float:
    """Share of pairs (row, direction) that annihilate constants.

    Only rows count that annihilate their own direction and another one to which they do couple: sums of nothing are
    no evidence. Where no row couples to another direction, as in vector Laplacians, none needs to, unless the
    directions are the result of a search, which would find any halves of any mesh.
    """
    size = row_sizes(matrix)
    live = size > 0
    if not live.any():
        return 0.0
    ones, size = np.eye(d)[direction] * live[:, None], size[live]
    zero = np.abs(matrix @ ones)[live] <= CANCELLED * size[:, None]
    own = zero[np.arange(len(size)), direction[live]]
    other = np.arange(d) != direction[live][:, None]
    coupled = other & ((abs(matrix) @ ones)[live] > CANCELLED * size[:, None])
    if searched or coupled.any():
        own &= (zero & coupled).any(axis=1)
    return float((zero & own[:, None]).mean())


def proven_directions(
    matrix: sp.csr_array, direction: NDArray[np.int64], group: NDArray[np.int64], d: int
) -> NDArray[np.bool_]:
    """(N,) rows whose direction sums that vanish prove: that of their own entries, or those of all other directions.

    Sums over one direction count in rows whose whole group makes them vanish, rows that couple to the same unknowns, if
    it has rows of all directions: around a node in which the mesh is its own mirror image, entries between two
    directions add up to zero whatever is missing. In such sums a row of that direction cannot be missed, and one of
    another direction would not be borne. Where planes with one direction taken out meet, no sum of two directions
    vanishes; that of the third does not tell which of the two a row is.
    """
    own = np.eye(d, dtype=bool)[direction]
    size = row_sizes(matrix)
    least = CANCELLED * np.where(size > 0, size, np.inf)
    excused = own & with_penalty(matrix, size)[:, None]
    failing = np.zeros((int(group.max()) + 1, d))
    np.add.at(failing, group, (np.abs(matrix @ own.astype(float)) > least[:, None]) & ~excused)
    entry = matrix.tocoo()
    strong = np.abs(entry.data) > least[entry.row]
    pattern = sp.csr_array((strong.astype(float), (entry.row, entry.col)), shape=matrix.shape)
    telling = (failing == 0) & (by_direction(group, direction, d) > 0).all(axis=1, keepdims=True)
    vanishing = telling[group] & ~excused & (pattern @ own.astype(float) > 0)
    seen = pattern.T @ vanishing.astype(float) > 0
    return np.asarray((seen & own).any(axis=1) | (seen | own).all(axis=1))


def unaccounted(
    matrix: sp.csr_array, node: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.bool_]:
    """(n, d) directions that nodes lack although all rows coupled to them annihilate constants of that direction.

    Rows of the identity do not count, and a penalty is no trace.
    """
    order, off = len(node), row_sizes(matrix)
    live = off[:, None] > 0
    labels = np.eye(d)[direction] * live
    size = np.asarray(abs(matrix).sum(axis=1)).ravel()
    missing = (np.abs(matrix @ labels) > CANCELLED * size[:, None]) & live
    missing[np.arange(order), direction] &= ~with_penalty(matrix, off)
    onto = sp.csr_array((np.ones(order, np.int32), (node, np.arange(order))))
    missed = onto @ (pattern_of(matrix) @ missing.astype(np.float32))
    present = (onto @ labels) > 0
    return np.asarray(~present & (missed == 0) & present.any(axis=1)[:, None])
