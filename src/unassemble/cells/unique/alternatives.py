"""Other cells with the same entries: the search for labels with the answer excluded.

A component of up to 1,000 rows is searched around its answer, all with low-rank updates of one conformal map:

- one label or two that touch, turned over, one of them of a cell with a side that has vanished from the boundary: only
  these come and go without leaving an edge bare;
- a vertex at a right angle given up by a cell of more than three vertices;
- two right angles at one vertex regrouped. A right angle a-h-b gives the edges h-a and h-b the cotangents |hb| / |ha|
  and its inverse, whatever else there is; where another one, d-h-f, gives the same pair, a-h-f and b-h-d (or a-h-d and
  b-h-f) give all four edges what they had.

What then fits when solved by itself is another mesh with the same matrix.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...matrix import OperatorMatrix
from ...tolerances import ALIKE
from ...topology import LocalNumbering, Polygons, components
from ...topology.drawn import from_rotation
from ...topology.embedding import face_complexes
from ...topology.faces import FaceComplex
from ...topology.keys import contains, pair_keys
from ..candidates.candidates import Candidates
from ..judge.labelling import Labelling
from ..relax.sheet import Sheet
from ..search.low_rank import Move, turned
from ..search.updates import Updates
from ..undivided import undivided
from .around import Around, Cell

SEARCHED_ROWS = 1000
"""Rows of a component around whose answer others are looked for: the cost grows like the square."""


_MOST_SOLVED = 60
"""Labellings of a component that are solved for, of either kind."""


@dataclass(frozen=True)
class Alternative:
    """Another mesh that fits as well as the one found: cells that only the one or the other has, in running order."""

    cells: tuple[Cell, ...]
    other_cells: tuple[Cell, ...]


def alternatives(
    stored: OperatorMatrix, cells: Polygons, z: NDArray[np.complex128], scale: float | None, agree: float
) -> list[Alternative]:
    """One other mesh for each component of up to 1,000 rows that has any.

    `stored`: without the vanished entries; `cells`: of the mesh that was found, counter-clockwise; `z` (n,) complex:
    positions in the frame in which the operator is the Laplacian; `scale`: c, where it is known; `agree`: relative
    difference of numbers that noise may cause.
    """
    found = []
    for part in components(stored.n, stored.edges):
        if len(part.vertices) <= SEARCHED_ROWS:
            number = np.full(stored.n, -1)
            number[part.vertices] = np.arange(len(part.vertices))
            own = cells.chosen(number[cells.vertices[cells.offsets[:-1]]] >= 0, number)
            other = _other(stored, part, own, z[part.vertices], scale, max(agree, ALIKE))
            found += [] if other is None else [other]
    return found


def _other(
    stored: OperatorMatrix, part: LocalNumbering, cells: Polygons, z: NDArray, scale: float | None, agree: float
) -> Alternative | None:
    embedding = _embedding(part, z)
    if embedding is None or not cells.count:
        return None
    errors = None if stored.errors is None else stored.errors[part.edge_rows]
    candidates = Candidates.of(embedding, -stored.entries[part.edge_rows], scale, errors)
    around = Around.of(candidates, cells, z, agree)
    answer = Labelling.of(around.candidates, around.labels)
    if not answer.fits:
        return None
    own = _cells_of(answer)
    every = (around.regrouped, around.turned_over, _relabelled(around, answer))
    for move in chain.from_iterable(islice(moves, _MOST_SOLVED) for moves in every):
        other = Labelling.of(around.candidates, turned(answer.labels, move))
        if other.fits and (others := _cells_of(other)) != own:
            row = part.vertices.tolist()
            only = own - others, others - own
            return Alternative(*(tuple(sorted(_as_cell([row[v] for v in cell]) for cell in some)) for some in only))
    return None


def _relabelled(around: Around, answer: Labelling) -> Iterator[Move]:
    """Small changes that low-rank updates do not tell from the answer."""
    with suppress(RecoveryError):
        supposed = around.candidates.corner  # their third sides are supposed to have vanished from the boundary
        usual = around.candidates.first | supposed | around.labels
        # Cells that give up a vertex at a right angle.
        reduced: list[Move] = [tuple(sorted((a.cell, a.rest))) for a in around.right_angles if a.rest >= 0]
        yield from Updates(Sheet(around.candidates, answer.scale)).as_good(answer, supposed, usual, reduced)


def _embedding(part: LocalNumbering, z: NDArray[np.complex128]) -> FaceComplex | None:
    """The graph as the mesh lies; where that is no embedding, as parts may lie on others, any."""
    n, edges = len(part.vertices), part.edges
    tail, head = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.lexsort((-np.angle(z[head] - z[tail]), tail))  # clockwise: faces run counter-clockwise, as cells do
    embedding = from_rotation(n, edges, tail[order], head[order])
    return embedding if embedding.is_sphere() else next(face_complexes(n, edges), None)


def _cells_of(labelling: Labelling) -> set[Cell]:
    """However they were put together."""
    n = labelling.candidates.n_vertices
    vanished = ~contains(pair_keys(n, *labelling.candidates.edges.T), pair_keys(n, *labelling.edges.T))
    triangles, polygons = undivided(labelling.pieces, vanished)
    return {_as_cell(cell) for cell in (*triangles.tolist(), *polygons.cycles)}


def _as_cell(corners: list[int] | Cell) -> Cell:
    """A cell by its corners in running order: the smallest first, then the smaller of its neighbours."""
    place = min(range(len(corners)), key=corners.__getitem__)
    cell = (*corners[place:], *corners[:place])
    return cell if cell[1] < cell[-1] else (cell[0], *cell[:0:-1])
