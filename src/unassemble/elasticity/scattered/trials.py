"""Rows of one pattern that neither order nor places divide among nodes: every way to do so is tried.

Next to edges in which planes of rollers meet a row by itself may say too little to have a place of its own. But there
are few ways to join such rows; each says which directions the nodes lack, and so which planes they lie in. Where the
places around are known, the identities of the rows around hold for one of them only.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodal import NodalMatrix, determined, nodal_matrix
from ..nullspace.identities import identities
from ..nullspace.shape import EXACT
from ..nullspace.solution import Solution
from ..rows.grouping import by_first_row
from ..rows.numbering import Numbering
from .patterns import by_direction
from .row_equations import Sums, equations

_MOST = 60  # ways to divide the rows of a pattern; each costs the identities of some hundred rows
_WRONG = 1e3  # times EXACT: misfit from which a way is refused; wrong ones are off by parts of an edge
_FREE = 1e-9  # of the largest singular value: what is less leaves places free


class _Way(NamedTuple):
    """One way to join parts of nodes, and how it fits.

    Attributes
    ----------
    label : (k,) int64
        Of parts that are joined.
    misfit : float
        Of the identities, in edge lengths.
    known : bool
        Whether all parts have places then.
    """

    label: NDArray[np.int64]
    misfit: float
    known: bool


def joined_by_trial(
    matrix: sp.csr_array,
    sums: Sums,
    solution: Solution,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    piece: NDArray[np.int64],
    open_row: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after open rows were joined in the only way that fits, and rows beyond doubt.

    Parameters
    ----------
    matrix : (N, N) sparse
    sums : Sums
    solution : Solution
        Of nodes as they are; its mean edge length is 1.
    group, node, direction : (N,) int64
        Pattern, node and direction of each row.
    piece : (N, d) int64
        Rows of different pieces of the order are not one node's; see :mod:`..rows.pieces`.
    open_row : (N,) bool
        Rows that may belong to one node with others of their pattern.
    """
    has = by_direction(node, direction, piece.shape[1]) > 0
    label, settled = np.arange(len(has)), np.zeros(len(has), dtype=bool)
    by_node, start = np.argsort(node, kind="stable"), np.concatenate([[0], np.cumsum(np.bincount(node))])
    some = np.flatnonzero(open_row)[np.argsort(group[open_row], kind="stable")]
    for own in np.split(some, np.flatnonzero(np.diff(group[some])) + 1):
        part = np.unique(node[own])
        rows = np.concatenate([by_node[start[k] : start[k + 1]] for k in part])
        placed = solution.component[part] >= 0
        apart = _apart(np.searchsorted(part, node[rows]), direction[rows], piece[rows]) | (placed[:, None] & placed)
        every = _ways(has[part], apart)
        if len(every) > 1:
            patch = _Patch(matrix, sums, solution, group, node, direction, int(rows[0]))
            best = _only(list(patch.tried(part, every)))
            if best is not None:
                label[part] = part[best]
                settled[part] = True
    return by_first_row(label[node]), settled[node]


