"""Whether a mesh has entries to spare, so that it would show if it were wrong: part of the certificate."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..tolerances import SINGULAR

_DENSE = 400  # triangles of a piece whose equations are counted by their rank


def without_spare_equations(
    edges: NDArray, points: NDArray, triangles: NDArray, *, known_scale: bool
) -> NDArray[np.int64]:
    """A row of each edge-connected piece that has no more equations than unknowns: that it fits proves nothing.

    A piece of n vertices has an equation for each side of its triangles, and 2 n - 4 unknown coordinates, and c. Those
    that touch in vertices have one c: told by any that has equations to spare, it is known to the others. Sides without
    an entry are zeros that were supposed, and what they say of each other is no evidence: as many equations are left
    out as vanishing sides depend on each other.

    `edges` (e, 2) are the pairs i < j of stored entries; `known_scale` tells whether c is given. Returns (k,) rows.
    """
    n = len(points)
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2) @ [n, 1]
    order = np.argsort(ends, kind="stable")
    first = np.append(True, np.diff(ends[order]) > 0)
    key, owner = ends[order[first]], order // 3
    beside = sp.coo_array(
        (np.ones((~first).sum()), (owner[:-1][~first[1:]], owner[1:][~first[1:]])), shape=2 * (len(triangles),)
    )
    count, piece = csgraph.connected_components(beside, directed=False)
    pieces_at = sp.coo_array(
        (np.ones(triangles.size), (triangles.ravel(), np.repeat(piece, 3))), shape=(n, count)
    ).tocsr()
    row, member = pieces_at.nonzero()
    any_row = np.zeros(count, dtype=np.int64)
    any_row[member] = row
    of_side = piece[owner[first]]
    spare = np.bincount(of_side, minlength=count) - (2 * np.bincount(member, minlength=count) - 4)
    known = np.append(np.sort(edges @ [n, 1]), -1)
    stored = known[np.searchsorted(known[:-1], key)] == key
    gone = np.bincount(of_side[~stored], minlength=count)
    for k in np.flatnonzero((gone > 0) & (spare - 1 <= gone)):
        own = triangles[piece == k]
        spare[k] -= _dependent(points, own, key[(of_side == k) & ~stored])
    if known_scale:
        return any_row[spare <= 0]
    group = csgraph.connected_components(pieces_at.T @ pieces_at, directed=False)[1]
    told = np.bincount(group, spare >= 2) > 0
    return any_row[~told[group] | (spare <= 0)]


def _dependent(points: NDArray, triangles: NDArray, gone: NDArray) -> int:
    """How many of the equations cot + cot' = 0 of vanished sides, by their keys, follow from the others.

    Their rank, by a dense decomposition; of large pieces a bound, since equations depend on each other where all sides
    that face a vertex have vanished, so that the angles about it add up to a full turn by themselves.
    """
    n = len(points)
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [n, 1]
    row = np.searchsorted(gone, ends)
    here = np.isin(ends, gone)
    if len(triangles) > _DENSE:
        facing, total = (np.bincount(triangles[some], minlength=n) for some in (here, np.ones_like(here)))
        return int(((facing == total) & (total > 2)).sum())
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    z = (points[vertices] - points[vertices].mean(axis=0)) @ [1, 1j]
    jacobian = np.zeros((len(gone), 2 * len(vertices)))
    for k in range(3):
        own, one, other = (local[here[:, k], (k + step) % 3] for step in range(3))
        u, w = z[one] - z[own], z[other] - z[own]
        # d log (w / u) = dw / w - du / u, whose imaginary part is the change of the angle.
        for at, change in ((other, 1 / w), (one, -1 / u), (own, 1 / u - 1 / w)):
            np.add.at(jacobian, (row[here[:, k], k], 2 * at), change.imag)
            np.add.at(jacobian, (row[here[:, k], k], 2 * at + 1), change.real)
    # Angles at both ends of a vanished side add up to pi: no sines are needed.
    return len(gone) - int(np.linalg.matrix_rank(jacobian, tol=SINGULAR))  # in angles over mean lengths
