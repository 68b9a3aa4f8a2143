"""Rows of nodes on rollers: of several nodes with the same neighbours those lack a direction that lie in a plane.

Where rollers take direction b out on a plane across b, a pattern has fewer rows of direction b than nodes. Once the
places of the nodes are known from their other rows, as many of them as lack a row share the coordinate x_b. The others
own the rows of direction b. That nodes lack a direction for no other reason is an assumption, as it is in
:mod:`.planes`; whether positions fit exactly with what it joins is seen afterwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..nodal import determined
from .patterns import by_direction

_APART = 1e-6  # of the mean edge length, up to which coordinates are one


def of_planes(
    points: NDArray[np.float64],
    gone: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    open_row: NDArray[np.bool_],
    *,
    ordered: bool,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after rows were joined to the only ones that are off the plane, and rows beyond doubt.

    Those are rows of patterns all of whose nodes have places, and lack the directions across whose planes they lie.

    Parameters
    ----------
    points : (n, d) float64
        Of nodes each of which may be some rows of one only; NaN where not known; mean edge length 1.
    gone : (n, d) bool
        Nodes that surely lack a direction.
    group, node, direction : (N,) int64
        Pattern, node and direction of each row.
    open_row : (N,) bool
        Rows that may belong to one node with others of their pattern.
    ordered : bool
        Whether the rows of each direction stand in the order of nodes.

    Returns
    -------
    node : (N,) int64
    settled : (N,) bool
    """
    n, d = points.shape
    row_of = np.full((n, d), -1)
    row_of[node, direction] = np.arange(len(node))
    known = determined(points)
    kind = np.full(n, -1)
    kind[node[open_row]] = group[open_row]
    order = np.argsort(kind, kind="stable")
    _, first = np.unique(kind[order], return_index=True)
    members = [some for some in np.split(order, first[1:]) if kind[some[0]] >= 0]
    inside = kind[node] >= 0  # nodes that have all their rows are no members
    rows = by_direction(group[inside], direction[inside], d, int(group.max()) + 1)
    label = np.arange(n)
    held = np.zeros((n, d), dtype=bool)
    for b in range(d):
        lacking = [int(known[some].sum() - rows[kind[some[0]], b]) for some in members]
        planes = np.concatenate(
            [points[gone[:, b] & known, b]]
            + [_shared(points[some[known[some]], b], count) for some, count in zip(members, lacking, strict=True)]
        )
        planes.sort()
        for some, count in zip(members, lacking, strict=True):
            here = some[known[some]]
            held[here, b] = _among(points[here, b], planes)
            off = here[~held[here, b]]
            loose = some[~known[some] & (row_of[some, b] >= 0)]
            if count > 0 and len(off) == rows[kind[some[0]], b]:
                owners = off[row_of[off, b] < 0]
                first_rows = _in_order(row_of[owners])
                alone = (row_of[loose] >= 0).sum(axis=1) == 1
                sure = len(owners) == 1 or (ordered and first_rows is not None)
                if alone.all() and len(owners) == len(loose) and sure:
                    label[loose[np.argsort(row_of[loose, b])]] = owners if first_rows is None else owners[first_rows]
    has = np.zeros((n, d), dtype=bool)
    has[label[node], direction] = True
    fits = np.zeros(n, dtype=bool)
    for some in members:
        nodes = label[some]
        fits[some] = (known[nodes] & (has[nodes] != held[nodes]).all(axis=1)).all()
    return label[node], fits[node] & open_row


def _shared(values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """The one value that exactly so many share, two at least; none where several are shared so."""
    if count < 2:
        return values[:0]
    values = np.sort(values)
    start = np.concatenate([[0], np.flatnonzero(np.diff(values) > _APART) + 1, [len(values)]])
    found = start[:-1][np.diff(start) == count]
    return values[found] if len(found) == 1 else values[:0]


def _among(values: NDArray[np.float64], planes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which values are those of planes, increasing."""
    return np.searchsorted(planes, values + _APART) > np.searchsorted(planes, values - _APART)


def _in_order(rows: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Nodes, of whose rows (k, d), in the order of a direction that all have; None where there is none."""
    common = np.flatnonzero((rows >= 0).all(axis=0))
    return np.argsort(rows[:, common[0]]) if len(common) and len(rows) else None
