"""Nodes in corners, where planes of rollers across all directions meet: not in the matrix, but known to elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .nodal import NodalMatrix


@dataclass(frozen=True, eq=False)
class Corner:
    """A node all of whose unknowns were taken out, since it lies in planes across all directions.

    Attributes
    ----------
    point : (d,) float64
    nodes : (k,) int64
        Nodes whose rows lack coefficients of it, increasing.
    """

    point: NDArray[np.float64]
    nodes: NDArray[np.int64]


def with_corner_nodes(nodal: NodalMatrix, corners: Sequence[Corner]) -> NodalMatrix:
    """The matrix with a node more for each corner, after all others: coupled to its neighbours by blocks of zeros.

    There is at least one.
    """
    n, d, many = nodal.n, nodal.dim, len(corners)
    near = np.concatenate([one.nodes for one in corners])
    new = n + np.repeat(np.arange(many), [len(one.nodes) for one in corners])
    own = n + np.arange(many)
    row = np.concatenate([nodal.node, near, new, own])
    column = np.concatenate([nodal.indices, new, near, own])
    order = np.lexsort((column, row))
    data = np.concatenate([nodal.data, np.zeros((len(row) - len(nodal.data), d, d))])
    return replace(
        nodal,
        indptr=np.concatenate([[0], np.cumsum(np.bincount(row))]).astype(np.int32),
        indices=column[order].astype(np.int32),
        data=data[order],
        row_of=np.vstack([nodal.row_of, np.full((many, d), -1)]),
        size=np.append(nodal.size, np.zeros(many)),
        penalised=np.vstack([nodal.penalised, np.zeros((many, d), dtype=bool)]),
        doubtful=None,
        blurred=None,
    )
