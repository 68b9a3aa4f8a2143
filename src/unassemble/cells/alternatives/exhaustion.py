"""All sets of cells that a small graph may have.

A mesh with as many entries as unknowns is reproduced whatever the entries are: that it fits is no evidence at all. What
is, is that nothing else does, and in small graphs everything can be tried.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ...planar.piece import PieceMesh
from ...topology import Numbering, Polygons
from ..candidates.cell_set import CellSet
from ..reading import NEARLY, Reading
from .rereading import cells_of

_MOST_CELLS = 100
_MOST_STEPS = 20_000  # of the search for sets of cells
_STEP = 0.02  # cost of one, in solutions
_MOST_READINGS = 400  # that are solved
_WIDE = 20.0  # of log c about those of the entries
_STRAIGHT = 1e-6  # radians by which angles around a vertex may exceed a full turn

Cell = tuple[int, ...]


class TooManyError(Exception):
    """Not all could be tried."""


class Budget:
    """What trying everything may cost in all components together.

    Parameters
    ----------
    solutions : float
        About a millisecond each.
    """

    def __init__(self, solutions: float = 20_000.0):
        self._left = solutions

    def spend(self, solutions: float) -> None:
        """Take so many of them.

        Raises
        ------
        TooManyError
            If that is more than there are.
        """
        self._left -= solutions
        if self._left < 0:
            raise TooManyError


def all_readings(
    part: Numbering, weights: NDArray, agree: float, budget: Budget | None = None
) -> Iterator[tuple[set[Cell], float]]:
    """The cells, and the c, of every mesh that has these entries, or nearly.

    Parameters
    ----------
    part : Numbering
        A component of the graph.
    weights : (e,) float64
        -A_ij of its edges.
    agree : float
        Relative difference of numbers that noise may cause.
    budget : Budget, optional
        Shared with other components.

    Raises
    ------
    TooManyError
        If there are too many sets of cells.
    """
    budget = budget or Budget()
    budget.spend(0)
    known: dict[bytes, PieceMesh | None] = {}
    n, solved = len(part.vertices), 0
    choices = _Choices(n, part.edges, budget)
    alone = [_factor_alone(weights[sides], closed) for sides, closed in zip(choices.sides, choices.closed, strict=True)]
    for chosen in choices:
        count = np.bincount(np.concatenate([choices.sides[k] for k in chosen]))
        lone = [c for k in chosen if (c := alone[k]) is not None and (count[choices.sides[k]] == 1).all()]
        if lone and not np.ptp(lone) <= max(NEARLY, agree) * np.max(lone):  # nor if one is none
            continue
        solved += 1
        budget.spend(1)
        if solved > _MOST_READINGS:
            raise TooManyError
        cells = [choices.cells[k] for k in chosen]
        some = CellSet(n, part.edges, weights, None, Polygons.of(cells), np.zeros(len(cells), dtype=bool))
        reading = Reading.of(some, np.ones(len(cells), dtype=bool), known)
        if reading.nearly_fits(agree) and lies_flat(reading):
            yield cells_of(reading, part), next(mesh.scale for mesh in reading.meshes if mesh)


def _factor_alone(weights: NDArray, closed: bool) -> float | None:
    """|c| of a cell whose sides border no other: its angles add up to pi, or pi/2 beside a diameter.

    NaN if it has none; None if there are negative entries, with which there may be two.
    """
    if abs(weights.sum()) < np.abs(weights).sum():
        return None
    size = np.abs(weights)

    def excess(log_c: float) -> float:
        return float(np.arctan2(np.exp(log_c), 2 * size).sum()) - (np.pi if closed else np.pi / 2)

    low, high = np.log(size.min()) - _WIDE, np.log(size.max()) + _WIDE
    return float(np.exp(brentq(excess, low, high, xtol=1e-13))) if excess(low) < 0 < excess(high) else np.nan


def lies_flat(reading: Reading) -> bool:
    """Whether triangles are all the same side up, and around no vertex add up to more than a full turn."""
    turns = np.zeros(reading.candidates.n_vertices)
    for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
        assert mesh is not None
        corners = mesh.z[piece.triangles]
        one, other = (np.roll(corners, -step, axis=1) - corners for step in (1, 2))
        angles = np.angle(other / one)
        if not ((angles > 0).all() or (angles < 0).all()):
            return False
        np.add.at(turns, piece.vertices[piece.triangles], np.abs(angles))
    return bool((turns <= 2 * np.pi + _STRAIGHT).all())


class _Choices:
    """Sets of cells with one or two on each edge, at most one on each vanished side and between two edges at a vertex.

    Cells are induced cycles, and induced paths, the vanished side of which is a diameter of the circle through them.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
    budget : Budget

    Attributes
    ----------
    cells : list of tuple of int
        All that there may be.
    sides : list of list of int
        The edges of each.
    closed : list of bool
        Whether it is a cycle.
    """

    def __init__(self, n: int, edges: NDArray, budget: Budget):
        near: list[set[int]] = [set() for _ in range(n)]
        number = {}
        for k, (a, b) in enumerate(edges.tolist()):
            near[a].add(b)
            near[b].add(a)
            number[a, b] = number[b, a] = k
        self.cells = list(islice(_induced(near), _MOST_CELLS + 1))
        if len(self.cells) > _MOST_CELLS:
            raise TooManyError
        self.sides: list[list[int]] = []
        self.closed = [path[-1] in near[path[0]] for path in self.cells]
        self._wants: list[set[Cell]] = []  # of which there is one each
        for path, closed in zip(self.cells, self.closed, strict=True):
            whole = (*path, path[0]) if closed else path
            self.sides.append([number[pair] for pair in pairwise(whole)])
            corners = zip(whole, whole[1:], (*whole[2:], *whole[1:2]) if closed else whole[2:], strict=False)
            wants: set[Cell] = {(min(a, b), max(a, b), v) for a, v, b in corners}
            self._wants.append(wants if closed else wants | {(path[0], path[-1])})
        self._at: list[list[int]] = [[] for _ in edges]
        for cell, sides in enumerate(self.sides):
            for side in sides:
                self._at[side].append(cell)
        self._steps, self._budget = 0, budget

    def __iter__(self) -> Iterator[list[int]]:
        return self._search([], [0] * len(self._at), set(), set())

    def _search(self, chosen: list[int], count: list[int], taken: set[Cell], out: set[int]) -> Iterator[list[int]]:
        """Each set that has the chosen cells, and none of those that are out, once."""
        self._steps += 1
        self._budget.spend(_STEP)
        if self._steps > _MOST_STEPS:
            raise TooManyError
        bare = next((edge for edge, times in enumerate(count) if not times), None)
        if bare is None:
            yield chosen
        out = out.copy()
        for cell in range(len(self.cells)) if bare is None else self._at[bare]:
            sides, wants = self.sides[cell], self._wants[cell]
            if cell in out or cell in chosen or wants & taken or any(count[side] == 2 for side in sides):
                continue
            more = count.copy()
            for side in sides:
                more[side] += 1
            yield from self._search([*chosen, cell], more, taken | wants, out)
            out.add(cell)


def _induced(near: list[set[int]]) -> Iterator[Cell]:
    """Cycles and paths of three vertices or more with no edge but those along them, each in one direction."""

    def grown(path: list[int]) -> Iterator[Cell]:
        first, last = path[0], path[-1]
        for v in sorted(near[last]):
            inside = near[v] & set(path[1:-1])
            if v in path or inside:
                continue
            if first in near[v] and len(path) > 1:
                if first == min(path) and first < v and path[1] < v:
                    yield (*path, v)
                continue
            if len(path) > 1 and first < v:
                yield (*path, v)
            yield from grown([*path, v])

    for first in range(len(near)):
        yield from grown([first])
