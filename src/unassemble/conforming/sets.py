"""Sets of rows that are the nodes of one cell, read off the graph."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import LARGE, SAMPLE
from ..elements.cliques import Graph, simplices
from ..elements.surface import among
from ..matrix import OperatorMatrix
from ..tolerances import ROUNDED
from ..topology.keys import contains, distinct, pair_keys

_ABSENT = {4: 0, 6: 3, 8: 4, 9: 6, 10: 9}
"""Pairs that a cell of so many nodes may lack, because the entry vanishes and is not stored."""

_DENSEST = 10  # entries above the diagonal, of a row in the mean: cubic triangles and biquadratic cells have eight


@dataclass(frozen=True, eq=False)
class NodeSets:
    """Cells as sets of rows."""

    order: int  # polynomial degree along a side, which has order + 1 nodes
    sets: tuple[NDArray[np.int64], ...]  # tuple of (m, k) one for each number of nodes; rows increase within a cell
    told: bool = False  # whether no other sets would do as well
    even: bool = False  # whether those that come next are as likely


class Common:
    """How many neighbours the two rows of each entry have in common, both themselves included.

    Nodes on opposite sides of a cell have those of the cell in common and no others.
    """

    def __init__(self, matrix: OperatorMatrix, lost: NDArray[np.bool_] | None = None):
        size = matrix.row_size[matrix.edges].min(axis=1)
        self.n = matrix.n
        self.keys = pair_keys(matrix.n, *matrix.edges.T)
        self.graph = Graph.of(matrix.n, *matrix.edges.T)
        stored = np.abs(matrix.entries) > ROUNDED * size
        self.stored = self.keys[stored]
        self.asked = self.stored if lost is None else self.keys[stored & ~lost[matrix.edges].any(axis=1)]  # for a cell

    @cached_property
    def nonzero(self) -> Graph:
        """Entries that are not zero."""
        return Graph.of(self.n, self.stored // self.n, self.stored % self.n)

    def sets(self, k: int) -> NDArray[np.int64]:
        """(m, k) rows that two of them have in common, nearly all coupled to each other."""
        keys = self.keys[self.graph.common == k]
        if len(keys) > LARGE and not len(self._in_common(keys[:: len(keys) // SAMPLE], k)):
            return np.empty((0, k), np.int64)
        return once(self._in_common(keys, k))

    def _in_common(self, keys: NDArray[np.int64], k: int) -> NDArray[np.int64]:
        """The rows that pairs have in common, where all or nearly all others of these are coupled too."""
        if not len(keys):
            return np.empty((0, k), np.int64)
        i, j = keys // self.n, keys % self.n
        rows = self.graph.in_common(i, j, k)
        # What two cells have left of which others are lost may have as many rows, some with few neighbours among them.
        rest = rows[(rows != i[:, None]) & (rows != j[:, None])].reshape(-1, k - 2)
        return rows[(self._absent(rest).sum(axis=1) <= 2 * _ABSENT[k]) & (2 * self._absent(rows) < k).all(axis=1)]

    def bubbles(self) -> NDArray[np.int64]:
        """(m, 10) cubic triangles that lack many entries, by the node inside.

        Entries between it and the corners vanish where all sides are straight, so that of the rows it is coupled to
        only two belong to another cell's; rows that have more among their neighbours are in its own.
        """
        inside = np.flatnonzero(np.diff(self.graph.closed.indptr) <= 10)
        if len(inside) > LARGE and not len(self._near_three(inside[:: len(inside) // SAMPLE])):
            return np.empty((0, 10), np.int64)
        return once(self._near_three(inside))

    def _near_three(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """(m, 10) what has three of a row and its neighbours among its own, where these are ten."""
        several = sp.csr_array(self.graph.closed[rows].astype(np.int32) @ self.graph.closed)
        several.data = (several.data > 2).astype(np.int32)
        several.eliminate_zeros()
        several.sort_indices()
        return several[np.diff(several.indptr) == 10].indices.reshape(-1, 10).astype(np.int64)

    def quadratic_triangles(self, found: NDArray[np.int64]) -> NDArray[np.int64]:
        """(m, 6) quadratic triangles that are no cliques, beside those found already, and these.

        Corners need not be coupled to the sides that face them: entries there vanish where all sides are straight. But
        the three nodes on the sides are, unless they meet at a right angle, and the six nodes of the cell are what two
        of these three have in common.
        """
        for right_angles in (False, True):
            keys = self.stored[~contains(distinct(pairs_of(self.n, found)), self.stored)]
            if not len(keys):
                break
            alone = Graph.of(self.n, keys // self.n, keys % self.n)
            if right_angles:  # paths of two edges, the node between in the second place
                place, end = alone.spread(alone.col)
                first = alone.row[place]
                middle = np.column_stack([first, alone.col[place], end])[first < end]
            else:
                middle = simplices(alone, 2)
            several = sp.csr_array(sum(self.graph.closed[column] for column in middle.T))
            several.data = (several.data >= 2).astype(np.int32)
            several.eliminate_zeros()
            several.sort_indices()
            size = np.diff(several.indptr)
            # Around a vertex of three triangles two of the three share a node more.
            rows = several[size == 7].indices.reshape(-1, 7)
            rows = [several[size == 6].indices.reshape(-1, 6), *(np.delete(rows, k, axis=1) for k in range(7))]
            new = once(np.concatenate(rows).astype(np.int64))
            found = once(np.concatenate([found, new[self._absent(new).sum(axis=1) <= 2 * (_ABSENT[6] + right_angles)]]))
        return found

    def _absent(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """(m, k) how many others of its set each row is not coupled to."""
        absent = np.zeros(rows.shape, np.int64)
        for a, b in combinations(range(rows.shape[1]), 2):
            apart = ~contains(self.keys, rows[:, a] * self.n + rows[:, b])
            absent[:, a] += apart
            absent[:, b] += apart
        return absent


def once(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows (m, k) of increasing numbers, each once; sorting one number each is several times faster than all."""
    label = rows.astype(np.uint64) @ np.random.default_rng(0).integers(0, 2**63, rows.shape[1], dtype=np.uint64)
    order = np.argsort(label)
    return rows[np.sort(order[np.append(True, np.diff(label[order]) != 0)[: len(rows)]])]


