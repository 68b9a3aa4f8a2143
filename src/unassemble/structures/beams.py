"""A straight beam: bending apart from everything else, in nodes that form a line.

A member of length l and stiffness k = EI / l^3 between nodes i and j, deflections w and rotations t = dw/dx, has

    A[w_i, w_j] = -12 k,   A[w_i, t_j] = 6 k l,   A[t_i, w_j] = -6 k l,   A[t_i, t_j] = 2 k l^2

(the cubic Hermite element; e.g. Zienkiewicz and Taylor, The Finite Element Method, vol. 1). Each block has two numbers
and four entries, and says by itself that it is one: x_j - x_i = -2 A[w_i, t_j] / A[w_i, w_j]. So the row sums that
supports spoil are not needed. Stretching and torsion are chains of springs beside it, which know no length.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.anchoring import Request
from ..recovery import Evidence, Structure
from ..tolerances import ALIKE, CERTIFIED
from ..words import Reason, count_of
from .answer import answer, covered
from .layouts import PLANE
from .placed import Placed
from .recognise import StructuralNumbering
from .straight import entries_at

MOST = 5  # entries of a bending row off the diagonal: four of the neighbours, one of its own node


@dataclass(frozen=True, eq=False)
class Beam(StructuralNumbering):
    """Rows of a straight beam: directions 1 (deflection), 2 (rotation), 0 (one chain of springs) or -1 (several)."""

    members: NDArray[np.int64]  # (m, 2) nodes
    steps: NDArray[np.float64]  # (m,) x of the second node less that of the first


def find_beam(matrix: sp.csr_array) -> Beam | None:
    """Recognise the rows of one straight beam, in any order, of a symmetric matrix (N, N); None if they are not so."""
    order = matrix.shape[0]
    off = sp.csr_array(matrix - sp.diags_array(matrix.diagonal()))
    off.eliminate_zeros()
    if order < 4 or np.diff(off.indptr).max(initial=0) > MOST or (matrix.diagonal() <= 0).any():
        return None
    if not (off.data > 0).any():  # rotations of a member have a positive entry
        return None
    w, t, steps = _members(off)
    deflections, partner = np.unique(w), np.full(order, -1)
    partner[w] = t
    rotations = partner[deflections]
    node = np.full(order, -1)
    node[deflections] = node[rotations] = np.arange(len(deflections))
    direction = np.full(order, -1)
    direction[rotations], direction[deflections] = 2, 1
    once = len(np.unique(rotations)) == len(rotations) > 0 and not np.isin(rotations, deflections).any()
    if not once or (partner[w] != t).any():  # each deflection has one rotation
        return None
    members, steps = _with_ends(off, node, direction, node[w], steps)
    n = int(node.max()) + 1
    x = _along(n, members, steps)
    if len(members) != n - 1 or np.isnan(x).any():
        return None
    count, label = sp.csgraph.connected_components(off, directed=False)
    bending = np.unique(label[node >= 0])
    if len(bending) > 1 or (node[label == bending[0]] < 0).any():
        return None
    line = np.argsort(x)
    chains = [np.flatnonzero(label == one) for one in range(count) if one != bending[0]]
    if not all(_beside(off, chain, line, node) for chain in chains):
        return None
    if len(chains) == 1:
        direction[chains[0]] = 0
    renamed = np.unique(node, return_index=True)[1].argsort().argsort()  # by the first row of each
    share = float(np.mean(direction > 0))
    return Beam(PLANE, renamed[node], direction, "pattern", share, members=renamed[members], steps=steps)


def _members(off: sp.csr_array) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Deflections (m, 2) and rotations (m, 2) of members whose blocks are whole, each once, and x_j - x_i (m,)."""
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
    ends = np.column_stack([w[k], other_w[k]]), np.column_stack([lower[k, which], upper[k, which]])
    return *ends, -2 * right[k, which] / least[k]


