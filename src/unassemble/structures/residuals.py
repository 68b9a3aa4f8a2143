"""What the positions of a structure leave of the matrix they were found from, before they are written.

Forces under rigid rotations, and blocks of straight members, by formulas that finding has in common; redrawn rounding
is measured by them. The certificate has others. The couplings of nodes show whether their rows were joined rightly.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.constants import row_sizes
from ..nodes.nodal import determined
from ..tolerances import ALIKE, CANCELLED, CERTIFIED
from .layouts import PLANE, Layout
from .members import balanced
from .nodes import Nodes
from .recognise import StructuralNumbering
from .straight import Straight, misfits


def forces(
    matrix: sp.csr_array,
    numbering: StructuralNumbering,
    nodes: Nodes,
    points: NDArray[np.float64],
    valid: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Forces (k,) that rigid rotations of the nodes bring about, with their signs, relative to what makes them up.

    That is bounded, without signs, by nodes that move by their distance from the centroid and turn by one: about
    single axes both may be nothing but rounding. Rows of the given matrix whose direction is -1 do not move; those that
    touch nodes without coordinates do not count, of the others those and the rotations that are `valid`, by node. With
    rows (N,) one of whose forces counts.
    """
    layout, node_of_row, direction_of_row = numbering.layout, numbering.node_of_row, numbering.direction_of_row
    counted = np.zeros((len(node_of_row), len(layout.turning)), dtype=bool)
    counted[nodes.row_of[nodes.present]] = valid[nodes.present]
    moves = len(layout.displacements)
    known, moving = determined(points), direction_of_row >= 0
    motions = layout.rigid_motions(np.where(known[:, None], points, 0.0))[:, :, moves:]
    force = matrix @ (motions[node_of_row, direction_of_row] * moving[:, None])
    lever = np.where(direction_of_row < moves, np.linalg.norm(points, axis=1)[node_of_row], 1.0)
    size = abs(matrix) @ np.where(moving & known[node_of_row], lever, 0.0)
    touched = abs(matrix) @ (~known[node_of_row]).astype(float) > 0
    used = counted & (~touched & (size > 0))[:, None]
    return (force / np.where(size > 0, size, 1)[:, None])[used], used.any(axis=1)