def pairs_of(n: int, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, k (k - 1) / 2) keys of all pairs of each cell, in the order of :func:`numpy.triu_indices`."""
    a, b = np.triu_indices(cells.shape[1], 1)
    return pair_keys(n, cells[:, a], cells[:, b])


def node_sets(matrix: OperatorMatrix, lost: NDArray[np.bool_] | None = None) -> Iterator[NodeSets]:
    """Sets that cover all entries, for each order of elements that the graph allows, greatest first.

    Linear ones are quadrilaterals only: triangles beside them follow once diagonals are known. Where cells are `lost`
    at some rows, (n,) bool, entries of these need no cell.
    """
    degree = np.bincount(matrix.edges.ravel(), minlength=1).astype(float)
    if not 0 < len(matrix.edges) <= _DENSEST * matrix.n or (degree**2).sum() > SAMPLE * matrix.n:
        return  # too dense, or with a row that is coupled to nearly all others
    common = Common(matrix, lost)
    for order, k in ((3, 10), (2, 9), (2, 8), (2, 6)):
        found = common.sets(k)
        if _cover(common, [found]):
            yield NodeSets(order, (found,))
        if order == 3:  # pairs of nodes of two cells may have ten neighbours in common, too
            bubbles = common.bubbles()
            if len(bubbles) != len(found) and _cover(common, [bubbles]):
                yield NodeSets(order, (bubbles,))
    choices = list(_choices(common, common.sets(4)))
    for quads in choices:
        if _cover(common, [quads]):
            yield NodeSets(1, (quads,), len(choices) == 1)
        triangles = _beside(common, quads)
        if len(triangles) and _cover(common, [triangles, quads]):
            yield NodeSets(1, (triangles, quads), len(choices) == 1)
    if not _cover(common, [found]):
        likeliest, other = halves(matrix, common.nonzero)
        rest = common.quadratic_triangles(once(np.concatenate([found, likeliest])))
        if _cover(common, [rest]):
            yield NodeSets(2, (rest,), even=other is not None)
            if other is not None:
                yield NodeSets(2, (once(np.concatenate([rest[~among(rest, likeliest)], other])),))


def _choices(common: Common, quads: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """All of them, or where some overlap in three rows, so that only one of two is a cell, either.

    Two triangles beside a quadrilateral have its diagonal for a pair: with the vertex between them, all are coupled.
    """
    if not len(quads):
        return
    member = sp.csr_array((np.ones(quads.size, np.int32), quads.ravel(), np.arange(0, quads.size + 1, 4)))
    overlap = sp.triu(member @ member.T, 1, format="coo")
    one, other = overlap.row[overlap.data == 3], overlap.col[overlap.data == 3]
    if not len(one):
        yield quads
        return
    degree = np.diff(common.graph.closed.indptr)[quads].sum(axis=1)
    fewer = degree[one] <= degree[other]
    for choice in (fewer, ~fewer):
        yield np.delete(quads, np.where(choice, other, one), axis=0)


def _beside(common: Common, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) triangles beside quadrilaterals: rows that are all coupled, and all in no quadrilateral.

    Around a vertex of three cells its neighbours are all coupled as well, by diagonals; and of triangles around a
    vertex the outline is none.
    """
    label = np.random.default_rng(1).integers(0, 2**63, common.n, dtype=np.uint64)  # the sum of three tells a triangle
    halves = label[quads[:, list(combinations(range(4), 3))]].sum(axis=2)
    triangles = simplices(common.graph, 2)
    triangles = triangles[~np.isin(label[triangles].sum(axis=1), halves)]
    if not 0 < len(triangles) < 3 * common.n:  # more than a planar graph has (Hakimi and Schmeichel, 1979): of solids
        return triangles[:0]
    keys = pairs_of(common.n, quads)
    order = np.argsort(keys, axis=None)
    pairs = pairs_of(common.n, triangles)
    place = np.minimum(np.searchsorted(keys.ravel(), pairs, sorter=order), len(order) - 1)
    by_quad = keys.ravel()[order[place]] == pairs
    within = np.sort(halves, axis=None)
    known = np.sort(np.concatenate([within, label[triangles].sum(axis=1)]))
    degree = np.diff(common.graph.closed.indptr)
    outline = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        for corner in range(4):
            hub = quads[order[place[:, k]] // keys.shape[1], corner]
            a, b, c = triangles.T
            around = np.stack([label[hub] + label[one] + label[other] for one, other in ((a, b), (a, c), (b, c))])
            lone = degree[hub] == 4 + contains(within, around).sum(axis=0)  # no cells but three
            new = (triangles != hub[:, None]).all(axis=1)
            outline |= by_quad[:, k] & new & lone & contains(known, around).all(axis=0)
    return triangles[~outline]


def _cover(common: Common, sets: list[NDArray[np.int64]]) -> bool:
    """Whether each entry that is not zero, and has to, belongs to a cell."""
    if not sum(map(len, sets)):
        return False
    covered = distinct(np.concatenate([pairs_of(common.n, cells).ravel() for cells in sets]))
    return bool(contains(covered, common.asked).all())


def halves(matrix: OperatorMatrix, nonzero: Graph) -> tuple[NDArray[np.int64], NDArray[np.int64] | None]:
    """Pairs of quadratic triangles whose four corners lie on a circle, and the side between them has the weight zero.

    Of it nothing is left but the entries of the node in its middle with those on the four sides around. These are
    coupled to each other within each triangle, unless it has a right angle there; then only the numbers tell the
    diagonal: the entries of the middle with two sides of a right triangle have the product 16 c^2 / 9 (w at these sides
    is half the tangent of one angle and half its inverse, the entries are -8/3 c w). In a rectangle both diagonals have
    that, and the matrix is the same for either.

    Returns (m, 6) triangles of the graph of nonzero entries, rows increasing within a cell, and the same with the pair
    of which the numbers say least divided the other way; None where the graph tells all diagonals.
    """
    ring = _rings(nonzero)
    key = matrix.edges @ [matrix.n, 1]
    at_sides = np.searchsorted(key, pair_keys(matrix.n, ring[:, 8:], ring[:, 4:8]))
    one, two, three, four = matrix.entries[at_sides].T
    differ = np.abs([one * two - three * four, two * three - four * one])
    told = nonzero.coupled(ring[:, [4, 5]], ring[:, [5, 6]])
    turned = told[:, 1] | (~told[:, 0] & (differ[1] < differ[0]))
    if told.any(axis=1).all():
        return _triangles(ring, turned), None
    says = np.where(told.any(axis=1), np.inf, np.abs(differ[0] - differ[1]) / np.abs(one * three))
    again = turned.copy()
    again[np.argmin(says)] ^= True
    return _triangles(ring, turned), _triangles(ring, again)


def _triangles(ring: NDArray[np.int64], turned: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(2 k, 6) triangles of the cells (k, 9), divided from their first corner to the third, or else between others."""
    pairs = [[0, 1, 2, 4, 5, 8], [2, 3, 0, 6, 7, 8]], [[1, 2, 3, 5, 6, 8], [3, 0, 1, 7, 4, 8]]
    return np.sort(np.where(turned[:, None, None], ring[:, pairs[1]], ring[:, pairs[0]]).reshape(-1, 6), axis=1)


def _rings(graph: Graph) -> NDArray[np.int64]:
    """(k, 9) corners around each cell, the nodes on its sides, each after its corner, and the node in the middle."""
    middle = np.flatnonzero(np.diff(graph.start) == 4)
    sides = graph.col[graph.start[middle][:, None] + np.arange(4)]
    pairs = sum(graph.coupled(sides[:, a], sides[:, b]).astype(int) for a, b in combinations(range(4), 2))
    middle, sides = middle[pairs % 2 == 0], sides[pairs % 2 == 0]
    open_graph = graph.closed - sp.eye_array(graph.n, dtype=np.int32, format="csr")
    several = sp.csr_array(sum(open_graph[column] for column in sides.T))
    several.data = (several.data == 2).astype(np.int32)
    several.eliminate_zeros()
    some = np.flatnonzero(np.diff(several.indptr) == 4)
    return _closed(graph, several[some].indices.reshape(-1, 4).astype(np.int64), sides[some], middle[some])


def _closed(graph: Graph, corners: NDArray, sides: NDArray, middle: NDArray) -> NDArray[np.int64]:
    """Those of these cells whose corners and sides make a ring, in its order."""
    around = graph.coupled(corners[:, :, None], corners[:, None, :])
    across = ~around & ~np.eye(4, dtype=bool)
    good = (around.sum(axis=2) == 2).all(axis=1) & (across.sum(axis=2) == 1).all(axis=1)
    corners, sides, middle, around, across = (of[good] for of in (corners, sides, middle, around, across))
    facing, next_ = across[:, 0].argmax(axis=1), around[:, 0].argmax(axis=1)
    order = np.column_stack([np.zeros_like(facing), next_, facing, 6 - facing - next_])
    corners = np.take_along_axis(corners, order, axis=1)
    touching = graph.coupled(sides[:, :, None], corners[:, None, :])
    between = touching[:, :, [0, 1, 2, 3]] & touching[:, :, [1, 2, 3, 0]]
    good = (touching.sum(axis=2) == 2).all(axis=1) & (between.sum(axis=1) == 1).all(axis=1)
    sides = np.take_along_axis(sides, between.argmax(axis=1), axis=1)
    after = graph.coupled(sides, np.roll(sides, -1, axis=1))
    good &= ~graph.coupled(sides[:, :2], sides[:, 2:]).any(axis=1) & (after[:, :2] == after[:, 2:]).all(axis=1)
    good &= ~after[:, :2].all(axis=1)
    return np.column_stack([corners, sides, middle])[good]
