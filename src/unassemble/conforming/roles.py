"""From sets of rows to cells in order: which rows are corners, which lie on which side.

Cells that share a side share its order + 1 rows, and only corners belong to more than two cells. Where rows belong to
the same cells the corner is the one of the smallest diagonal entry of L: on a straight triangle that of a node in the
middle of a side is at least twice that of a corner. What the graph then leaves, entries decide (:mod:`.affine`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.kinds import KINDS, Kind
from ..errors import TopologyError
from ..matrix import OperatorMatrix
from ..tolerances import ROUNDED
from ..topology.keys import found, pair_keys
from .affine import ElementEntries
from .sets import NodeSets, pairs_of

_KINDS = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9", 10: "triangle10"}
_RINGS = {3: ((0, 1, 2),), 4: ((0, 1, 2, 3), (0, 1, 3, 2), (0, 2, 1, 3))}
_MOST = 6  # rows of a cell whose sides only entries tell


@dataclass(frozen=True, eq=False)
class OrderedCells:
    """Cells in meshio's order, in either orientation."""

    blocks: dict[Kind, NDArray[np.int64]]
    told: bool  # whether the graph alone tells them, and no entries
    order: NDArray[np.int64]  # (n,) all rows, those near each other on the mesh near each other, too
    even: bool = False  # whether those that come next are as likely


@dataclass(frozen=True, eq=False)
class _Sides:
    """Sides between two cells: keys of their corners, increasing, and the rows between these, (s, order - 1)."""

    keys: NDArray[np.int64]
    between: NDArray[np.int64]
    per_cell: NDArray[np.int64]
    corner: NDArray[np.bool_]
    middle: NDArray[np.bool_]
    size: NDArray[np.float64]  # (n,) what corners have less of than other nodes


def ordered_cells(
    matrix: OperatorMatrix, found: NodeSets, *, mass: bool = False, lost: bool = False
) -> tuple[dict[Kind, NDArray[np.int64]], bool]:
    """The likeliest cells of sets of rows, and whether the graph alone tells them.

    With a mass term nothing else stands on the diagonal, nor where cells are lost; of rows that were replaced it says
    nothing.

    Raises TopologyError if the sets do not overlap as cells do.
    """
    sums = np.bincount(matrix.edges.ravel(), np.repeat(matrix.entries, 2), matrix.n)
    size = np.abs(matrix.diagonal if mass or lost else sums)
    if matrix.replaced is not None:  # those inside, between a corner that was replaced and another, are larger
        size = np.where(matrix.replaced, ROUNDED * np.abs(sums), size)
    sides = _sides_between(matrix.n, found, size)
    every = np.sort(np.concatenate([pairs_of(matrix.n, sets).ravel() for sets in found.sets]))
    blocks: dict[Kind, NDArray[np.int64]] = {}
    told, first = found.told, 0
    for sets in found.sets:
        kind = KINDS[_KINDS[sets.shape[1]]]
        trials = list(_trials(kind, sets, sides, sides.per_cell[first : first + len(sets)]))
        order, count = np.zeros(sets.shape, np.int64), np.zeros(len(sets), np.int64)
        for some, trial in trials:
            order[some] = trial
            count[some] += 1
        if not count.all():
            raise TopologyError(f"row {int(sets[np.argmin(count)][0])} is in a cell whose sides do not close")
        several = np.flatnonzero(count > 1)
        entries = ElementEntries(matrix, sets[several], every, mass=mass)
        best = np.full(len(several), np.inf)
        for some, trial in trials:
            mine = count[some] > 1
            some, trial = some[mine], trial[mine]
            at = np.searchsorted(several, some)
            misfit = entries.misfit(kind, at, trial)
            better = misfit < best[at]
            best[at[better]], order[some[better]] = misfit[better], trial[better]
        blocks[kind] = np.take_along_axis(sets, order, axis=1)
        told = told and not len(several)
        first += len(sets)
    return blocks, told


