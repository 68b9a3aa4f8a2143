"""Directions of rows, spread from the rows of one node, or of many, by solving for translations.

A translation is in equilibrium: with the unknowns of a few nodes held at 1 in one direction and at 0 in the others, all
rows coupled to them take the same values if they are whole. So directions are read off d solutions of a sparse system
around what is known already, the clearest first, and what is known grows. Which rows are whole is known beforehand,
since all their entries add up to zero, whatever their directions; so it is known too when all is right.

Translations are not in equilibrium next to supports, and rows next to edges in which planes of rollers meet hold all
entries of one direction only. All rows together do tell: with the right directions most sums vanish, and what many
zeros make least is the sum of absolute values. Stiffness against a change of volume does not matter for it.
"""

from collections.abc import Iterator
from itertools import permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..linalg import solved
from ..tolerances import CANCELLED, NEARLY_ALL, SMALL
from .constants import adding_up, proven_directions, row_sizes, with_penalty, without_penalties

_SEEDS = (0.5, 0.4, 0.6, 0.3, 0.7, 0.15, 0.85)  # nodes to start from, as parts of the way through a body


def spread_directions(
    matrix: sp.csr_array, group: NDArray[np.int64], d: int, known: NDArray[np.int64]
) -> NDArray[np.int64]:
    """(N,) directions of all rows, with which most of the whole rows annihilate translations.

    Rows of one `group`, (N,), couple to the same unknowns; those of d whole rows are nodes. Directions are spread from
    those `known`, (N,), of which others are -1. Every row is coupled to another one.
    """
    direction = np.zeros(len(group), np.int64)
    inner = matrix.copy()
    inner.eliminate_zeros()
    label = sp.csgraph.connected_components(inner, directed=False)[1]
    for piece in range(int(label.max(initial=-1)) + 1):
        part = np.flatnonzero(label == piece)
        body = _Body(sp.csr_array(inner[part][:, part]), np.unique(group[part], return_inverse=True)[1], d)
        direction[part] = body.directions(known[part])
    return direction


