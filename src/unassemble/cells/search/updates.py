"""What small changes of the labels would leave, by the maps of :mod:`unassemble.cells.search.low_rank`."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...matrix.operator import row_sizes
from ..judge.labelling import Labelling
from ..relax.sheet import STEEPEST, Sheet
from .low_rank import ChangedMaps, Move, turned
from .options import SEARCH

_BATCH = 5e4  # triangles times moves that are computed together


def _overlaps(row: NDArray, column: NDArray, shape: tuple[int, int]) -> list[list[int]]:
    """Of each row the rows that have a column in common with it."""
    member = sp.csr_array((np.ones(len(row)), (row, column)), shape=shape)
    both = (member @ member.T).tocsr()
    return [own.tolist() for own in np.split(both.indices, both.indptr[1:-1])]


class Updates:
    """Changes of the labels in one embedding.

    `free` (cells,): labels that may change; all of them by default.
    """

    def __init__(self, sheet: Sheet, free: NDArray[np.bool_] | None = None):
        self.sheet = sheet
        self._free = sheet.chosen if free is None else sheet.chosen & free
        count, (cell, half) = sheet.candidates.count, sheet.candidates.sides.T
        self._touching = _overlaps(np.repeat(sheet.cell, 3), sheet.triangles.ravel(), (count, sheet.n_vertices))
        self._rivals = _overlaps(cell, half, (count, 2 * len(sheet.candidates.edges)))
        n, m = sheet.n_vertices, len(sheet.triangles)
        smaller = row_sizes(n, sheet.edges, np.abs(sheet.weights))[sheet.edges].min(axis=1)
        smaller = np.maximum(smaller, np.finfo(float).tiny)  # entries next to far larger ones underflow
        self._weights = sheet.weights / smaller
        half = 0.5 / smaller[sheet.row.T.ravel()]
        self._of_edge = sp.csc_array((half, (sheet.row.T.ravel(), np.arange(3 * m))), shape=(len(sheet.edges), 3 * m))

    def outline(self, labels: NDArray[np.bool_]) -> bytes:
        """The same for labels that make the same surface, whichever cells they put together or divide."""
        return bytes(np.rint(self.sheet.around(labels.astype(np.float64))).astype(np.int8).tobytes())

    def _with_rivals(self, labels: list[bool], cell: int) -> Move:
        """A candidate, and those that have to give way if it is a new one."""
        return tuple(sorted({cell, *(other for other in self._rivals[cell] if labels[other] and not labels[cell])}))

    def ranked(self, labelling: Labelling) -> Iterator[Move]:
        """Moves that leave least, the best first; what is in the way of a new cell goes.

        Single labels and pairs, then also threes: these are told after a few of the others only.

        `labelling`: in this drawing; with pieces.
        """
        labels = labelling.labels
        try:
            maps = ChangedMaps(self.sheet, labels, SEARCH.near)
        except RecoveryError:
            return
        most = int(np.clip(SEARCH.moves_work / self.sheet.n_vertices, 1, SEARCH.moves))
        # Candidates about the largest misfits first.
        at_vertex = np.bincount(labelling.edges.ravel(), np.repeat(labelling.misfit**2, 2), self.sheet.n_vertices)
        cells, now = self.sheet.candidates.cells, labels.tolist()
        owner = np.repeat(np.arange(cells.count), cells.size)
        order = np.argsort(-(np.bincount(owner, at_vertex[cells.vertices], cells.count) / cells.size), kind="stable")
        moves = list(dict.fromkeys(self._with_rivals(now, k) for k in order[self._free[order]].tolist()[:most]))
        left = self._left(maps, labels, moves)
        alone, given = self._alone(moves, left), set[Move]()
        for level in (2, 3):
            first = np.argsort(left, kind="stable")[: SEARCH.leaders].tolist()
            more = self._joined(labels, {moves[k]: float(left[k]) for k in first}, alone, set(moves))[:most]
            left = np.append(left, self._left(maps, labels, more))
            moves += more
            best = [moves[k] for k in np.argsort(left, kind="stable").tolist() if np.isfinite(left[k])]
            for move in best[: len(best) if level == 3 else SEARCH.soon]:
                if move not in given:
                    given.add(move)
                    yield move

    def as_good(
        self, labelling: Labelling, supposed: NDArray[np.bool_], usual: NDArray[np.bool_], more: list[Move]
    ) -> Iterator[Move]:
        """Moves after which a labelling that fits seems to fit still, those to the same surface left out; best first.

        Single labels, of those (cells,) bool that are `supposed`; pairs of one of these, or of `more` moves, with one
        that touches it, of the `usual` ones; and these `more` moves.
        """
        labels = labelling.labels
        maps = ChangedMaps(self.sheet, labels, SEARCH.nearest)
        now = labels.tolist()
        first = np.flatnonzero(self._free & supposed).tolist()
        moves = list(dict.fromkeys([*more, *(self._with_rivals(now, k) for k in first)]))
        if not moves:
            return
        most = int(SEARCH.beside_work / self.sheet.n_vertices) + 1
        left = self._left(maps, labels, moves)
        leaders = dict(zip(moves, left.tolist(), strict=True))
        pairs = self._joined(labels, leaders, self._alone(moves, left), set(moves), usual)[:most]
        moves, left = moves + pairs, np.append(left, self._left(maps, labels, pairs, SEARCH.faint))
        seen = {self.outline(labels)}
        for k in np.argsort(left, kind="stable").tolist():
            if not left[k] <= SEARCH.faint:
                return
            if (outline := self.outline(turned(labels, moves[k]))) not in seen:
                seen.add(outline)
                yield moves[k]

    def _alone(self, moves: list[Move], left: NDArray) -> NDArray[np.float64]:
        """(cells,) what is left after the change of one label, with what gives way; the most of all where not known."""
        alone = np.full(self.sheet.candidates.count, np.max(left, initial=0.0, where=np.isfinite(left)))
        np.minimum.at(alone, np.concatenate(moves), np.repeat(left, [len(move) for move in moves]))
        return alone

    def _joined(
        self,
        labels: NDArray[np.bool_],
        leaders: dict[Move, float],
        alone: NDArray,
        told: set[Move],
        others: NDArray[np.bool_] | None = None,
    ) -> list[Move]:
        """Leaders with another candidate that touches them, by what both leave alone: the most promising first.

        Only with these `others`, (cells,) bool, if they are given.
        """
        promise: dict[Move, float] = {}
        free, value = (self._free if others is None else self._free & others).tolist(), alone.tolist()
        for move, left in leaders.items():
            after = turned(labels, move).tolist()
            for other in sorted({k for cell in move for k in self._touching[cell]} - {*move}):
                if free[other]:
                    both = tuple(sorted({*move} ^ {*self._with_rivals(after, other)}))
                    promise[both] = min(promise.get(both, np.inf), left + value[other])
        new = promise.keys() - told - {()}
        return sorted(new, key=lambda both: (promise[both], both))

    def _left(
        self, maps: ChangedMaps, labels: NDArray[np.bool_], moves: list[Move], most: float = np.inf
    ) -> NDArray[np.float64]:
        """(moves,) mean misfit after each; infinite where there is no map, or where it is seen to be above `most`."""
        triangles = max(int(np.count_nonzero(labels[self.sheet.cell])), 1)
        batch = max(int(_BATCH / triangles), 1)
        parts = [moves[k : k + batch] for k in range(0, len(moves), batch)]
        return np.concatenate([np.empty(0), *(self._left_of_few(maps, labels, part, most) for part in parts)])

    def _left_of_few(
        self, maps: ChangedMaps, labels: NDArray[np.bool_], moves: list[Move], most: float
    ) -> NDArray[np.float64]:
        sheet, count = self.sheet, len(moves)
        z = maps.after(labels, moves)
        after = np.tile(labels[:, None], count)
        after[np.concatenate(moves), np.repeat(np.arange(count), [len(move) for move in moves])] ^= True
        left = np.full(count, np.inf)
        hopeful = np.all(np.abs(z) < 1 / np.finfo(float).eps, axis=0)  # else the changed pencil is singular
        if most < np.inf:  # few edges tell of nearly all that they leave more
            edges = np.arange(0, len(self._weights), -(-len(self._weights) // 24))  # as many are enough
            few = np.any(np.isin(sheet.row, edges), axis=1)
            w = self._fitted(z[:, hopeful], after[:, hopeful], few)[edges]
            hopeful[hopeful] = _misfits(w, self._weights[edges]).sum(axis=0) <= most * len(self._weights)
        w = self._fitted(z[:, hopeful], after[:, hopeful])
        c = np.ones(w.shape[1])
        with np.errstate(all="ignore"):  # flat triangles beside small entries, or nothing at all, have no scale
            if self.sheet.free_scale:  # for each column, from the weights that it brings near the given ones
                used = np.clip(w, -5.0, 5.0)  # more belongs to flat triangles
                for _ in range(3):
                    c = (self._weights @ used) / np.maximum((used * used).sum(axis=0), np.finfo(float).tiny)
                    used = np.where(np.abs(c * w - self._weights[:, None]) < 0.5, w, 0.0)
            left[hopeful] = _misfits(c * w, self._weights).mean(axis=0)
        return left

    def _fitted(
        self, z: NDArray[np.complex128], labels: NDArray[np.bool_], among: NDArray[np.bool_] | None = None
    ) -> NDArray[np.float64]:
        """(e, k) half the cotangents over row sizes, for positions (n, k) and labels (cells, k).

        Only from triangles `among` these, (m,) bool, if they are given.
        """
        sheet = self.sheet
        used = np.any(labels, axis=1)[sheet.cell]
        triangles = np.flatnonzero(used if among is None else used & among)
        cotangent = _cotangents(z, sheet.triangles[triangles]) * labels[sheet.cell[triangles]]
        columns = (triangles + len(sheet.cell) * np.arange(3)[:, None]).ravel()
        return np.asarray(self._of_edge[:, columns] @ cotangent.reshape(len(columns), z.shape[1]))


def _misfits(w: NDArray, weights: NDArray) -> NDArray[np.float64]:
    """(e, k) by which each column differs from the weights, at most 1."""
    misfit = np.abs(w - weights[:, None])
    return np.asarray(np.where(misfit < 1, misfit, 1.0))


def _cotangents(z: NDArray, triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """(3, m, k) at the corners of triangles (m, 3), for positions (n, k)."""
    at = [z[corner] for corner in triangles.T]
    sides = [at[k - 1] - at[k - 2] for k in range(3)]  # facing the corners
    x, y = [side.real for side in sides], [side.imag for side in sides]
    twice = x[0] * y[1] - y[0] * x[1]
    with np.errstate(all="ignore"):
        cotangent = np.stack([-(x[k - 1] * x[k - 2] + y[k - 1] * y[k - 2]) / twice for k in range(3)])
    return np.asarray(np.nan_to_num(cotangent, posinf=STEEPEST, neginf=-STEEPEST))
