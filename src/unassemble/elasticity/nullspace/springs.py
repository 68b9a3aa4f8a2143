"""Springs between nodes: what they say of positions, which is nothing.

A spring adds a block S to the rows of its two nodes, and takes it off between them. In the identities it stands for
S (x_i - x_j), which vanishes for nodes in one place and is wrong for all others, since no linear field knows a spring.
So a node that hangs on springs alone would be drawn onto its neighbours; it has no position.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..nodal import NodalMatrix, determined

_PARALLEL = 1e-14  # squared sine of the angle between blocks, up to which they are multiples of one
_APART = 1e-7  # of the mean edge length, up to which two nodes lie in one place


def without_springs(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NodalMatrix, NDArray[np.bool_]]:
    """The matrix without nodes all of whose blocks are multiples of one, and which rows are valid then.

    The rows of such a node are d equations at most, as many as it has coordinates. Those of elements are not: two nodes
    of an element have another block each. Without them the rows of their neighbours are those of the body again.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) or (n, d, d, d) bool
    """
    i, j = nodal.node, nodal.indices
    spring = _of_one_block(nodal, i != j) & (nodal.row_of >= 0).all(axis=1)
    if not spring.any():
        return nodal, valid
    between = (i != j) & (spring[i] | spring[j])
    data = nodal.data.copy()
    own = np.flatnonzero(i == j)
    np.add.at(data, own[i[between]], data[between])
    data[between] = 0
    return replace(nodal, data=data), valid & ~spring.reshape(-1, *(1,) * (valid.ndim - 1))


def _of_one_block(nodal: NodalMatrix, some: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes with blocks, (nnz,) bool, that are not zero, all of them multiples of one block.

    Two random numbers of each block are a vector in the plane; vectors of parallel blocks are parallel.
    """
    d = nodal.dim
    weights = np.random.default_rng(0).standard_normal((d * d, 2))
    size = np.where(nodal.size > 0, nodal.size, 1.0)[nodal.node, None]
    u, v = (nodal.data.reshape(-1, d * d) / size @ weights * some[:, None]).T
    uu, uv, vv = (np.bincount(nodal.node, one, nodal.n) for one in (u * u, u * v, v * v))
    return np.asarray((uu * vv - uv**2 <= _PARALLEL * (uu + vv) ** 2) & (uu + vv > 0))


def drawn_together(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) nodes in the place of one that they are coupled to, without an identity of their own that says more.

    In the same place springs are all that couples them. A node of a body has whole rows that couple to nodes
    elsewhere, by blocks of elements; bodies in contact have nodes of that kind upon each other.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) or (n, d, d, d) bool
    points : (n, d) float64
        Mean edge length 1; NaN where not determined.
    """
    i, j, present = nodal.node, nodal.indices, nodal.row_of >= 0
    away = np.abs(points[i] - points[j]).max(axis=1)
    near = (away <= _APART) & (i != j) & (nodal.data != 0).any(axis=(1, 2))
    near &= (present[i] & present[j]).any(axis=1)  # those with no direction in common may be halves of one node
    found = np.zeros(nodal.n, dtype=bool)
    found[i[near]] = True
    if found.any():
        whole = valid.reshape(nodal.n, -1).all(axis=1)
        elsewhere = away > _APART
        several = (np.bincount(i, elsewhere, nodal.n) > 0) & ~_of_one_block(nodal, elsewhere)
        found &= ~(whole & several)
    return found & determined(points)