def _apart(part: NDArray[np.int64], direction: NDArray[np.int64], piece: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k, k) parts with rows that the order keeps apart."""
    of_other = piece[:, direction]
    r, s = np.nonzero(of_other != of_other.T)
    apart = np.zeros((int(part.max()) + 1,) * 2, dtype=bool)
    apart[part[r], part[s]] = True
    return apart


def _ways(has: NDArray[np.bool_], apart: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """All ways to join parts without a common direction: the first part of each one's node, (k,) each.

    None if there are too many.

    Parameters
    ----------
    has : (k, d) bool
        Directions of each part.
    apart : (k, k) bool
        Parts that cannot be one node's.
    """
    found = []
    for first in _extended(has, apart, []):
        found.append(np.array(first))
        if len(found) > _MOST:
            return []
    return found


def _extended(has: NDArray[np.bool_], apart: NDArray[np.bool_], first: list[int]) -> Iterator[list[int]]:
    """Each way to give the next parts to nodes begun, or to new ones."""
    k = len(first)
    if k == len(has):
        yield first
        return
    for begun in sorted(set(first)):
        members = np.flatnonzero(np.array(first) == begun)
        if not (has[members] & has[k]).any() and not apart[k, members].any():
            yield from _extended(has, apart, [*first, begun])
    yield from _extended(has, apart, [*first, k])


class _Patch:
    """The rows around a pattern, with all that is known of them."""

    def __init__(
        self,
        matrix: sp.csr_array,
        sums: Sums,
        solution: Solution,
        group: NDArray[np.int64],
        node: NDArray[np.int64],
        direction: NDArray[np.int64],
        row: int,
    ) -> None:
        near = matrix.indices[matrix.indptr[row] : matrix.indptr[row + 1]]
        rows = np.unique(matrix[near].indices)
        inner = np.isin(rows, near)[:, None]
        self.matrix = sp.csr_array(matrix[rows][:, rows])
        self.own = group[rows] == group[row]
        self.group = by_first_row(group[rows])
        self.node, self.direction = node[rows], direction[rows]
        self.sums = Sums(sums.whole[rows] & inner, sums.gone[rows], sums.surrounded[rows] & inner[:, 0])
        component = solution.component[self.node]
        piece = np.bincount(component[component >= 0]).argmax() if (component >= 0).any() else -1
        self.points = np.where((component == piece)[:, None], solution.points[self.node], np.nan)

    def tried(self, part: NDArray[np.int64], every: list[NDArray[np.int64]]) -> Iterator[_Way]:
        """How each way to join some nodes fits."""
        place = np.searchsorted(part, self.node).clip(max=len(part) - 1)
        here = part[place] == self.node
        for first in every:
            label = np.where(here, part[first][place], self.node)
            misfit, free = self._fit(by_first_row(label))
            yield _Way(first, misfit, not free[here].any())

    def _fit(self, node: NDArray[np.int64]) -> tuple[float, NDArray[np.bool_]]:
        """Misfit of the identities, and which rows have no place."""
        n, d = int(node.max()) + 1, self.sums.whole.shape[1]
        lacks = by_direction(node, self.direction, d) == 0
        sums = self.sums._replace(gone=np.where(self.own[:, None], lacks[node], self.sums.gone))
        identity = np.zeros(len(node), dtype=bool)
        nodal = nodal_matrix(self.matrix, Numbering(d, node, self.direction, identity, "pattern", 1.0, 1.0))
        points = np.full((n, d), np.nan)
        known = determined(self.points)
        points[node[known]] = self.points[known]
        misfit, free = _least(*equations(nodal, sums, self.group, node, self.direction), points)
        return misfit, free[node]


def _least(
    nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]
) -> tuple[float, NDArray[np.bool_]]:
    """Largest misfit of the identities where nodes without coordinates lie as well as they can, and which are free."""
    d = points.shape[1]
    some = identities(nodal, valid, np.arange(nodal.n))
    known = determined(points)[some.columns]
    place = np.flatnonzero(np.repeat(~known, d))
    fields = np.zeros((len(some.columns) * d, len(place) + 1))
    fields[place, np.arange(len(place))] = 1
    fields[:, -1] = np.where(known[:, None], points[some.columns], 0).ravel()
    left = some.residual(fields.reshape(-1, d, len(place) + 1)).reshape(-1, len(place) + 1)
    u, size, vt = np.linalg.svd(left[:, :-1], full_matrices=False)
    kept = size > _FREE * size.max(initial=0)
    misfit = left[:, -1] - u[:, kept] @ (u[:, kept].T @ left[:, -1])
    free = ~determined(points)
    here = 1 - (vt[kept] ** 2).sum(axis=0).reshape(-1, d) <= _FREE
    free[some.columns[~known]] = ~here.all(axis=1)
    return float(np.abs(misfit).max(initial=0)), free


def _only(every: list[_Way]) -> NDArray[np.int64] | None:
    """The way that joins most among those that fit, if all others that fit join less of the same, and some do not."""
    if any(EXACT < way.misfit < _WRONG * EXACT for way in every):
        return None
    fits = [way for way in every if way.misfit <= EXACT]
    if not fits or len(fits) == len(every):
        return None
    best = min(fits, key=lambda way: len(np.unique(way.label)))
    finer = all((best.label[way.label] == best.label).all() for way in fits)
    return best.label if best.known and finer else None
