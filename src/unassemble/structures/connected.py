"""Pieces that linear equations hold together."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


class Piece(NamedTuple):
    """Equations that share no node with others."""

    nodes: NDArray[np.int64]  # (k,), increasing
    rows: NDArray[np.int64]  # (m,) of the equations of all pieces
    operator: sp.csr_array  # (m, k d)
    edges: NDArray[np.int64]  # (e, 2) coupled nodes, by their place in `nodes`


def pieces(
    operator: sp.csr_array, d: int, edges: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> Iterator[Piece]:
    """Connected pieces, in the order of their first nodes, of equations (m, n d); nodes in no equation are in none.

    The work is that of one pass over the equations, however many pieces there are. Coupled nodes, `edges` (e, 2), of
    different pieces are left out; `rows` (k,) are the equations to use, all by default.
    """
    rows = np.arange(operator.shape[0]) if rows is None else rows
    operator = sp.csr_array(operator[rows])
    m, n = operator.shape[0], operator.shape[1] // d
    node = operator.indices // d
    row = np.repeat(np.arange(m), np.diff(operator.indptr))
    incidence = sp.csr_array((np.ones(len(node), np.int8), (row, m + node)), shape=(m + n, m + n))
    count, label = sp.csgraph.connected_components(incidence, directed=False)
    of_row, of_node = label[:m], label[m:]
    inside = edges[of_node[edges[:, 0]] == of_node[edges[:, 1]]]
    bodies, equations, links = (_groups(one, count) for one in (of_node, of_row, of_node[inside[:, 0]]))
    place = np.empty(n, np.int64)
    for body in bodies:
        place[body] = np.arange(len(body))
    used = [k for k in range(count) if len(bodies[k]) and len(equations[k])]
    for k in sorted(used, key=lambda k: bodies[k][0]):
        part = sp.csr_array(operator[equations[k]])
        columns = place[part.indices // d] * d + part.indices % d
        local = sp.csr_array((part.data, columns, part.indptr), shape=(len(equations[k]), len(bodies[k]) * d))
        yield Piece(bodies[k], rows[equations[k]], local, place[inside[links[k]]])


def _groups(label: NDArray, count: int) -> list[NDArray[np.int64]]:
    """Indices of each label, increasing."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
