"""Where equal factors c of pieces are no evidence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Topology
from .doubt import components_of

_EQUAL = 1e-9


def coincident(stored: OperatorMatrix, topology: Topology, agree: float = 0.0) -> NDArray[np.bool_]:
    """(pieces,) pieces whose cells other cells may replace, since all entries are equal.

    A piece with no more entries, vanished ones counted, than coordinates and c fits by itself. That several hang
    together and have one c is evidence, but not where all entries of the component are equal: squares, and halves of
    squares, have the same c wherever they are put.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    agree : float
        Relative difference of equal entries that noise may cause.
    """
    label = components_of(stored)
    count = int(label.max()) + 1
    lowest, highest = np.full(count, np.inf), np.full(count, -np.inf)
    owner = label[stored.edges[:, 0]]
    np.minimum.at(lowest, owner, stored.entries)
    np.maximum.at(highest, owner, stored.entries)
    part = np.array([label[piece.vertices[0]] for piece in topology.pieces], dtype=np.int64)
    loose = np.array([piece.redundancy <= 0 for piece in topology.pieces], dtype=bool)
    alike = (highest - lowest)[part] <= max(_EQUAL, agree) * np.abs(highest[part])
    several = np.bincount(part, minlength=count) > 1
    all_loose = np.bincount(part, ~loose, count) == 0
    return np.asarray(alike & several[part] & all_loose[part])
