"""Drawings in which a part of the graph between two vertices is turned over (Whitney's 2-isomorphisms).

Let two faces f and g pass both u and v. The closed curve through f from u to v and back through g cuts the graph into
two parts, that meet in u and v only. With one of them turned over the graph is drawn as well: instead of f and g it
has the two faces that the sides of the parts make crosswise, all others stay.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from .faces import FaceComplex


@dataclass(frozen=True, eq=False)
class Turn:
    """A part that can be turned over.

    Attributes
    ----------
    at_u, at_v : (2,) int64
        Half-edges of f and of g that arrive at u, and at v.
    old, new : tuple of tuple of int
        Vertices of f and g, and of the faces in their place, in running order.
    halves : tuple of tuple of int
        Half-edges of f and g on the way round each of the new faces, in any order.
    """

    at_u: NDArray[np.int64]
    at_v: NDArray[np.int64]
    old: tuple[tuple[int, ...], tuple[int, ...]]
    new: tuple[tuple[int, ...], tuple[int, ...]]
    halves: tuple[tuple[int, ...], tuple[int, ...]]


def turns(drawing: FaceComplex) -> Iterator[Turn]:
    """All that change a face, of a drawing none of whose faces passes a vertex twice (see FaceComplex.split).

    Blocks may have several vertices in common; faces of two of them have no part between them.
    """
    arriving: dict[int, dict[int, int]] = defaultdict(dict)  # half-edges by the vertex at their heads and their face
    at: dict[tuple[int, int], list[int]] = defaultdict(list)  # faces by block and vertex
    places = zip(drawing.head.tolist(), drawing.face.tolist(), drawing.block.tolist(), strict=True)
    for half, (vertex, face, block) in enumerate(places):
        arriving[vertex][face] = half
        at[block, vertex].append(face)
    common: dict[tuple[int, int], list[int]] = defaultdict(list)
    for (_, vertex), faces in at.items():
        if len(faces) < 3:
            continue  # inside a path, which may as well be longer
        for pair in combinations(sorted(faces), 2):
            common[pair].append(vertex)
    walks = [walk.tolist() for walk in np.split(drawing.order, drawing.offsets[1:-1])]
    for (f, g), vertices in common.items():
        for u, v in combinations(vertices, 2):
            at_u, at_v = ([arriving[w][f], arriving[w][g]] for w in (u, v))
            # Sides of the parts: of f from u to v and on to u, of g from v to u and on to v.
            sides = [*_halves(walks[f], at_u[0], at_v[0]), *_halves(walks[g], at_v[1], at_u[1])]
            if any({h ^ 1 for h in one} == set(other) for one, other in (sides[::2], sides[1::2])):
                continue  # a path
            inside, outside, back, forth = ([int(drawing.tail[h]) for h in side] for side in sides)
            yield Turn(
                np.array(at_u),
                np.array(at_v),
                (tuple(inside + outside), tuple(back + forth)),
                ((*outside, u, *back[:0:-1]), (*forth, v, *inside[:0:-1])),
                ((*sides[1], *sides[2]), (*sides[3], *sides[0])),
            )


def _halves(walk: list[int], first: int, second: int) -> tuple[list[int], list[int]]:
    """What follows one half-edge of a face until another, and what follows that one until the first."""
    i, j = walk.index(first) + 1, walk.index(second) + 1
    if i <= j:
        return walk[i:j], walk[j:] + walk[:i]
    return walk[i:] + walk[:j], walk[j:i]


def turned_over(drawing: FaceComplex, turn: Turn) -> FaceComplex:
    """The drawing with the part on the left of the way from u to v through f turned over."""
    succ, m = drawing.successor, len(drawing.successor)
    cut = np.concatenate([turn.at_u, turn.at_v])
    rows = np.arange(m)
    uncut = np.setdiff1d(rows, cut)
    graph = sp.coo_array(
        (np.ones(m + len(uncut), np.int8), (np.r_[rows, uncut], np.r_[rows ^ 1, succ[uncut]])), shape=(m, m)
    )
    label = csgraph.connected_components(graph, directed=False)[1]
    (uf, ug), (vf, vg) = turn.at_u, turn.at_v
    part = label == label[succ[uf]]
    new = succ.copy()
    inner = np.setdiff1d(np.flatnonzero(part), cut)
    new[succ[inner] ^ 1] = inner ^ 1
    new[uf], new[succ[vg] ^ 1] = ug ^ 1, succ[vf]
    new[vg], new[succ[uf] ^ 1] = vf ^ 1, succ[ug]
    return FaceComplex(drawing.n_vertices, drawing.edges, new)
