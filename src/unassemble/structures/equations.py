"""Linear equations between the matrix of a structure and the coordinates of its nodes.

A rigid rotation w moves node j by w x x_j and turns it by w, and costs nothing. So in every row r away from supports

    sum_j  A[r, displacements of j] (w x x_j)  =  - sum_j A[r, rotations of j] w        for each axis w:

linear in the coordinates, with a right-hand side: rotations are angles, and so the coordinates come out in true units
of length. Whatever the elements are, beams, plates or shells, of any section and any material.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .nodes import Nodes

_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations for coordinates, each relative to the size of its coefficients.

    Attributes
    ----------
    operator : (m, n dim) sparse
    right : (m,) float64
    trusting : (m,) bool
        Equations of moments, which hold only if no spring ties the rotation to the ground.
    """

    operator: sp.csr_array
    right: NDArray[np.float64]
    trusting: NDArray[np.bool_]


def equations(nodes: Nodes, valid: NDArray[np.bool_], *, springs: bool) -> Equations:
    """Collect the valid equations.

    Parameters
    ----------
    nodes : Nodes
    valid : (n, b, rotations) bool
        See :meth:`.nodes.Nodes.whole`.
    springs : bool
        Allow for springs between the rotations of a node and the ground, as programs add them where a flat shell has
        no stiffness against drilling. They add an unknown symmetric matrix to the three moments' rows; what is left
        are the differences of its two triangles.
    """
    layout = nodes.layout
    b, moves = layout.block_size, len(layout.displacements)
    fields = [_rotation(nodes, k) for k in range(len(layout.rotations))]
    direction = np.arange(nodes.n * b) % b
    parts, trusting = [], []
    for k, field in enumerate(fields):
        for moments in (False,) if springs else (False, True):
            used = valid[:, :, k].ravel() & ((direction >= moves) == moments)
            parts.append(_relative(*_rows(field, used)))
            trusting.append(np.full(len(parts[-1][1]), moments))
    for k, m in combinations(range(len(fields)), 2) if springs else ():
        both = np.flatnonzero(valid[:, moves + m, k] & valid[:, moves + k, m]) * b + moves
        one, other = _rows(fields[k], both + m), _rows(fields[m], both + k)
        parts.append(_relative(one[0] - other[0], one[1] - other[1], _size(one[0]) + _size(other[0])))
        trusting.append(np.zeros(len(parts[-1][1]), dtype=bool))
    return Equations(
        sp.vstack([operator for operator, _ in parts], format="csr"),
        np.concatenate([right for _, right in parts]),
        np.concatenate(trusting),
    )


_Rows = tuple[sp.csr_array, NDArray[np.float64]]


def _rows(field: _Rows, which: NDArray) -> _Rows:
    rows = np.flatnonzero(which) if which.dtype == bool else which
    return sp.csr_array(field[0][rows]), field[1][rows]


def _size(operator: sp.csr_array) -> NDArray[np.float64]:
    return np.asarray(abs(operator).sum(axis=1)).ravel()


def _relative(operator: sp.csr_array, right: NDArray, terms: NDArray | None = None) -> _Rows:
    """Equations relative to the size of their coefficients; those without any, or none but rounding, are left out.

    `terms` is the size of what the coefficients are differences of.
    """
    size = _size(operator)
    tells = np.flatnonzero(size > _ROUNDING * (size if terms is None else terms))
    return sp.csr_array(sp.diags_array(1 / size[tells]) @ operator[tells]), right[tells] / size[tells]


def _rotation(nodes: Nodes, k: int) -> _Rows:
    """All rows' equation for rotation k: coefficients (n b, n dim) and right-hand side."""
    layout, shape = nodes.layout, (nodes.matrix.shape[0], nodes.n * nodes.layout.dim)
    rows, columns, values = [], [], []
    for direction, coordinate, sign in layout.turned(layout.rotations[k]):
        part = nodes.direction(direction).tocoo()
        rows.append(part.row)
        columns.append(part.col * layout.dim + coordinate)
        values.append(sign * part.data)
    operator = sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
    own = nodes.direction(len(layout.displacements) + k)
    return operator, -np.asarray(own.sum(axis=1)).ravel()
