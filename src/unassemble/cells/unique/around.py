"""What may be a cell beside an answer: candidates of its embedding, its own cells, and what right angles allow."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ...topology.faces import joined
from ...topology.numbering import connected
from ..candidates.candidates import Candidates
from ..search.low_rank import Move

Cell = tuple[int, ...]


@dataclass(frozen=True)
class RightAngle:
    """A right angle of a cell, between two edges whose far ends are not joined."""

    apex: int
    ends: tuple[int, int]  # the vertices before and after it
    # the candidate that it belongs to, and the one that is left of it without the apex; -1 if nothing is
    cell: int
    rest: int


@dataclass(frozen=True, eq=False)
class Around:
    """Candidates about an answer."""

    # those of an embedding, the cells of the answer, and these without a vertex at a right angle
    candidates: Candidates
    labels: NDArray[np.bool_]  # (cells,) the answer
    z: NDArray[np.complex128]  # (n,)
    right_angles: list[RightAngle]
    alike: list[tuple[RightAngle, RightAngle]]  # see :func:`_alike`
    agree: float  # relative difference of equal numbers

    @classmethod
    def of(cls, candidates: Candidates, cells: Polygons, z: NDArray[np.complex128], agree: float) -> Around:
        """All of an answer with some cells, counter-clockwise."""
        number = {frozenset(cell): k for k, cell in enumerate(candidates.cells.cycles)}
        new: list[Cell] = []

        def named(cell: Cell) -> int:
            key = frozenset(cell)
            if key not in number:
                number[key] = candidates.count + len(new)
                new.append(cell)
            return number[key]

        cycles = cells.cycles
        own = [named(cell) for cell in cycles]
        apex, after, before = cells.vertices, cells.following, np.empty_like(cells.vertices)
        before[cells.following_place] = apex
        one, other = z[before] - z[apex], z[after] - z[apex]
        right = np.abs((np.conj(one) * other).real) <= agree * np.abs(one) * np.abs(other)
        right &= ~joined(candidates.n_vertices, candidates.edges, before, after)
        owner = np.repeat(np.arange(cells.count), cells.size)[right].tolist()
        right_angles = []
        for k, h, *ends in zip(owner, *(some[right].tolist() for some in (apex, before, after)), strict=True):
            rest = tuple(v for v in cycles[k] if v != h)
            right_angles.append(RightAngle(h, (ends[0], ends[1]), own[k], named(rest) if len(rest) > 2 else -1))
        alike = list(_alike(right_angles, z, agree))
        # Each may be one of the corners that right angles regrouped make.
        for one_, other_ in alike:
            for x, y in (*_crossed(one_, other_), *_turned_over(one_, other_)):
                if x != y:
                    named((x, one_.apex, y))
        more = candidates.with_more(new)
        labels = np.zeros(more.count, dtype=bool)
        labels[own] = True
        return cls(more, labels, z, right_angles, alike, agree)

    @property
    def regrouped(self) -> Iterator[Move]:
        """Two right angles at one vertex regrouped, where what they hold together can lie so."""
        edges = self.candidates.edges
        # Each vertex of a cell, and those before and after it.
        cells = self.candidates.cells.chosen(self.labels, np.arange(len(self.z))).cycles
        wedges = {(cell[k - 1], frozenset((cell[k - 2], cell[k]))) for cell in cells for k in range(len(cell))}
        for one, other in self.alike:
            old = {one.cell, other.cell}
            rest = {one.rest, other.rest} - {-1}
            part = self._parts(old, rest)
            for pairs in (_crossed(one, other), _turned_over(one, other)):
                if any(x == y or joined(len(self.z), edges, np.array([x]), np.array([y]))[0] for x, y in pairs):
                    continue
                new = {self._number[frozenset((x, one.apex, y))] for x, y in pairs}
                taken = new & (old | rest) or any((one.apex, frozenset(pair)) in wedges for pair in pairs)
                if not taken and all(self._may_lie(part, one.apex, *pair) for pair in pairs):
                    yield tuple(sorted(old | rest | new))

    @property
    def turned_over(self) -> Iterator[Move]:
        """Parts between two vertices turned over, which are held at both by two right angles alike.

        Those of one vertex lie in different boundary loops: the part is a band that is one cell wide at its ends.
        """
        loop = self._loops
        ends = []
        for one, other in self.alike:
            sides = [loop.get(frozenset(angle.ends), -1) for angle in (one, other)]
            if one.rest == other.rest == -1 and min(sides) >= 0 and sides[0] != sides[1]:
                ends.append((one, other))
        for (a, b), (d, f) in (both for both in combinations(ends, 2) if both[0][0].apex != both[1][0].apex):
            old = {a.cell, b.cell, d.cell, f.cell}
            part = self._parts(old, set())
            pairs = [(a.apex, *pair) for pair in _turned_over(a, b)] + [(d.apex, *pair) for pair in _turned_over(d, f)]
            if all(part.get(_side(h, x), -1 - x) != part.get(_side(h, y), -1 - y) for h, x, y in pairs):
                new = {self._number[frozenset(corner)] for corner in pairs}
                if not new & old:
                    yield tuple(sorted(old | new))

    @cached_property
    def _loops(self) -> dict[frozenset[int], int]:
        """The boundary loop of each side that one cell has; loops that touch count as one."""
        cells, n = self.candidates.cells.chosen(self.labels, np.arange(len(self.z))), len(self.z)
        key, count = np.unique(
            np.sort(np.column_stack([cells.vertices, cells.following]), axis=1) @ [n, 1], return_counts=True
        )
        ends = np.column_stack(np.divmod(key[count == 1], n))
        label = connected(n, *ends.T)[1]
        return {frozenset(pair): int(label[pair[0]]) for pair in ends.tolist()}

    @cached_property
    def _number(self) -> dict[frozenset[int], int]:
        return {frozenset(cell): k for k, cell in enumerate(self.candidates.cells.cycles)}

    def _parts(self, old: set[int], rest: set[int]) -> dict[tuple[int, int], int]:
        """For each side (tail, head) of a cell the part, connected by edges, that it belongs to without some cells."""
        kept = self.labels.copy()
        kept[list(old)] = False
        kept[list(rest)] = True
        cells, n = self.candidates.cells, len(self.z)
        side = np.sort(np.column_stack([cells.vertices, cells.following]), axis=1) @ [n, 1]
        owner = np.repeat(np.arange(cells.count), cells.size)
        side, owner = side[kept[owner]], owner[kept[owner]]
        key, row = np.unique(side, return_inverse=True)
        label = connected(len(key) + cells.count, row, len(key) + owner)[1]
        return {(k // n, k % n): part for k, part in zip(key.tolist(), label.tolist(), strict=False)}

    def _may_lie(self, part: dict[tuple[int, int], int], h: int, x: int, y: int) -> bool:
        """Whether h-x and h-y can make a right angle: they belong to two parts, or do so where they are."""
        one, other = (part.get(_side(h, v), -1 - v) for v in (x, y))
        if one != other:
            return True
        to_x, to_y = self.z[x] - self.z[h], self.z[y] - self.z[h]
        if abs((to_x.conjugate() * to_y).real) > self.agree * abs(to_x) * abs(to_y):
            return False
        first, last = (to_x, to_y) if (to_x.conjugate() * to_y).imag > 0 else (to_y, to_x)
        edges = self.candidates.edges
        ends = np.concatenate([edges[edges[:, 0] == h, 1], edges[edges[:, 1] == h, 0]])
        turn = np.angle((self.z[np.setdiff1d(ends, [x, y])] - self.z[h]) / first)
        return not ((turn > 0) & (turn < np.angle(last / first))).any()


def _side(one: int, other: int) -> tuple[int, int]:
    return (one, other) if one < other else (other, one)


def _crossed(one: RightAngle, other: RightAngle) -> tuple[tuple[int, int], tuple[int, int]]:
    """Ends of two right angles, each first one with the other's second one."""
    return (one.ends[0], other.ends[1]), (other.ends[0], one.ends[1])


def _turned_over(one: RightAngle, other: RightAngle) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first ones of both together, and the second ones: as if a part had been turned over."""
    return (one.ends[0], other.ends[0]), (one.ends[1], other.ends[1])


def _alike(
    angles: list[RightAngle], z: NDArray[np.complex128], agree: float
) -> Iterator[tuple[RightAngle, RightAngle]]:
    """Right angles at one vertex, of different cells, that give their edges the same two cotangents."""
    at: dict[int, list[RightAngle]] = defaultdict(list)
    for angle in angles:
        at[angle.apex].append(angle)
    for h, here in at.items():
        ratio = [abs(z[angle.ends[0]] - z[h]) / abs(z[angle.ends[1]] - z[h]) for angle in here]
        for i, j in combinations(range(len(here)), 2):
            same = abs(ratio[i] / ratio[j] - 1) <= agree or abs(ratio[i] * ratio[j] - 1) <= agree
            if same and here[i].cell != here[j].cell:
                yield here[i], here[j]
