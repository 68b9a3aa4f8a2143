"""Linear equations between the matrix of a structure and the coordinates of its nodes.

A rigid rotation w moves node j by w x x_j and turns it by w, and costs nothing. So in every row r away from supports

    sum_j  A[r, displacements of j] (w x x_j)  =  - sum_j A[r, rotations of j] w        for each axis w:

linear in the coordinates, with a right-hand side: rotations are angles, and so the coordinates come out in true units
of length. Whatever the elements are, beams, plates or shells, of any section and any material.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .nodes import Nodes


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations for coordinates, each relative to the size of its coefficients.

    Attributes
    ----------
    operator : (m, n dim) sparse
    right : (m,) float64
    size : (m,) float64
        What the equation was divided by.
    lever : (m,) float64
        Sum of the terms of the right-hand side, without signs.
    row : (m,) int64
        Row ``i b + k`` of direction k of node i.
    rotation : (m,) int64
        Which of the layout's rotations it is.
    """

    operator: sp.csr_array
    right: NDArray[np.float64]
    size: NDArray[np.float64]
    lever: NDArray[np.float64]
    row: NDArray[np.int64]
    rotation: NDArray[np.int64]

    def __getitem__(self, which: NDArray) -> Equations:
        """Some of the equations, by their indices or a mask."""
        return Equations(*(getattr(self, one.name)[which] for one in fields(self)))


def equations(nodes: Nodes, valid: NDArray[np.bool_]) -> Equations:
    """Collect the valid equations, without those that have no coefficients.

    Parameters
    ----------
    nodes : Nodes
    valid : (n, b, rotations) bool
        See :meth:`.nodes.Nodes.whole`.
    """
    parts = [_rotation(nodes, k, np.flatnonzero(valid[:, :, k])) for k in range(valid.shape[2])]
    joined = [[getattr(part, one.name) for part in parts] for one in fields(Equations)]
    return Equations(sp.vstack(joined[0], format="csr"), *map(np.concatenate, joined[1:]))


def _rotation(nodes: Nodes, k: int, used: NDArray[np.int64]) -> Equations:
    """Equations of some rows for rotation k."""
    layout, order = nodes.layout, nodes.matrix.shape[0]
    rows, columns, values = [], [], []
    for direction, coordinate, sign in layout.turned(layout.rotations[k]):
        part = nodes.direction(direction).tocoo()
        rows.append(part.row)
        columns.append(part.col * layout.dim + coordinate)
        values.append(sign * part.data)
    place = np.concatenate(rows), np.concatenate(columns)
    operator = sp.csr_array((np.concatenate(values), place), shape=(order, nodes.n * layout.dim))
    own = nodes.direction(len(layout.displacements) + k)
    right, lever, size = (np.asarray(part.sum(axis=1)).ravel() for part in (-own, abs(own), abs(operator)))
    used = used[size[used] > 0]
    size = size[used]
    scaled = sp.csr_array(sp.diags_array(1 / size) @ operator[used])
    return Equations(scaled, right[used] / size, size, lever[used] / size, used, np.full(len(used), k))
