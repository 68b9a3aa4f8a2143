"""A straight beam in the plane: bending apart from everything else, in rows that stand in any order.

A member of length l and stiffness k = EI / l^3 between nodes i and j, deflections w and rotations t = dw/dx, has

    A[w_i, w_j] = -12 k,   A[w_i, t_j] = 6 k l,   A[t_i, w_j] = -6 k l,   A[t_i, t_j] = 2 k l^2

(the cubic Hermite element; e.g. Zienkiewicz and Taylor, The Finite Element Method, vol. 1). Each block has two numbers
and four entries, and says by itself that it is one. Stretching and torsion are chains of springs beside it, which know
no length.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.grouping import by_first_row
from ..tolerances import ALIKE
from .layouts import ALONG_X
from .recognise import StructuralNumbering

MOST = 5  # entries of a bending row off the diagonal: four of the neighbours, one of its own node


def find_beam(matrix: sp.csr_array) -> StructuralNumbering | None:
    """Recognise the rows of one straight beam, in any order, of a symmetric matrix (N, N); None if they are not so.

    Directions are 1 (deflection), 2 (rotation), 0 (a chain of springs, in turn with the nodes), or -1: of further
    chains, and of what supports left at the ends.
    """
    order = matrix.shape[0]
    off = sp.csr_array(matrix - sp.diags_array(matrix.diagonal()))
    off.eliminate_zeros()
    if order < 4 or np.diff(off.indptr).max(initial=0) > MOST or (matrix.diagonal() <= 0).any():
        return None
    if not (off.data > 0).any():  # rotations of a member have a positive entry
        return None
    w, t = _members(off)
    deflections, partner = np.unique(w), np.full(order, -1)
    partner[w] = t
    rotations = partner[deflections]
    once = len(np.unique(rotations)) == len(rotations) > 0 and not np.isin(rotations, deflections).any()
    if not once or (partner[w] != t).any() or len(w) != len(deflections) - 1:  # each deflection has one rotation
        return None
    label = sp.csgraph.connected_components(off, directed=False)[1]
    bending = label == label[deflections[0]]
    direction = np.full(order, -1)
    direction[rotations], direction[deflections] = 2, 1
    ends, springs = bending & (direction < 0), np.flatnonzero(~bending)
    if not bending[deflections].all() or ends.sum() > 2 or (off[springs].data > 0).any():
        return None
    node = np.arange(order)
    node[rotations] = deflections
    told = np.flatnonzero(direction == 1)
    node[springs] = told[np.minimum(np.searchsorted(np.minimum(told, partner[told]), springs), len(told) - 1)]
    if len(np.unique(node[springs])) == len(springs):
        direction[springs] = 0
    return StructuralNumbering(by_first_row(node), direction, "pattern", float(np.mean(direction > 0)), ALONG_X)


def _members(off: sp.csr_array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Deflections (m, 2) and rotations (m, 2) of members whose blocks are whole, each once."""
    order, width = off.shape[0], MOST
    count = np.diff(off.indptr)
    row = np.repeat(np.arange(order), count)
    neighbours, values = np.full((order, width), -1), np.zeros((order, width))
    place = np.arange(len(row)) - off.indptr[row]
    neighbours[row, place], values[row, place] = off.indices, off.data
    down = (off.data < 0) & (row < off.indices)
    w, other_w, least = row[down], off.indices[down], off.data[down]
    # Every neighbour of w_i for t_j, and every one of w_j for t_i.
    a, b = (index.ravel() for index in np.meshgrid(np.arange(width), np.arange(width), indexing="ij"))
    other_t, right = neighbours[w][:, a], values[w][:, a]
    t, left = neighbours[other_w][:, b], values[other_w][:, b]
    lower, upper = np.maximum(t, 0), np.maximum(other_t, 0)
    corner = np.where((neighbours[lower] == other_t[..., None]) & (t >= 0)[..., None], values[lower], 0).sum(axis=-1)
    good = (t >= 0) & (other_t >= 0) & (t != w[:, None]) & (other_t != other_w[:, None]) & (corner > 0) & (t != other_t)
    good &= np.abs(left + right) <= ALIKE * np.abs(right)
    good &= np.abs(1.5 * corner * -least[:, None] - right**2) <= ALIKE * right**2
    k, which = np.nonzero(good)
    return np.column_stack([w[k], other_w[k]]), np.column_stack([lower[k, which], upper[k, which]])
