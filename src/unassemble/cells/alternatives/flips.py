"""Parts between two vertices that can be turned over in the line through them.

Let u and v be vertices that two boundary loops share. The closed curve from u through one loop to v and through the
other back cuts the graph at u and v. Where it crosses cells, these are right-angled ones at u or v whose far sides
have vanished. The reflection of one side in the line uv is another mesh with the same matrix if at u and at v the
right angles on both sides of the line are mirror images of each other: then each edge gets from its new neighbour
what it got from the old one.
"""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from .corners import Alternative, Corners, cell


def turned_over(corners: Corners, z: NDArray, agree: float) -> list[Alternative]:
    """Pairs of vertices between which a part can be turned over; of several on a line those next to each other."""
    one, other = _symmetric(corners, z, agree)
    if not len(one):
        return []
    u = corners.apex[one]
    # The line of symmetry: it halves the angle between the part's outer edges.
    inner, outer = z[corners.second[one]] - z[u], z[corners.first[other]] - z[u]
    direction = np.sqrt(outer / inner + 0j) * inner
    direction /= np.abs(direction)
    direction = np.where((direction.imag < -agree) | ((np.abs(direction.imag) <= agree) & (direction.real < 0)),
                         -direction, direction)  # fmt: skip
    extent = float(np.abs(z[u] - z[u].mean()).max()) + float(np.abs(inner).max())
    offset = (np.conj(direction) * (z[u] - z[u].mean())).imag / extent
    loops = np.sort(np.column_stack([corners.loop[one], corners.loop[other]]), axis=1)
    keys = np.column_stack([loops, _clusters(np.angle(direction), agree), _clusters(offset, agree)])
    along = (np.conj(direction) * z[u]).real
    order = np.lexsort((along, *keys.T))
    found = []
    for a, b in pairwise(order):
        if u[a] != u[b] and (keys[a] == keys[b]).all():
            alternative = _difference(corners, (int(one[a]), int(other[a])), (int(one[b]), int(other[b])))
            if alternative is not None:
                found.append(alternative)
    return found


def _symmetric(corners: Corners, z: NDArray, agree: float) -> tuple[NDArray, NDArray]:
    """Pairs of right angles at one vertex, in different loops, that are each other's mirror images."""
    order = np.argsort(corners.apex, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(corners.apex[order])) + 1)
    pairs = [pair for group in groups if len(group) > 1 for pair in combinations(group.tolist(), 2)]
    if not pairs:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    one, other = np.array(pairs).T
    h = z[corners.apex[one]]
    lengths = [np.abs(z[row] - h) for row in (corners.second[one], corners.first[other], corners.first[one],
                                               corners.second[other])]  # fmt: skip
    size = np.max(lengths, axis=0)
    alike = np.maximum(np.abs(lengths[0] - lengths[1]), np.abs(lengths[2] - lengths[3])) <= agree * size
    alike &= corners.loop[one] != corners.loop[other]
    return one[alike], other[alike]


def _clusters(values: NDArray, agree: float) -> NDArray[np.int64]:
    """Labels of values that follow each other within the tolerance."""
    order = np.argsort(values)
    label = np.empty(len(values), dtype=np.int64)
    label[order] = np.cumsum(np.diff(values[order], prepend=values[order[:1]]) > 10 * agree)
    return label


def _difference(corners: Corners, at_u: tuple[int, int], at_v: tuple[int, int]) -> Alternative | None:
    cells, others, found, other, around = set(), set(), [], [], []
    for k, j in (at_u, at_v):
        h = int(corners.apex[k])
        p, q = int(corners.first[k]), int(corners.second[k])
        r, s = int(corners.first[j]), int(corners.second[j])
        cells |= {cell(h, frozenset((p, q))), cell(h, frozenset((r, s)))}
        others |= {cell(h, frozenset((p, r))), cell(h, frozenset((q, s)))}
        around.append(h)
        found += [q, r]
        other += [r, q]
    if cells == others:
        return None
    return Alternative(
        tuple(around), tuple(found), tuple(other), tuple(sorted(cells - others)), tuple(sorted(others - cells))
    )
