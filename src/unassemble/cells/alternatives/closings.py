"""Vertices on the boundary of loose meshes that a right angle may close, the far side of which has vanished.

Where every edge lies on a triangle nothing need have vanished. But a mesh with as many entries as unknowns fits
whatever the entries are, and so its fit is no evidence: take the fan of triangles about a vertex inside a mesh, where
the last one has a right angle there and its far side has vanished from the boundary. The others by themselves are a
fan that fits, with another c. That the angles about a vertex add up to a full turn is an equation more, so that other
cells which fit are the likelier ones, if anything.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Numbering, Piece, Topology
from ...topology.faces import joined
from ..agreement import SAME_SCALE
from ..alike import Answers, Cells, Found, as_cell
from ..beginning import fitting_starts
from ..by_component import with_pieces
from ..candidates.candidates import Candidates
from ..labels.descent import beside
from ..labels.effort import SMALL_GRAPH
from .corners import Alternative, OrientedMesh
from .loose import fits_as_one, is_loose
from .rereading import cells_of, own_cells

_MOST_VERTICES = 20_000  # in all components that are read again: a minute at most
_MOST_TRIALS = 511  # sets of cells for one component, some milliseconds each
_REFLEX = 1.1  # least angle, over pi, about a vertex that a right angle may close: of 1,200 tried all have 1.19 or more


def closed_by_right_angles(
    stored: OperatorMatrix, topology: Topology, mesh: OrientedMesh, factors: NDArray
) -> tuple[list[Alternative], bool]:
    """Other meshes of components of loose pieces, c not being known, in which vertices on the boundary lie inside.

    They are sought among the readings to begin with, which have right angles where angles suggest it, and those that
    differ from these by a label or two. Then all sets of cells that may close some vertices are tried, where there are
    not too many: right angles, and halves of circles about two vertices. With the cell left out such a vertex still
    has more than half a turn about it; where there is none nothing is sought.

    Parameters and results are those of :func:`unassemble.cells.alternatives.other_scales.other_scales`.
    """
    none = np.zeros(stored.n, dtype=np.int64)
    reflex = _reflex(stored.n, mesh)
    chosen = [
        (part, pieces)
        for part, pieces in with_pieces(stored.n, stored.edges, topology.pieces)
        if pieces and reflex[part.vertices].any() and all(is_loose(piece, none) for piece in pieces)
    ]
    parts = [part for part, _ in chosen]
    found, left, answers, left_open = [], _MOST_VERTICES, Answers(), False
    for (part, pieces), own in zip(chosen, own_cells(stored.n, parts, mesh), strict=True):

        def ask(part: Numbering = part, pieces: list[Piece] = pieces, own: Cells = own) -> Found:
            nonlocal left
            left -= len(part.vertices)
            if left < 0:
                return None, 0.0, True
            other = _other(stored, part, own)
            return other if other[0] is not None or len(pieces) > 1 else _closed(stored, pieces[0], reflex, own)

        cells, c, unknown = answers.of(part, -stored.entries[part.edge_rows], own, ask)
        left_open |= unknown
        if cells is not None:
            same = abs(c / float(factors[part.vertices[0]]) - 1) < SAME_SCALE
            found.append(Alternative.of(own, cells, same_scale=same))
    return found, left_open


def _reflex(n: int, mesh: OrientedMesh) -> NDArray[np.bool_]:
    """(n,) vertices on the boundary at which the angles of triangles add up to clearly more than half a turn."""
    turns = np.zeros(n)
    corners = mesh.z[mesh.triangles]
    one, other = (np.roll(corners, -step, axis=1) - corners for step in (1, 2))
    np.add.at(turns, mesh.triangles, np.abs(np.angle(other / one)))
    outside = np.zeros(n, dtype=bool)
    outside[mesh.boundary[:, 0]] = True
    return np.asarray(outside & (turns > _REFLEX * np.pi))


def _other(stored: OperatorMatrix, part: Numbering, own: Cells) -> Found:
    errors = None if stored.errors is None else stored.errors[part.edge_rows]
    n = len(part.vertices)
    for reading in fitting_starts(n, part.edges, -stored.entries[part.edge_rows], None, errors):
        near = isinstance(reading.candidates, Candidates) and n <= SMALL_GRAPH
        for one in (reading, *(beside(reading) if near else ())):
            if (cells := cells_of(one, part)) != own:
                return cells, next(solved.scale for solved in one.meshes if solved), False
    return None, 0.0, False


def _closed(stored: OperatorMatrix, piece: Piece, reflex: NDArray[np.bool_], own: Cells) -> Found:
    """The same cells with others that close some vertices of one piece."""
    triangles = piece.vertices[piece.triangles]
    more = list(_closing(stored, piece, reflex))
    if 2 ** len(more) - 1 > _MOST_TRIALS:
        return None, 0.0, True
    for some in chain.from_iterable(combinations(more, count) for count in range(len(more), 0, -1)):
        apexes = [apex for cell in some for apex in cell[1:-1]]
        if len(set(apexes)) < len(apexes):
            continue
        fans = [(cell[0], *pair) for cell in some for pair in pairwise(cell[1:])]
        if fits_as_one(stored, np.concatenate([triangles, np.array(fans)]), tuple(apexes)):
            return own | set(map(as_cell, some)), np.inf, False  # whatever c, it is another one
    return None, 0.0, False


def _closing(stored: OperatorMatrix, piece: Piece, reflex: NDArray[np.bool_]) -> Iterator[tuple[int, ...]]:
    """Corners at one vertex, and cells about two that follow each other along the boundary; counter-clockwise."""
    ends = piece.vertices[piece.boundary].tolist()
    following, before = dict(ends), {head: tail for tail, head in ends}
    for p, h in ends:
        for cell in ((following[h], h, p), (following[h], h, p, before[p])):
            first, *apexes, last = cell
            alone = len(set(cell)) == len(cell) and reflex[apexes].all()
            if alone and not joined(stored.n, stored.edges, np.array([first]), np.array([last]))[0]:
                yield cell
