"""Loose pieces that hang together, read with another factor c.

Each of them fits by itself, and that all have one c is the only evidence. It is none where their entries are of a kind:
crossed rhombi of any shapes, for instance, are pairs of right triangles as well, all of them with one other c.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Topology, components
from .agreement import common_values
from .corners import Alternative, OrientedMesh
from .covering import MOST_VERTICES
from .hinged import all_loose
from .hubs import Hub
from .rereading import cells_of, own_cells, with_another_scale
from .shapes import Shapes

_MOST_SHAPES = 3000
_MOST_SCALES = 4
_AGREE = 1e-9


def other_scales(
    stored: OperatorMatrix, topology: Topology, mesh: OrientedMesh, factors: NDArray, hubs: list[Hub]
) -> list[Alternative]:
    """One alternative for each component of loose pieces that fits with another c in which its numbers agree.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    mesh : OrientedMesh
    factors : (n,) float64
        c of the piece of each row.
    hubs : list of Hub
        Vertices that right angles surround.
    """
    parts = []
    for part in components(stored.n, stored.edges):
        inside = np.zeros(stored.n, dtype=bool)
        inside[part.vertices] = True
        pieces = [piece for piece in topology.pieces if inside[piece.vertices[0]]]
        if len(part.vertices) <= MOST_VERTICES and len(pieces) > 1 and all_loose(pieces, hubs):
            parts.append(part)
    found = []
    for part, own in zip(parts, own_cells(stored.n, parts, mesh), strict=True):
        weights = -stored.entries[part.edge_rows]
        shapes = Shapes.of(len(part.vertices), part.edges, _MOST_SHAPES)
        scales = _of_right_angles(shapes, weights) if shapes is not None and len(shapes) else []
        reading = with_another_scale(part, weights, factors[part.vertices[0]], scales)
        if reading is not None:
            cells = cells_of(reading, part)
            gone, new = tuple(sorted(own - cells)), tuple(sorted(cells - own))
            found.append(Alternative((), (), (), gone, new, same_scale=False))
    return found


def _of_right_angles(shapes: Shapes, weights: NDArray) -> list[float]:
    """The c of right angles between two edges that border no other cell, if they are found at several vertices."""
    sign = float(np.sign(weights.sum()))
    one, other = (sign * weights)[shapes.sides[:, :2]].T
    usable = np.flatnonzero(shapes.corner & (one > 0) & (other > 0))
    values = 2 * np.sqrt(one[usable] * other[usable])
    return [sign * float(c) for c in common_values(values, shapes.vertices[usable, 1], _AGREE)[:_MOST_SCALES] if c]
