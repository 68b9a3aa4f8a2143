"""What hangs on one vertex by right-angled cells only, and whether it can stand in another order.

Let h be a vertex with right-angled cells whose far sides have vanished from one boundary loop. The closed curve from
h through that loop and back, across two such cells, cuts the graph at h: between consecutive ones of them lie *parts*
that meet in h only. Two neighbours h-x and h-y of a right angle get 1/2 cot = l_y / 2 l_x and l_x / 2 l_y from it, in
units of c: numbers with the product 1/4, which do not depend on the size of either part. So each part is known by
what its outer edges get, and another order, or mirror image, of the parts is another mesh exactly if the numbers that
then meet have the product 1/4. A part that is one edge with all that hangs on its far end, a *leaf*, may share what
it gets between its sides at will; only the sum is fixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby, permutations, product

import numpy as np
from numpy.typing import NDArray

from .corners import Alternative, Corners, cell

_MOST_PARTS = 5
_STRAIGHT = 1e-6  # radians by which angles around a vertex may differ from a full turn, without noise

Order = tuple["Part", ...]


@dataclass(frozen=True)
class Part:
    """Edges at the hub between two right angles, counter-clockwise from `right` to `left`.

    Attributes
    ----------
    right, left : int
        The neighbours at its ends; equal in a leaf.
    gets_right, gets_left : float
        What its outer edges get from right angles, in units of c; 0 where there is none.
    angle : float
        Between the two.
    """

    right: int
    left: int
    gets_right: float
    gets_left: float
    angle: float

    @property
    def is_leaf(self) -> bool:
        """Whether it is a single edge at the hub."""
        return self.right == self.left

    def mirrored(self) -> Part:
        """The same, turned over."""
        return Part(self.left, self.right, self.gets_left, self.gets_right, self.angle)


@dataclass(frozen=True)
class Hub:
    """A vertex and the parts that right angles in one loop separate.

    Attributes
    ----------
    row : int
    parts : tuple of Part
        Counter-clockwise.
    closed : bool
        Whether a right angle also lies between the last and the first.
    error : float
        Radians by which angles around the vertex may differ from a full turn.
    """

    row: int
    parts: Order
    closed: bool
    error: float

    def orders(self) -> Iterator[tuple[Order, bool]]:
        """Other orders of the parts that make other cells, each once: parts, and whether they close a ring."""
        seen = {_pairs(self.parts, self.closed)}
        turns = [(part,) if part.is_leaf else (part, part.mirrored()) for part in self.parts]
        sectors = sum(part.angle for part in self.parts)
        for closed in (self.closed, not self.closed):
            right_angles = len(self.parts) - (not closed)
            total = sectors + right_angles * np.pi / 2 - 2 * np.pi
            if total > self.error or (closed and (total < -self.error or right_angles < 2)):
                continue
            for choice in product(*turns):
                for parts in permutations(choice):
                    pairs = _pairs(parts, closed)
                    if pairs not in seen:
                        seen.add(pairs)
                        yield parts, closed

    def to(self, parts: Order, closed: bool, *, same_scale: bool) -> Alternative:
        """The difference that another order makes."""
        found, other = _pairs(self.parts, self.closed), _pairs(parts, closed)
        return Alternative(
            (self.row,),
            _ends(self.parts),
            _ends(parts),
            tuple(sorted(cell(self.row, pair) for pair in found - other)),
            tuple(sorted(cell(self.row, pair) for pair in other - found)),
            same_scale,
        )


def hubs(corners: Corners, z: NDArray, agree: float) -> Iterator[Hub]:
    """All vertices with right angles in the same loop, loop by loop."""
    order = np.lexsort((corners.loop, corners.apex))
    for (h, loop), rows in groupby(order.tolist(), key=lambda k: (int(corners.apex[k]), int(corners.loop[k]))):
        hub = _hub(corners, list(rows), h, loop, z, max(_STRAIGHT, agree))
        if 2 <= len(hub.parts) <= _MOST_PARTS:
            yield hub


def closed_at(n: int, around: Iterable[Hub]) -> NDArray[np.int64]:
    """(n,) 1 for vertices that four right angles surround: these add up to a full turn by themselves."""
    closed = np.zeros(n, dtype=np.int64)
    closed[[hub.row for hub in around if hub.closed and len(hub.parts) == 4]] = 1
    return closed


def rearranged(hub: Hub, agree: float) -> Alternative | None:
    """Another order of the parts, as they are, that gives the same entries."""
    for parts, closed in hub.orders():
        if _fits(parts, closed, agree):
            return hub.to(parts, closed, same_scale=True)
    return None


def _hub(corners: Corners, rows: list[int], h: int, loop: int, z: NDArray, error: float) -> Hub:
    after = corners.next_at.get((h, loop))
    before = corners.previous_at.get((h, loop))
    legs = z[corners.first[rows]] - z[h]
    start = legs[0] if after is None else z[after] - z[h]
    turn = np.mod(np.angle(legs / start) + error, 2 * np.pi)
    rows = [rows[k] for k in np.argsort(turn)]
    first, second = corners.first[rows].tolist(), corners.second[rows].tolist()
    length = {x: float(abs(z[x] - z[h])) for x in first + second}
    gets_first = [length[q] / (2 * length[p]) for p, q in zip(first, second, strict=True)]
    gets_second = [length[p] / (2 * length[q]) for p, q in zip(first, second, strict=True)]
    closed = after is None or before is None
    if closed:
        ends = list(zip(second, first[1:] + first[:1], strict=True))
        gets = list(zip(gets_second, gets_first[1:] + gets_first[:1], strict=True))
    else:
        assert after is not None
        assert before is not None
        ends = list(zip([after, *second], [*first, before], strict=True))
        gets = list(zip([0.0, *gets_second], [*gets_first, 0.0], strict=True))
    parts = []
    for (right, left), (gets_right, gets_left) in zip(ends, gets, strict=True):
        angle = 0.0 if right == left else float(np.mod(np.angle((z[left] - z[h]) / (z[right] - z[h])), 2 * np.pi))
        parts.append(Part(right, left, gets_right, gets_left, angle))
    return Hub(h, tuple(parts), closed, error)


def _pairs(parts: Order, closed: bool) -> frozenset[frozenset[int]]:
    """The neighbours of each right angle."""
    following = (*parts[1:], parts[0]) if closed else parts[1:]
    return frozenset(frozenset((one.left, other.right)) for one, other in zip(parts, following, strict=False))


def _ends(parts: Order) -> tuple[int, ...]:
    return tuple(row for part in parts for row in ((part.right,) if part.is_leaf else (part.right, part.left)))


def _fits(parts: Order, closed: bool, agree: float) -> bool:
    if not closed:
        return _walk(parts, 0.0, 0.0, agree)
    rigid = next((k for k, part in enumerate(parts) if not part.is_leaf), None)
    if rigid is None:
        return _ring_of_leaves(parts, agree)
    parts = parts[rigid:] + parts[:rigid]
    incoming = parts[0].gets_right
    return incoming > 0 and _walk(parts, incoming, 1 / (4 * incoming), agree)


def _walk(parts: Order, incoming: float, last: float, agree: float) -> bool:
    """From part to part: what comes in on the right decides what a leaf has left for the other side."""
    for k, part in enumerate(parts):
        if part.is_leaf:
            outgoing = part.gets_right + part.gets_left - incoming
        elif _same(part.gets_right, incoming, agree):
            outgoing = part.gets_left
        else:
            return False
        if k < len(parts) - 1:
            if outgoing <= agree:
                return False
            incoming = 1 / (4 * outgoing)
    return _same(outgoing, last, agree)


def _ring_of_leaves(parts: Order, agree: float) -> bool:
    """Four leaves close a ring if (r_1 + r_3)(r_2 + r_4) = 4, with r the inverse of what each gets."""
    if len(parts) != 4:
        return False
    r = [1 / (part.gets_right + part.gets_left) for part in parts]
    return _same((r[0] + r[2]) * (r[1] + r[3]), 4.0, agree)


def _same(one: float, other: float, agree: float) -> bool:
    return abs(one - other) <= agree * max(abs(one), abs(other), 1.0)
