"""Patches of triangles with holes all around, told by a coincidence of their numbers, where c is known.

A side of a patch borders no other cell: all of its weight is one cotangent. Where the triangles of a patch hang
together as a tree, two such sides of a leaf give its third cotangent, (1 - ab) / (a + b), what that leaves of the
weight of this side belongs to the next triangle, and so on until two parts of the patch meet, at any of its edges.
There both must have the same weight between them: one equation more than unknowns. So what may lie behind each side of
each triangle is listed, small trees first, and where two lists agree to the last digits there is a patch.
"""

import numpy as np
from numpy.typing import NDArray

from ...tolerances import AGREED, LAST_DIGITS, SIGMAS
from ...topology.keys import Grouped, runs

_MOST = 100  # trees behind one side that are listed anew: depth three where nothing is known, more where much is
_LEVELS = 12  # of triangles in a tree; lists end long before, but where long rows of triangles lie between holes


def arcs_across(sides: NDArray[np.int64]) -> NDArray[np.int64]:
    """(3 m,) for each side 3 t + k of each triangle t the same edge as a side of another triangle, or -1.

    `sides` (m, 3): edges of each triangle; each edge in one or two of them.
    """
    order = np.argsort(sides, axis=None, kind="stable")
    pair = np.flatnonzero(np.diff(sides.ravel()[order]) == 0)
    one, other = order[pair], order[pair + 1]
    across = np.full(sides.size, -1)
    across[one], across[other] = other, one
    return across