def _sides_between(n: int, found: NodeSets, size: NDArray) -> _Sides:
    """Sides of two cells, and what they say of rows."""
    nodes = found.order + 1
    cell = np.concatenate([np.repeat(np.arange(len(sets)), sets.shape[1]) for sets in found.sets])
    shift = np.cumsum([0, *(len(sets) for sets in found.sets)])
    cell += np.repeat(shift[:-1], [sets.size for sets in found.sets])
    rows = np.concatenate([sets.ravel() for sets in found.sets])
    member = sp.csr_array((np.ones(len(rows), np.int32), (cell, rows)), shape=(int(shift[-1]), n))
    common = sp.triu(member @ member.T, 1, format="coo")
    if (common.data > nodes).any():
        raise TopologyError("cells that the rows seem to form overlap in more than a side")
    one, other = common.row[common.data == nodes], common.col[common.data == nodes]
    shared = sp.csr_array(member[one].multiply(member[other]))
    side = shared.indices.reshape(-1, nodes).astype(np.int64)
    count = np.bincount(rows, minlength=n)
    # Only corners belong to more than two cells; of rows that belong to the same ones a corner's diagonal is smaller.
    rank = np.where(count > 2, -1.0, size)
    side = np.take_along_axis(side, np.argsort(rank[side], axis=1, kind="stable"), axis=1)
    corner, middle = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    corner[side[:, :2]] = middle[side[:, 2:]] = True
    corner[count > 2] = True
    if (corner & middle).any():
        raise TopologyError("rows are corners of some cells and lie between corners of others")
    keys = np.sort(side[:, :2], axis=1) @ [n, 1]
    order = np.argsort(keys, kind="stable")
    if (np.diff(keys[order]) == 0).any():
        raise TopologyError("more than two cells share a side")
    per_cell = np.bincount(np.concatenate([one, other]), minlength=int(shift[-1]))
    return _Sides(keys[order], side[order, 2:], per_cell, corner, middle, size)


def _trials(
    kind: Kind, sets: NDArray[np.int64], sides: _Sides, per_cell: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Which cells, increasing, and places of their nodes in an order that the graph allows."""
    corners, inner, open_rows, n_open = _parted(kind, sets, sides)
    for ring in _RINGS[kind.corners]:
        around = np.take_along_axis(corners, np.broadcast_to(ring, corners.shape), axis=1)
        ends = np.take_along_axis(sets, around, axis=1)
        # Where the sides of the ring are among those of two cells.
        place, known = found(sides.keys, pair_keys(len(sides.size), ends, np.roll(ends, -1, axis=1)))
        fits = (known.sum(axis=1) == per_cell) & ((kind.degree - 1) * (~known).sum(axis=1) == n_open)
        pattern = known @ (1 << np.arange(kind.corners))
        for code in np.unique(pattern[fits]):
            some = np.flatnonzero(fits & (pattern == code))
            none = np.zeros((len(some), kind.corners, kind.degree - 1), np.int64)
            between = sides.between[place[some]] if none.size and len(sides.keys) else none
            local = (sets[some][:, None, None] == between[..., None]).argmax(axis=-1).reshape(len(some), -1)
            for fill in _fillings(kind, known[some[0]]):
                on_sides = [open_rows[some, f - 100] if f >= 100 else local[:, f] for f in fill]
                yield some, np.column_stack([around[some], *on_sides, inner[some]])


def _parted(
    kind: Kind, sets: NDArray[np.int64], sides: _Sides
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Places in each set: of corners (m, c), of the node inside (m, 0 or 1), of rows on sides not known (m, most).

    And the number of the latter; places beyond it mean nothing.
    """
    corner, middle = sides.corner[sets], sides.middle[sets]
    free = ~(corner | middle)
    rank = np.where(corner, -1.0, np.where(middle, np.inf, sides.size[sets]))
    by_rank = np.argsort(rank, axis=1, kind="stable")
    corners = by_rank[:, : kind.corners]
    if np.take_along_axis(middle, corners, axis=1).any() or (corner.sum(axis=1) > kind.corners).any():
        raise TopologyError("rows that cells share do not form sides")
    np.put_along_axis(free, corners, False, axis=1)
    n_inner = kind.nodes - kind.corners * kind.degree
    inner = np.argmax(np.where(free, sides.size[sets], -1.0), axis=1)[:, None][:, :n_inner]
    np.put_along_axis(free, inner, False, axis=1)
    open_rows = np.argsort(~free, axis=1, kind="stable")
    return corners, inner, open_rows, free.sum(axis=1)


def _fillings(kind: Kind, known: NDArray[np.bool_]) -> list[tuple[int, ...]]:
    """Orders of the rows on the sides: those on known sides in both directions, others in any order.

    A number r below 100 is the r-th row of the known sides, and 100 + r the r-th of the others.
    """
    per_side = kind.degree - 1
    if not per_side:
        return [()]
    n_open = int((~known).sum()) * per_side
    if n_open > _MOST:
        raise TopologyError("a cell shares too few sides with others")
    directions = product((1, -1), repeat=int(known.sum())) if per_side > 1 else [(1,) * int(known.sum())]
    fillings = []
    for turns, free in product(list(directions), list(permutations(range(n_open)))):
        turn, rest, filling = iter(turns), iter(free), []
        for s, one in enumerate(known):
            if one:
                filling += list(range(s * per_side, (s + 1) * per_side))[:: next(turn)]
            else:
                filling += [100 + next(rest) for _ in range(per_side)]
        fillings.append(tuple(filling))
    return fillings
