"""Linear equations between the matrix of a structure and the coordinates of its nodes.

A rigid rotation w moves node j by w x x_j and turns it by w, and costs nothing. So in every row r away from supports

    sum_j  A[r, displacements of j] (w x x_j)  =  - sum_j A[r, rotations of j] w        for each axis w:

linear in the coordinates, with a right-hand side: rotations are angles, and so the coordinates come out in true units
of length. Whatever the elements are, beams, plates or shells, of any section and any material.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CANCELLED
from .nodes import Nodes
from .straight import Straight


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations for coordinates, each relative to the size of its coefficients."""

    operator: sp.csr_array  # (m, n dim)
    right: NDArray[np.float64]
    size: NDArray[np.float64]  # what the equation was divided by
    lever: NDArray[np.float64]  # sum of the terms of the right-hand side, without signs
    # ``i b + k`` of direction k of node i; -1 for differences of two rows, and for what members tell
    row: NDArray[np.int64]
    rotation: NDArray[np.int64]  # which of the layout's rotations it is; -1 for what members tell
    mixed: NDArray[np.float64]  # a random right-hand side that depends as the rows of the matrix depend on each other

    def __getitem__(self, which: NDArray) -> Equations:
        """Some of the equations, by their indices or a mask."""
        return Equations(*(getattr(self, one.name)[which] for one in fields(self)))


def equations(nodes: Nodes, valid: NDArray[np.bool_], *, springs: bool, allowed: float = CANCELLED) -> Equations:
    """Collect the equations that are `valid`, (n, b, rotations); see :meth:`.nodes.Nodes.whole`.

    It can allow for `springs` between the rotations of a node and the ground, as programs add them where a flat shell
    has no stiffness against drilling. They add an unknown symmetric matrix to the three moments' rows; what is left are
    the differences of its two triangles. Coefficients that cancel up to what is `allowed`, relative to them, are none.
    """
    b, moves = nodes.layout.block_size, len(nodes.layout.displacements)
    every = [_rotation(nodes, k) for k in range(valid.shape[2])]
    forces = np.arange(nodes.n * b) % b < moves
    parts = [one[valid[:, :, k].ravel() & (forces | (not springs))] for k, one in enumerate(every)]
    for k, m in combinations(range(len(every)), 2) if springs else ():
        both = np.flatnonzero(valid[:, moves + m, k] & valid[:, moves + k, m]) * b + moves
        one, other = every[k][both + m], every[m][both + k]
        operator, right = sp.csr_array(one.operator - other.operator), one.right - other.right
        size, lever, row = one.size + other.size, one.lever + other.lever, np.full(len(both), -1)
        parts.append(Equations(operator, right, size, lever, row, one.rotation, one.mixed - other.mixed))
    return _relative(joined(*parts), allowed)


def joined(*parts: Equations) -> Equations:
    """All of these equations."""
    first, *rest = [[getattr(part, one.name) for part in parts] for one in fields(Equations)]
    return Equations(sp.csr_array(sp.vstack(first)), *map(np.concatenate, rest))


def told_by(members: Straight, nodes: Nodes) -> Equations:
    """What straight members tell: one position less the other."""
    d, m = nodes.layout.dim, members.vectors.size
    place = (members.ends[:, :, None] * d + np.arange(d)).transpose(0, 2, 1).reshape(m, 2)
    half = np.tile([0.5, -0.5], m), (np.repeat(np.arange(m), 2), place.ravel())
    right, unknown = members.vectors.ravel() / 2, np.full(m, -1)
    operator, mixed = sp.csr_array(half, shape=(m, nodes.n * d)), np.random.default_rng(0).standard_normal(m)
    return Equations(operator, right, np.ones(m), np.abs(right), unknown, unknown, mixed)


def _relative(given: Equations, allowed: float) -> Equations:
    """Equations relative to the size of their coefficients; those without any, or none but rounding, are left out.

    What comes in has the size of what the coefficients are differences of.
    """
    size = np.asarray(abs(given.operator).sum(axis=1)).ravel()
    tells = np.flatnonzero(size > allowed * given.size)
    some, size = given[tells], size[tells]
    operator = sp.csr_array(sp.diags_array(1 / size) @ some.operator)
    right, lever, mixed = some.right / size, some.lever / size, some.mixed / size
    return replace(some, operator=operator, right=right, size=size, lever=lever, mixed=mixed)


def _rotation(nodes: Nodes, k: int) -> Equations:
    """All rows' equation for rotation k, as it stands."""
    layout, order = nodes.layout, nodes.matrix.shape[0]
    operator = sp.csr_array((order, nodes.n * layout.dim))
    for direction, coordinate, sign in layout.turned(layout.turning[k]):
        axis = sp.csr_array(sign * np.eye(layout.dim)[[coordinate]])
        operator = operator + sp.kron(nodes.direction(direction), axis, format="csr")
    own = nodes.direction(len(layout.displacements) + k) if layout.rotations else sp.csr_array((order, nodes.n))
    right, lever, size = (np.asarray(part.sum(axis=1)).ravel() for part in (-own, abs(own), abs(operator)))
    stiffness = np.abs(nodes.matrix.diagonal())
    field = np.random.default_rng(k).standard_normal(order) / np.sqrt(np.where(stiffness > 0, stiffness, 1))
    return Equations(operator, right, size, lever, np.arange(order), np.full(order, k), nodes.matrix @ field)
