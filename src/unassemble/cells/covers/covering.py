"""Cells of few shapes, found by an exact cover of all edges in no drawing.

Where most cells are alike, as in lattices with many holes, angles tell little, and a graph that hangs together by
single vertices has too many drawings. But their cotangents are few numbers, which are soon guessed, and which cells
have them is a problem of integers; see :mod:`unassemble.cells.covers.program`. Positions are not among its unknowns:
where the cells of a solution cannot be put together, the few that are to blame are excluded, until one fits.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ..agreement import common_values
from ..candidates.cell_set import CellSet
from ..candidates.crosses import Crosses
from ..reading import Reading
from .consistent import FITS, Assembly
from .numbered import AGREE, Numbered, frequent_numbers
from .program import Program
from .shapes import Shapes

_log = logging.getLogger(__name__)

MOST_VERTICES = 400
_MOST_SHAPES = 3000
_MOST_CELLS = 2500  # with their numbers
MOST_EQUAL_CELLS = 1000
"""The same where all weights are equal: bounds of such programs leave everything open, and larger ones take minutes."""
_NUMBERS = 4  # that are tried at most
_SCALES = 3  # of each kind that are tried
_WORK = 5e6  # squares of the cells of programs that have solutions, added up: ten seconds, those that fit took five
_SIGMAS = 30.0  # errors of single entries by which numbers may differ that are equal
_NOISY = 1e-3  # difference of numbers that are taken for equal, above which too many are


def read_by_cover(
    n: int,
    edges: NDArray,
    weights: NDArray,
    scale: float | None = None,
    errors: NDArray | None = None,
    *,
    most_cells: int = _MOST_CELLS,
) -> Reading[CellSet] | None:
    """A reading that fits, of triangles, corners and undivided quadrilaterals of few shapes; None if none is found.

    Parameters are those of :func:`unassemble.cells.search.read_cells`. Programs of more than `most_cells` are left.
    """
    shapes = Shapes.of(n, edges, _MOST_SHAPES) if n <= MOST_VERTICES else None
    if shapes is None or not len(shapes):
        return None
    left = _WORK
    for c in [scale] if scale is not None else likely_scales(shapes, weights, errors):
        tried, agree = 0, _agree(errors, c)
        if agree > _NOISY:
            continue
        for cells in _numberings(shapes, weights, c, errors, agree):
            if cells is None or len(cells.cell) > most_cells or len(cells.cell) == tried:
                continue
            tried = len(cells.cell)
            reading, left = _covered(cells, weights, scale, errors, left, max(FITS, 10 * agree))
            if reading is not None or left <= 0:
                return reading
    return None


def _covered(
    cells: Numbered, weights: NDArray, scale: float | None, errors: NDArray | None, left: float, fits: float
) -> tuple[Reading[CellSet] | None, float]:
    """A reading that fits of numbered cells, or none; and how much work is left."""
    program, assembly = Program(cells), Assembly(cells, fits)
    while left > 0:
        chosen = program.solution(program.fans)
        if chosen is None:  # most such programs end before their search begins
            break
        left -= len(cells.cell) ** 2
        conflict = assembly.conflict(chosen)
        _log.debug("%d cells, in conflict %d", len(chosen), 0 if conflict is None else len(conflict))
        if conflict is None:
            taken = replace(as_set(cells.shapes, cells.cell[chosen], weights, scale), errors=errors)
            reading = Reading.of(taken, np.ones(taken.count, dtype=bool))
            if reading.fits:
                return reading, left
            conflict = chosen
        program.exclude(conflict)
    return None, left


def _agree(errors: NDArray | None, c: float) -> float:
    """Difference of numbers that are equal, in units of c."""
    return AGREE if errors is None else max(AGREE, _SIGMAS * float(np.median(errors)) / abs(c))


def _numberings(
    shapes: Shapes, weights: NDArray, c: float, errors: NDArray | None, agree: float
) -> Iterator[Numbered | None]:
    """Cells with few frequent numbers, with more, and with the numbers of crosses."""
    cotangents = 2 * weights / c
    n, edges = shapes.n_vertices, shapes.edges
    numbers = frequent_numbers(shapes, cotangents, _NUMBERS, agree)
    for count in range(1, len(numbers) + 1):
        yield Numbered.of(shapes, cotangents, np.tile(numbers[:count], (len(edges), 1)), agree)
    known = Crosses.of(n, edges, weights, c, errors).cotangents(n, edges, weights)
    if np.isfinite(known).any():
        yield Numbered.of(shapes, cotangents, known, agree)


def likely_scales(shapes: Shapes, weights: NDArray, errors: NDArray | None = None) -> list[float]:
    """The c of several corners about vertices of two edges, of triangles, or of crosses, if they border no other cell.

    The cotangents at the ends of a corner have the product 1; those of a triangle satisfy ab + bd + da = 1.
    """
    n, edges = shapes.n_vertices, shapes.edges
    sign = float(np.sign(weights.sum()))
    a, b, d = (sign * weights)[shapes.sides[:, :3]].T
    two = np.bincount(edges.ravel(), minlength=n)[shapes.vertices[:, 1]] == 2
    alone = (shapes.corner & two & (a > 0) & (b > 0), shapes.stored[:, 2] & (shapes.size == 3))
    products = (a * b, a * b + b * d + d * a)
    found, close = [], _agree(errors, float(np.median(np.abs(weights))))
    for usable, product in zip(alone, products, strict=True):
        cell = np.flatnonzero(usable & (product > 0))
        found.append(common_values(2 * np.sqrt(product[cell]), cell, close)[:_SCALES])
    crossed = Crosses.of(n, edges, weights, errors=errors).scale
    values = np.concatenate([*found, [] if crossed is None else [abs(crossed)]])
    _, first = np.unique(np.round(values, 9), return_index=True)
    return [sign * float(c) for c in values[np.sort(first)] if c]


def as_set(shapes: Shapes, chosen: NDArray, weights: NDArray, scale: float | None) -> CellSet:
    """Some cells by themselves."""
    vertices = shapes.vertices[chosen]
    offsets = np.append(0, np.cumsum(shapes.size[chosen]))
    cells = Polygons(offsets, vertices[vertices >= 0])
    return CellSet(shapes.n_vertices, shapes.edges, weights, scale, cells, shapes.corner[chosen])
