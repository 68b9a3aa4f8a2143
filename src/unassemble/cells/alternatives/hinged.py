"""Pieces that hang together by vertices and might as well be one, with right angles between them.

Let p pieces be joined in the manner of a tree, each with as many entries as unknowns. With a right angle at every hinge
they are one piece, again with as many entries as unknowns, so that its map fits with a factor c of its own wherever
its triangles come out positive. That all pieces have one c is p - 1 numbers that coincide, and speaks for them, but
the one piece gives back the same entries.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, pairwise, product

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...planar.hinges import groups
from ...topology import Piece, Topology
from ...topology.faces import joined
from .corners import Alternative, cell
from .loose import MOST_TRIALS, SURE, fits_as_one, is_loose

FEW_PIECES = 6
"""Loose pieces in a tree whose common c is no proof; that of more is a coincidence too many."""

_MOST_GROUPS = 300  # that are tried; most fit at the first trial or two


def as_one_piece(
    stored: OperatorMatrix, topology: Topology, closed: NDArray[np.int64], supposed: NDArray[np.int64]
) -> list[Alternative]:
    """One alternative for each group of pieces that also fits as one piece.

    Where not all can be tried, or the group is too large to be solved well, the first stands for them, untested;
    after 300 groups the next one does for the others.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    closed : (n,) int64
        1 for rows that four right angles surround.
    supposed : (k,) int64
        Rows with right angles whose far sides have vanished. Where there are any in one piece, those of more than a few
        pieces are as likely.
    """
    if not len(topology.hinges):
        return []
    label = groups(topology)
    order = np.argsort(label, kind="stable")
    members = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    right = np.zeros(stored.n, dtype=bool)
    right[supposed] = True
    found: list[Alternative] = []
    tried = 0
    for numbers in members:
        pieces = [topology.pieces[k] for k in numbers.tolist()]
        few = len(pieces) <= FEW_PIECES or any(right[piece.vertices].any() for piece in pieces)
        if len(pieces) > 1 and few and _is_loose_tree(pieces, closed):
            tried += 1
            found += _first_that_fits(stored, pieces, most=MOST_TRIALS if tried <= _MOST_GROUPS else 0)
            if found and tried > _MOST_GROUPS:
                break
    return found


def in_a_tree(pieces: list[Piece]) -> bool:
    """Whether pieces that hang together make no ring."""
    count = sum(piece.n_vertices for piece in pieces)
    return len(np.unique(np.concatenate([piece.vertices for piece in pieces]))) == count - len(pieces) + 1


def _is_loose_tree(pieces: list[Piece], closed: NDArray[np.int64]) -> bool:
    """Whether each piece has as many entries as unknowns, and no ring of pieces is closed."""
    return in_a_tree(pieces) and all(is_loose(piece, closed) for piece in pieces)


def _first_that_fits(stored: OperatorMatrix, pieces: list[Piece], most: int) -> list[Alternative]:
    triangles = np.concatenate([piece.vertices[piece.triangles] for piece in pieces])
    trials = list(islice(_joinings(stored, pieces), most + 1))
    if trials and len(triangles) > SURE:
        return [replace(trials[0], tested=False)]
    for trial in trials[:most]:
        if fits_as_one(stored, np.concatenate([triangles, np.array(trial.other_cells)]), trial.around):
            return [trial]
    return [replace(trials[0], tested=False)] if len(trials) > most else []


def _joinings(stored: OperatorMatrix, pieces: list[Piece]) -> Iterator[Alternative]:
    """Right angles that join all of the pieces, at every hinge from each piece to the next."""
    vertex = np.concatenate([piece.vertices for piece in pieces])
    rows, count = np.unique(vertex, return_counts=True)
    places = []
    for h in rows[count > 1].tolist():
        sides = [_stored_sides(stored, piece, h) for piece in pieces if h in piece.vertices]
        for one, other in pairwise(sides):
            pairs = [frozenset((a, b)) for a in one for b in other]
            places.append([cell(h, pair) for pair in pairs if not _joined(stored, pair)])
    hinges = tuple(rows[count > 1].tolist())
    for chosen in product(*places):
        yield Alternative(hinges, hinges, hinges, (), chosen, same_scale=False)


def _stored_sides(stored: OperatorMatrix, piece: Piece, h: int) -> list[int]:
    """Neighbours of h along the boundary of a piece, those on edges that have an entry."""
    ends = piece.vertices[piece.boundary]
    near = np.unique(ends[(ends == h).any(axis=1)])
    return [a for a in near.tolist() if a != h and _joined(stored, frozenset((a, h)))]


def _joined(stored: OperatorMatrix, pair: frozenset[int]) -> bool:
    a, b = (np.array([row]) for row in pair)
    return bool(joined(stored.n, stored.edges, a, b)[0])
