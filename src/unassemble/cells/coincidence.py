"""Where equal factors c of pieces are no evidence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Topology
from .doubt import components_of

_EQUAL = 1e-9
_FEW = 2  # sizes of entries: those of congruent cells, right triangles for one, on sides of two lengths


def coincident(stored: OperatorMatrix, topology: Topology) -> NDArray[np.bool_]:
    """(pieces,) pieces whose cells other cells may replace, since entries have few sizes.

    A piece with no more entries, vanished ones counted, than coordinates and c fits by itself. That several hang
    together and have one c is evidence, but not where they have it because they are alike. Congruent cells give an
    edge one of few numbers, or twice that if it lies between two of them: squares, and halves of squares, have the
    same c wherever they are put, and so have right triangles cut from the sides of a tiling by octagons.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    """
    part_of = components_of(stored)
    count = int(part_of.max()) + 1
    part = np.array([part_of[piece.vertices[0]] for piece in topology.pieces], dtype=np.int64)
    loose = np.array([piece.redundancy <= 0 for piece in topology.pieces], dtype=bool)
    several = np.bincount(part, minlength=count) > 1
    all_loose = np.bincount(part, ~loose, count) == 0
    few = _sizes(np.abs(stored.entries), part_of[stored.edges[:, 0]], count) <= _FEW
    return np.asarray(several[part] & all_loose[part] & few[part])


def _sizes(entries: NDArray, owner: NDArray, count: int) -> NDArray[np.int64]:
    """(count,) different entries of each owner, one and its double counted once."""
    with np.errstate(divide="ignore"):
        log = np.log2(np.where(entries > 0, entries, np.nan))
    turn = log - np.floor(log)
    order = np.lexsort((turn, owner))
    turn, owner = turn[order], owner[order]
    first = np.diff(owner, prepend=-1) != 0
    new = first | (np.diff(turn, prepend=0.0) > _EQUAL)
    sizes = np.bincount(owner[new], minlength=count)
    # The largest part of a turn may be the smallest once more.
    last = np.append(first[1:], True)
    around = np.zeros(count, dtype=bool)
    around[owner[last]] = (turn[first] + 1 - turn[last] <= _EQUAL) & (turn[last] - turn[first] > 0.5)
    return np.asarray(sizes - around)