def _with_ends(
    off: sp.csr_array,
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    members: NDArray[np.int64],
    steps: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Members, with those to nodes at the ends of which a support left the rotation only; `node` is told of these."""
    entry = off.tocoo()
    alone = (node[entry.row] < 0) & (entry.data > 0) & (direction[entry.col] == 2) & (node[entry.col] >= 0)
    for t, other_t, corner in zip(entry.row[alone], entry.col[alone], entry.data[alone], strict=True):
        columns, data = off[[t]].indices, off[[t]].data
        beside = columns[(node[columns] == node[other_t]) & (direction[columns] == 1)]
        if len(columns) == 2 and len(beside) == 1:
            coupling = float(data[columns == beside[0]][0])  # - 6 k l, with 2 k l^2 in the corner
            node[t], direction[t] = node.max() + 1, 2
            members = np.vstack([members, [node[t], node[other_t]]])
            steps = np.append(steps, -3 * corner / coupling)
    return members, steps


def _along(n: int, members: NDArray[np.int64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) positions along the beam, the first node's zero; NaN where nothing ties them to it."""
    tree = sp.csr_array((steps, members.T), shape=(n, n))
    both = sp.csr_array(tree - tree.T)
    order, before = sp.csgraph.breadth_first_order(abs(both), 0, directed=False)
    x = np.full(n, np.nan)
    x[0] = 0
    for k in order[1:]:
        x[k] = x[before[k]] + both[before[k], k]
    return x


def _beside(off: sp.csr_array, chain: NDArray[np.int64], line: NDArray[np.int64], node: NDArray[np.int64]) -> bool:
    """Give the rows of a chain of springs the nodes next to which they are numbered; False if it is no such chain."""
    part = sp.csr_array(off[chain][:, chain])
    degree = np.diff(part.indptr)
    in_line = degree.max(initial=0) <= 2 and degree.sum() == 2 * len(chain) - 2
    if len(chain) > len(line) or not in_line or (part.data > 0).any():
        return False
    path = chain[sp.csgraph.breadth_first_order(part, int(np.argmin(degree)), directed=False)[0]]
    rows = np.arange(len(node))
    middle = np.array([rows[node == k].mean() for k in line])
    starts = range(len(line) - len(path) + 1)
    ways = [(np.abs(p - middle[s : s + len(p)]).sum(), s, p) for p in (path, path[::-1]) for s in starts]
    _, start, path = min(ways, key=lambda way: way[:2])
    node[path] = line[start : start + len(path)]
    return True


def serve_beam(beam: Beam, request: Request) -> Structure:
    """Positions along a straight beam, in true units of length, and its members; errors as of :func:`serve_structure`.

    The axis is x and deflections are along y; the direction of the axis, which the sign of rotations tells where it is
    known, is free.
    """
    n, bending = beam.n_nodes, beam.direction_of_row > 0
    with request.clock("solve"):
        x = _along(n, beam.members, beam.steps)
        points = np.column_stack([x - x.mean(), np.zeros(n)])
    with request.clock("certify"):
        misfit, told = _held_against(request.matrix.csr(), beam, points[:, 0])
    evidence = Evidence(1, misfit, float("inf"), int(told.sum()))
    found = Placed(points, np.zeros(n, np.int64), (evidence,), told, np.zeros_like(told))
    certified = misfit <= CERTIFIED
    said = f"the bending rows differ from those of members along a line by {misfit:.1e} of the row's largest entry"
    if certified:
        whole = "bending members along a line give back the blocks of all neighbours, and the sums of rows between them"
        said = f"{whole}: {covered(told, bending)}"
    notes = ["a beam by itself lies along x, in a direction that is free"]
    if not bending.all():
        chains = count_of(int((~bending).sum()), "row")
        notes.append(f"{chains} of stretching or torsion know no length: they are taken for those of the nodes next to "
                     "which they are numbered")  # fmt: skip
    return answer(
        beam,
        request,
        found,
        ("certified" if certified else "uncertified", Reason(said)),
        edges=beam.members,
        uniqueness="proved",
        notes=notes,
        lines=np.sort(beam.members, axis=1),
        operator="plane frame",
        backward_error=misfit,
    )


def _held_against(matrix: sp.csr_array, beam: Beam, x: NDArray[np.float64]) -> tuple[float, NDArray[np.bool_]]:
    """Largest misfit of re-assembled bending rows, relative to the row's largest entry, and rows that were held.

    Entries between nodes count in all rows, those within a node where it has both its deflection and rotation, and
    they are what two members make of them: next to a support something more may be there.
    """
    order, n = matrix.shape[0], len(x)
    row_of = np.full((n, 2), -1)
    bending = np.flatnonzero(beam.direction_of_row > 0)
    row_of[beam.node_of_row[bending], beam.direction_of_row[bending] - 1] = bending
    i, j = beam.members.T
    length = x[j] - x[i]
    both = (row_of[i] >= 0).all(axis=1) & (row_of[j] >= 0).all(axis=1)
    stiffness = np.zeros(len(length))
    stiffness[both] = -entries_at(matrix, row_of[i[both], 0], row_of[j[both], 0]) / 12
    stiffness[~both] = entries_at(matrix, row_of[i[~both], 1], row_of[j[~both], 1]) / (2 * length[~both] ** 2)
    scale = np.stack([np.ones_like(length), length], axis=1)[:, [0, 1, 0, 1]]
    hermite = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    block = stiffness[:, None, None] * hermite * scale[:, :, None] * scale[:, None, :]
    rows = np.concatenate([row_of[i], row_of[j]], axis=1)
    k, a, b = np.nonzero((rows[:, :, None] >= 0) & (rows[:, None, :] >= 0))
    again = sp.csr_array((block[k, a, b], (rows[k, a], rows[k, b])), shape=(order, order))
    left_over = sp.coo_array(matrix - again)
    inner = np.bincount(beam.members.ravel(), minlength=n) == 2
    node = beam.node_of_row
    held = (node[left_over.row] != node[left_over.col]) | inner[node[left_over.row]]
    held &= (beam.direction_of_row[left_over.row] > 0) & (beam.direction_of_row[left_over.col] > 0)
    size = np.zeros(order)
    entry = matrix.tocoo()
    np.maximum.at(size, entry.row, np.abs(entry.data) * (entry.row != entry.col))
    misfit = np.abs(left_over.data[held]) / size[left_over.row[held]]
    return float(misfit.max(initial=0.0)), (beam.direction_of_row > 0) & inner[node]