class _Body:
    """One piece: its matrix with the signs of a stiffness, penalties replaced by what makes their rows whole."""

    def __init__(self, matrix: sp.csr_array, group: NDArray[np.int64], d: int) -> None:
        n, own = matrix.shape[0], matrix.diagonal()
        size = row_sizes(matrix)
        penalised = with_penalty(matrix, size)
        off = sp.csr_array(matrix * (np.sign(own.sum()) or 1.0))
        off.setdiag(0)
        off.eliminate_zeros()
        inferred = -np.asarray(off.sum(axis=1)).ravel()
        own = np.where(penalised, np.maximum(inferred, SMALL * size), np.abs(own))
        self._size, self._d = np.where(size > 0, size, np.inf), d
        self._whole = sp.csr_array(off + sp.diags_array(own))
        self._shifted = sp.csr_array(off + sp.diags_array((1 + SMALL) * own))
        self._pattern = sp.csr_array((np.ones(off.nnz, np.int32), off.indices, off.indptr), shape=off.shape)
        adds_up = adding_up(self._whole, self._size)
        self._telling: NDArray[np.bool_] = np.asarray(adds_up & ~penalised)
        order = np.argsort(group, kind="stable")
        nodes = order[np.bincount(group)[group[order]] == d].reshape(-1, d)
        self._nodes = nodes[adds_up[nodes].all(axis=1)]
        alone = np.ones(n, dtype=bool)
        alone[self._nodes] = False
        self._members = [np.flatnonzero(alone)[:, None], self._nodes]
        self._names = [np.arange(d)[:, None], np.array(list(permutations(range(d))))]

    def directions(self, given: NDArray[np.int64]) -> NDArray[np.int64]:
        """(n,) directions with which most rows annihilate translations, and of several those of least sums."""
        best, most, least = np.zeros(len(self._size), np.int64), -1, np.inf
        hope = int(self._telling.sum())
        for start in self._starts(given):
            known, before = start, -1
            while True:
                direction = self._extended(known)
                sums = np.abs(self._whole @ np.eye(self._d)[direction]) / self._size[:, None]
                good = self._telling & (sums <= CANCELLED).all(axis=1)
                count, total = int(good.sum()), float(sums.sum())
                if (count, -total) > (most, -least):
                    best, most, least = direction, count, total
                if count <= before or count == hope or not count:
                    break
                before, known = count, np.where(good, direction, -1)
            if most >= NEARLY_ALL * hope:
                break
        return best

    def _starts(self, given: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
        """Directions to start from: those given, or else those of one node each, in the middle of the piece first."""
        if (given >= 0).any():
            yield given
        if (given >= 0).any() or not len(self._nodes):
            return
        breadth_first = sp.csgraph.breadth_first_order
        order = breadth_first(self._pattern, 0, directed=False, return_predecessors=False)
        order = breadth_first(self._pattern, order[-1], directed=False, return_predecessors=False)
        nodes = self._nodes[np.argsort(np.argsort(order)[self._nodes[:, 0]])]
        for part in _SEEDS:
            known = np.full(len(given), -1)
            known[nodes[int(part * (len(nodes) - 1))]] = np.arange(self._d)
            yield known

    def _extended(self, known: NDArray[np.int64]) -> NDArray[np.int64]:
        """Fill in directions of -1, those coupled to what is known first."""
        direction = known.copy()
        while (direction < 0).any():
            near = (direction < 0) & (self._pattern @ (direction >= 0).astype(np.int32) > 0)
            if not near.any():  # nothing is coupled to what is left
                return direction
            best, margin = self._guessed(np.flatnonzero(near), direction)
            count = min(max(int((direction >= 0).sum()) // 2, self._d), int(near.sum()))  # half as many as are known
            least = np.partition(margin[near], -count)[-count]
            direction = np.where(near & (margin >= least), best, direction)
        return direction

    def _guessed(
        self, rows: NDArray[np.int64], direction: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Likeliest directions of all rows, and by how much they beat the next, if the others are as they are."""
        held = np.flatnonzero(direction >= 0)
        field = np.eye(self._d)[direction] * (direction >= 0)[:, None]
        around = self._shifted[rows]
        field[rows] = solved(sp.csr_array(around[:, rows]), -(around[:, held] @ field[held]))
        best, margin = direction.copy(), np.full(len(direction), -np.inf)
        for members, names in zip(self._members, self._names, strict=True):
            fit = field[members[:, None, :], names[None]].mean(axis=2)
            best[members] = names[np.argmax(fit, axis=1)]
            two = np.partition(fit, -2, axis=1)[:, -2:]
            margin[members] = (two[:, 1] - two[:, 0])[:, None]
        return best, margin


def with_least_sums(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.int64]:
    """Choose the directions that no sum proves such that all sums together become less, until none changes.

    They are changed one by one, from those given, and from those with which translations are in equilibrium where the
    others are proven. Rows of one `group` couple to the same unknowns.
    """
    told, size = without_penalties(matrix), row_sizes(matrix)
    scaled = sp.csr_array(sp.diags_array(1 / np.where(size > 0, size, np.inf)) @ told)

    def total(one: NDArray[np.int64]) -> float:
        return float(np.abs(scaled @ np.eye(d)[one]).sum())

    while True:
        unnamed = ~proven_directions(matrix, direction, group, d)
        if not unnamed.any() or unnamed.all():  # if all rows had one direction, sums would be least
            return direction
        other = spread_directions(matrix, group, d, np.where(unnamed, -1, direction))
        other = min((_one_by_one(scaled, one, np.flatnonzero(unnamed), d) for one in (direction, other)), key=total)
        if total(other) >= (1 - CANCELLED) * total(direction):
            return direction
        direction = other


def _one_by_one(
    scaled: sp.csr_array, direction: NDArray[np.int64], rows: NDArray[np.int64], d: int
) -> NDArray[np.int64]:
    """Directions of which those of some rows were changed one by one as long as absolute sums became less."""
    columns, sums = sp.csc_array(scaled), scaled @ np.eye(d)[direction]
    for _ in range(REFINEMENTS):
        before, direction = direction, direction.copy()
        for row in rows.tolist():
            here = slice(columns.indptr[row], columns.indptr[row + 1])
            near, entry = columns.indices[here], columns.data[here]
            sums[near, direction[row]] -= entry
            more = np.abs(sums[near] + entry[:, None]).sum(axis=0) - np.abs(sums[near]).sum(axis=0)
            more[direction[row]] -= CANCELLED  # what changes nothing stays as it is
            direction[row] = more.argmin()
            sums[near, direction[row]] += entry
        if np.array_equal(before, direction):
            break
    return direction