def patches(
    sides: NDArray[np.int64], cotangents: NDArray[np.float64], size: NDArray[np.float64], state: NDArray[np.int8]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles of patches, and the holes around them; patches that contradict each other are left out.

    `sides` (m, 3): edges of each triangle that may be a cell; each edge in one or two of them; `cotangents` (e,): sums
    of the cotangents of the angles of these triangles that face each edge; `size` (e,): of the numbers that these have
    been computed from; `state` (m,): 1 for a known cell, -1 for a known hole, else 0.
    """
    trees = _Trees(sides, cotangents, LAST_DIGITS * size, state)
    for _ in range(_LEVELS):
        if not trees.grow():
            break
    found = trees.closed()
    cell, hole = (np.zeros(len(sides), dtype=bool) for _ in range(2))
    for cells, holes in found:
        cell[cells] = hole[holes] = True
    disputed = cell & hole
    for cells, holes in found:
        if disputed[cells].any() or disputed[holes].any():
            cell[cells] = hole[holes] = False
    return np.flatnonzero(cell), np.flatnonzero(hole)


class _Trees:
    """For each arc, a side of a triangle seen from inside, the trees of cells that may end with it.

    A tree is that triangle with one tree, or a bare side, beyond each of its two other sides; it has the number of its
    row here.
    """

    def __init__(self, sides: NDArray, cotangents: NDArray, error: NDArray, state: NDArray):
        self._across = arcs_across(sides)
        self._weight, self._inexact = cotangents[sides.ravel()], error[sides.ravel()]
        self._hole = np.repeat(state < 0, 3)
        self._next_to = np.where(self._across < 0, -1, self._across // 3).tolist()
        inside = self._across >= 0
        self._may_be_bare = ~inside | np.repeat(state <= 0, 3)[self._across]
        self._arc = np.empty(0, np.int64)
        self._cotangent, self._error = np.empty(0), np.empty(0)  # at the arc
        self._beyond = np.empty((0, 2), np.int64)  # trees, or -1 for bare sides
        self._listed = self._arc  # of the arcs in their order

    def grow(self) -> bool:
        """List trees with one more triangle on every way; whether that has changed anything."""
        before = Grouped(self._arc[self._listed], len(self._across))
        arc, option = self._options(before)
        options = Grouped(arc, len(self._across))
        option = option[options.order]
        left, error = self._left(arc[options.order], option)
        arcs = np.arange(len(self._across))
        one, other = arcs - arcs % 3 + (arcs + 1) % 3, arcs - arcs % 3 + (arcs + 2) % 3
        count = np.diff(options.start)
        times = np.where(self._hole, 0, count[one] * count[other])
        full = times > _MOST
        times[full] = 0
        arc, place = runs(times)
        i = options.start[one[arc]] + place // count[other[arc]]
        j = options.start[other[arc]] + place % count[other[arc]]
        a, b = left[i], left[j]
        with np.errstate(all="ignore"):
            cotangent = (1 - a * b) / (a + b)
            spread = ((1 + b * b) * error[i] + (1 + a * a) * error[j]) / (a + b) ** 2 + LAST_DIGITS * np.abs(cotangent)
        possible = (a + b > 0) & (spread < AGREED * (1 + np.abs(cotangent)))
        kept = self._listed[full[self._arc[self._listed]]]
        new = len(self._arc) + np.arange(np.count_nonzero(possible))
        self._arc = np.append(self._arc, arc[possible])
        self._cotangent = np.append(self._cotangent, cotangent[possible])
        self._error = np.append(self._error, spread[possible])
        self._beyond = np.concatenate([self._beyond, np.column_stack([option[i], option[j]])[possible]])
        self._listed = np.append(kept, new)
        return len(self._listed) > len(before.order)

    def _options(self, listed: Grouped) -> tuple[NDArray, NDArray]:
        """What may lie beyond each arc: rows of arcs and trees, -1 for a bare side."""
        bare = np.flatnonzero(self._may_be_bare)
        tree = self._listed[listed.order]
        beyond = self._across[self._arc[tree]]
        inside = beyond >= 0
        return np.append(bare, beyond[inside]), np.append(np.full(len(bare), -1), tree[inside])

    def _left(self, arc: NDArray, option: NDArray) -> tuple[NDArray, NDArray]:
        """What is left of the weights of arcs with a tree or nothing beyond them, and its error."""
        taken = np.where(option >= 0, np.append(self._cotangent, 0.0)[option], 0.0)
        error = np.where(option >= 0, np.append(self._error, 0.0)[option], 0.0)
        return self._weight[arc] - taken, error + self._inexact[arc]

    def closed(self) -> list[tuple[list[int], list[int]]]:
        """The triangles of each patch that some trees make, and the holes around it; each once."""
        arc, option = self._options(Grouped(self._arc[self._listed], len(self._across)))
        left, error = self._left(arc, option)
        # Trees on one side, what the other leaves for them on the other: sorted by edge and number.
        tree = np.concatenate([self._listed, option])
        own = np.concatenate([self._arc[self._listed], arc])
        number = np.concatenate([self._cotangent[self._listed], left])
        error = np.concatenate([self._error[self._listed], error])
        first = np.arange(len(tree)) < len(self._listed)
        order = np.lexsort((number, own))
        a, b = order[:-1], order[1:]
        agree = (own[a] == own[b]) & (first[a] != first[b])
        agree &= np.abs(number[a] - number[b]) <= SIGMAS * (error[a] + error[b])
        pairs = np.where(first[a], [a, b], [b, a]).T[agree]
        found = {}
        for pair in tree[pairs].tolist():
            cells = [cell for root in pair if root >= 0 for cell in self._cells(root)]
            key = frozenset(cells)
            if key not in found and len(key) == len(cells):
                found[key] = self._around(cells)
        return [(sorted(cells), holes) for cells, holes in found.items() if holes is not None]

    def _cells(self, tree: int) -> list[int]:
        """Its triangles."""
        cells, waiting = [], [tree]
        while waiting:
            tree = waiting.pop()
            cells.append(int(self._arc[tree]) // 3)
            waiting += [beyond for beyond in self._beyond[tree].tolist() if beyond >= 0]
        return cells

    def _around(self, cells: list[int]) -> list[int] | None:
        """The triangles next to a patch; None if it closes to a ring, so that a side supposed bare is none."""
        next_to = [self._next_to[arc] for cell in cells for arc in range(3 * cell, 3 * cell + 3)]
        inside = set(cells)
        if sum(triangle in inside for triangle in next_to) > 2 * (len(cells) - 1):
            return None
        return list(set(next_to) - inside - {-1})
