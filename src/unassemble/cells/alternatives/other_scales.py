"""Loose pieces, read with another factor c.

A mesh of one loose piece, with as many entries as unknowns, fits whatever the entries are, and so do others; that
nothing else fits can only be found out by trying everything. Where several such pieces hang together all of them have
one c, and that is the only evidence. It is none where their entries are of a kind: crossed rhombi of any shapes, for
instance, are pairs of right triangles as well, all of them with one other c. Nor is it where all pieces have the same
entries, by which they have the same c anyway: two congruent triangles that share a vertex are also a mesh of one piece,
with a right angle of equal legs between them, and with another c.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Numbering, Piece, Topology
from ...topology.embedding import face_complexes
from ...topology.keys import contains, pair_keys
from ..agreement import SAME_SCALE, common_values
from ..alike import ALIKE, Answers, Cells, Found
from ..by_component import with_pieces
from ..candidates.angles import scales_of_faces
from ..candidates.crosses import Crosses
from ..covers.covering import MOST_VERTICES
from ..covers.shapes import Shapes
from ..reading import NEARLY
from .corners import Alternative, OrientedMesh
from .exhaustion import Budget, TooManyError, all_readings
from .hinged import FEW_PIECES, in_a_tree
from .loose import is_loose
from .rereading import cells_of, own_cells, with_another_scale

_MOST_FOUND = 1000  # components that fit with other cells, some milliseconds each
_MOST_SHAPES = 3000
_MOST_SCALES = 6
_SHORT = 4  # cells of up to so many sides are right angles, triangles or parts of crosses
_AGREE = 1e-7


def other_scales(
    stored: OperatorMatrix,
    topology: Topology,
    mesh: OrientedMesh,
    factors: NDArray,
    closed: NDArray[np.int64],
    agree: float,
) -> tuple[list[Alternative], bool]:
    """Other meshes for components of loose pieces, c not being known.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    mesh : OrientedMesh
    factors : (n,) float64
        c of the piece of each row.
    closed : (n,) int64
        1 for rows that four right angles surround.
    agree : float
        Relative difference of numbers that noise may cause.

    Returns
    -------
    alternatives : list of Alternative
        One for each component that fits with other cells, up to 1,000.
    open : bool
        Whether there are components of which this could not be found out.
    """
    weights_of = np.zeros(len(topology.edges))
    weights_of[contains(pair_keys(stored.n, *stored.edges.T), pair_keys(stored.n, *topology.edges.T))] = -stored.entries
    gone = np.zeros(stored.n, dtype=bool)
    gone[topology.edges[topology.vanished]] = True
    loose = []
    for part, pieces in with_pieces(stored.n, stored.edges, topology.pieces):
        if pieces and all(is_loose(piece, closed) for piece in pieces):
            few = len(pieces) <= FEW_PIECES and in_a_tree(pieces)
            if gone[part.vertices].any():
                loose.append((part, few))
            elif len(pieces) > 1 and (few or _alike(pieces, weights_of, max(ALIKE, agree))):
                loose.append((part, True))
    found: list[Alternative] = []
    left_open, budget = False, Budget()
    own_of = own_cells(stored.n, [part for part, _ in loose], mesh)
    answers = Answers()
    for (part, unproved), own in zip(reversed(loose), reversed(own_of), strict=True):  # the smallest first
        if len(found) == _MOST_FOUND:
            break
        weights, c = -stored.entries[part.edge_rows], float(factors[part.vertices[0]])
        errors = None if stored.errors is None else stored.errors[part.edge_rows]
        ask = partial(_other, part, weights, errors, c, own, agree, budget, unproved=unproved)
        cells, factor, unknown = answers.of(part, weights, own, ask)
        left_open |= unknown
        if cells is not None:
            same = abs(factor / c - 1) < SAME_SCALE
            found.append(Alternative.of(own, cells, same_scale=same))
    return found[::-1], left_open


def _alike(pieces: list[Piece], weights: NDArray, agree: float) -> bool:
    """Whether all pieces have the same entries."""
    first, *others = (np.sort(weights[piece.edge_rows]) for piece in pieces)
    return all(
        len(other) == len(first) and (np.abs(other - first) <= agree * np.abs(first).max()).all() for other in others
    )


def _other(
    part: Numbering,
    weights: NDArray,
    errors: NDArray | None,
    c: float,
    own: Cells,
    agree: float,
    budget: Budget,
    *,
    unproved: bool,
) -> Found:
    """Other cells of one component, all readings tried; where there are too many, a few factors.

    With a few it is `unproved` that there are none, unless many pieces, or some in a ring, have one c that need not be
    the same.
    """
    try:
        readings = all_readings(part, weights, agree, budget)
        cells, factor = next((reading for reading in readings if reading[0] != own), (None, c))
        return cells, factor, False
    except TooManyError:
        pass
    # No search would settle these: what a cover finds names an example.
    left_open = unproved or len(part.vertices) > MOST_VERTICES or agree > NEARLY
    return *(_with_common_scale(part, weights, errors, c, searched=not left_open) or (None, c)), left_open


def _with_common_scale(
    part: Numbering, weights: NDArray, errors: NDArray | None, c: float, *, searched: bool
) -> tuple[Cells, float] | None:
    """A mesh with another c in which several cells agree that border no other; by a cover, or `searched` for."""
    n = len(part.vertices)
    shapes = Shapes.of(n, part.edges, _MOST_SHAPES) if n <= MOST_VERTICES else None
    if shapes is None or not len(shapes):
        return None
    reading = with_another_scale(part, weights, errors, c, _of_lone_cells(shapes, weights), searched=searched)
    if reading is None:
        return None
    return cells_of(reading, part), next(mesh.scale for mesh in reading.meshes if mesh)


def _of_lone_cells(shapes: Shapes, weights: NDArray) -> list[float]:
    """The c that right angles, triangles and crosses that border no other cell have at several places."""
    sign = float(np.sign(weights.sum()))
    a, b, d = (sign * weights)[shapes.sides[:, :3]].T
    right = np.flatnonzero(shapes.corner & (a > 0) & (b > 0))
    form = a * b + b * d + d * a
    whole = np.flatnonzero(shapes.stored[:, 2] & (shapes.size == 3) & (form > 0))
    values = 2 * np.sqrt(np.append((a * b)[right], form[whole]))
    places = np.append(shapes.vertices[right, 1], shapes.n_vertices + whole)
    crossed = Crosses.of(shapes.n_vertices, shapes.edges, weights).scale
    common = common_values(values, places, _AGREE)[:_MOST_SCALES]
    tiles = _of_tiles(shapes.n_vertices, shapes.edges, sign * weights)
    return [sign * float(c) for c in (*common, *tiles) if c] + ([] if crossed is None else [crossed])


def _of_tiles(n: int, edges: NDArray, weights: NDArray) -> list[float]:
    """The c that several long faces of a drawing have as congruent cells.

    Congruent cells give an edge between two of them twice what they give one at the boundary: a weight that is the
    double of another one is shared equally. Right triangles cut from a tiling by octagons have a common c as well.
    """
    size = np.sort(weights)
    near = size[np.minimum(np.searchsorted(size, weights / 2 * (1 - _AGREE)), len(size) - 1)]
    share = np.where(np.abs(2 * near - weights) < _AGREE * np.abs(weights), weights / 2, weights)  # stored zeros, too
    found = []
    for drawing in face_complexes(n, edges):
        blocks = drawing.split()
        faces = np.flatnonzero(blocks.simple & (blocks.size > _SHORT))
        if len(faces):
            values = scales_of_faces(blocks, 2 * share, faces)
            found += common_values(values, faces, _AGREE)[:_MOST_SCALES].tolist()
    return found