def members_misfits(
    members: Straight, layout: Layout, points: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Ends (k, 2) of straight members, and how far each block is from that of one between the points, part by part."""
    some = determined(points)[members.ends].all(axis=1)
    ends = members.ends[some]
    return ends, misfits(members.blocks[some], points[ends[:, 1]] - points[ends[:, 0]], layout)


def mispaired(
    nodes: Nodes, points: NDArray[np.float64], inner: NDArray[np.bool_], allowed: float
) -> tuple[int, int] | None:
    """Two nodes that are not coupled as elements couple them, if there are any.

    The equations for coordinates add up the columns of each direction, and so hardly tell which row of one direction
    and which of another are one node's. The couplings do: elements join whole nodes, so that two nodes meet in several
    directions or in none. In space each coordinate acts on two directions, which contradict each other where their rows
    are not one node's; the coordinates of a plate act on one direction. Those of a plane frame have a direction each,
    so that all depends on the pairing: its nodes have to be joined by members, and no two of them to have the same
    neighbours. What was condensed joins the nodes next to it otherwise; these need a member to another node. `inner`
    (n,) are nodes whose forces are touched neither by supports nor by what was condensed.
    """
    n, b = nodes.n, nodes.layout.block_size
    coo, size = nodes.matrix.tocoo(), np.minimum(np.abs(nodes.matrix.diagonal()), row_sizes(nodes.matrix))
    real = np.abs(coo.data) > CANCELLED * np.sqrt(size[coo.row] * size[coo.col])  # penalties are no measure
    (i, one), (j, other) = np.divmod(coo.row[real], b), np.divmod(coo.col[real], b)
    near, meeting = _counts(i, j, n), _counts(i[one == other], j[one == other], n)
    first, second = sp.triu(near, 1).nonzero()
    shared = (nodes.present[first] & nodes.present[second]).sum(axis=1)
    known = determined(points)
    strange = np.asarray(meeting[first, second]).ravel() < np.minimum(shared, 2)
    if not nodes.layout.rotations:  # bars along an axis have one direction
        strange &= ~balanced(nodes, points, first, second, allowed)[0]
    if nodes.layout == PLANE:
        pattern = (near > 0).astype(np.int32)
        degree, common = np.diff(near.indptr), np.asarray((pattern @ pattern)[first, second]).ravel()
        twins = (common == degree[first]) & (common == degree[second])
        balances, whole = balanced(nodes, points, first, second, allowed)
        joined = np.zeros(n, dtype=bool)
        joined[first[whole & balances]] = joined[second[whole & balances]] = True
        excused = ~inner[first] & ~inner[second] & joined[first] & joined[second]
        strange |= twins | (whole & ~balances & ~excused)
    strange &= known[first] | known[second]
    k = np.argmax(strange) if strange.any() else None
    return None if k is None else (int(first[k]), int(second[k]))


def next_to_gaps(row_of: NDArray[np.int64], untold: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, b) rows by node that may be those of the next node or of the one before.

    Where rows stand node by node and some are missing, the first row of a node may have been taken for the last one of
    the node before, or the other way round. Then that one is left with fewer rows, whose directions are `untold` (N,).
    """
    beside = np.zeros(len(untold), dtype=bool)
    beside[1:] |= untold[:-1]
    beside[:-1] |= untold[1:]
    return np.asarray((row_of >= 0) & beside[row_of])


def shown(nodes: Nodes, members: Straight, points: NDArray[np.float64], valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, b) rows of nodes that equations show to be theirs, and of their direction.

    A row that annihilates translations shows it: its own entry takes part in that if it is a displacement, and does not
    if it is a rotation. So does an entry in a force on another node that vanishes under a rotation, `valid` (n, b,
    rotations), or in the block of a straight member; by so much that others in its place would be noticed, ten times of
    what certificates allow.
    """
    n, b, moves = nodes.n, nodes.layout.block_size, len(nodes.layout.displacements)
    known, least = determined(points), 10 * CERTIFIED
    columns = [nodes.direction(k) for k in range(moves)]
    sums = np.column_stack([np.asarray(part.sum(axis=1)).ravel() for part in columns])
    size = np.column_stack([np.asarray(abs(part).sum(axis=1)).ravel() for part in columns])
    told = (np.abs(sums) <= CANCELLED * size).all(axis=1) & size.any(axis=1)
    entry = nodes.matrix.tocoo()
    size = np.zeros((n * b, 1))  # about all axes together, as forces are measured: about one they may be rounding
    terms = []
    for k in range(b):
        some = (entry.col % b == k) & known[entry.row // b] & known[entry.col // b]
        row, column = entry.row[some], entry.col[some]
        motion = nodes.layout.rigid_motions(points[column // b] - points[row // b])[:, k, moves:]
        term = np.abs(entry.data[some, None] * motion)
        np.add.at(size, row, term.sum(axis=1, keepdims=True))
        terms.append((row, column, term))
    for row, column, term in terms:
        counts = (term > least * size[row]) & valid.reshape(n * b, -1)[row] & (row // b != column // b)[:, None]
        told[column[counts.any(axis=1)]] = True
    for side, block in enumerate((members.blocks, members.blocks.transpose(0, 2, 1))):
        for part in (slice(moves), slice(moves, None)):
            large = np.abs(block[:, part]).max(axis=2, initial=0.0)
            some = large > least * large.max(axis=1, initial=0.0)[:, None]
            told[(members.ends[:, side, None] * b + np.arange(b)[part])[some]] = True
    return np.asarray(told.reshape(n, b))


def in_one_place(nodes: Nodes, points: NDArray[np.float64], allowed: float) -> tuple[int, int] | None:
    """Two coupled nodes without a distance that are not known to have none; None if there are no such nodes.

    Of a plate, a plane frame or a beam the matrix tells no coordinate across it, so that a column between two rigid
    floors has no length. In space an element between two nodes in one place, a hinge, has a symmetric block.
    """
    pairs = np.column_stack(sp.triu(nodes.graph, 1).nonzero())
    pairs = pairs[determined(points)[pairs].all(axis=1)]
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    short = pairs[length <= ALIKE * np.median(length)] if len(pairs) else pairs
    if nodes.layout.dim == 3:
        hinges, whole = balanced(nodes, points, short[:, 0], short[:, 1], allowed)
        short = short[~(hinges & whole)]
    return (int(short[0, 0]), int(short[0, 1])) if len(short) else None


def _counts(i: NDArray, j: NDArray, n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(n, n))
