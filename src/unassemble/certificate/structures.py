"""The certificate of a structure: its matrix held against the coordinates, as they are written.

Whatever the elements are, a rigid motion of the whole structure costs nothing. So each row of the matrix that lacks
nothing annihilates the translations, and the rotations about each axis through the row's own node: displacements
w x (x_j - x_i) and angles w. Forces are relative to the terms of their own row, without signs, so that stiff rows hide
nothing in soft ones. Rows next to supports lack what was eliminated; it shows by translations, which their rows no
longer annihilate. Springs between rotations and the ground, as programs add them against drilling, leave a symmetric
matrix of moments at a node.

What is said to be a straight member is held against the stiffness of one between its two points, set up in axes of its
own (W. McGuire, R. H. Gallagher, R. D. Ziemian, Matrix Structural Analysis, 2nd ed., 2000, section 4.5) with the four
numbers of its section taken from the block itself.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from ..tolerances import CANCELLED, LAST_DIGITS, PENALTY


@dataclass(frozen=True, eq=False)
class StructureCheck:
    """What the matrix of a structure says of coordinates."""

    # largest force, or misfit of a member, relative to its row or block; NaN if nothing was compared
    backward_error: float
    rows: NDArray[np.bool_]  # (N,) rows that say so
    unknowns: NDArray[np.bool_]  # (N,) that these touch
    unexplained: NDArray[np.int64]  # rows that lack nothing and yet do not annihilate a rotation, the worst first
    # rows that do not annihilate translations, in a way that neither supports nor springs bring about, the worst first
    unsupported: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def share(self) -> float:
        """Share of all rows that say so."""
        return float(self.rows.mean())

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """No pairs of rows: single entries of a structure are not told apart."""
        return np.empty((0, 2), np.int64), np.empty(0)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Which unknown of a structure each row belongs to."""

    node: NDArray[np.int64]  # (N,)
    direction: NDArray[np.int64]  # (N,) those of displacements first, then those of rotations; -1 where not known
    displacements: tuple[int, ...]  # axes
    rotations: tuple[int, ...]  # axes

    @property
    def moves(self) -> int:
        """How many displacements a node has."""
        return len(self.displacements)

    @property
    def block_size(self) -> int:
        """How many unknowns a node has."""
        return len(self.displacements) + len(self.rotations)


@dataclass(frozen=True, eq=False)
class _Forces:
    """Forces under unit rotations about axes through each row's own node, and which of them have to vanish."""

    force: NDArray[np.float64]  # (N, axes)
    size: NDArray[np.float64]  # (N,) of the terms that make forces up, about all axes together
    due: NDArray[np.bool_]  # (N, axes) where the row lacks nothing that the rotation needs


def check_structure(
    matrix: sp.csr_array,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
    displacements: tuple[int, ...],
    rotations: tuple[int, ...],
    *,
    members: NDArray[np.int64],
    allowed: float,
    excused: NDArray[np.int64] | None = None,
) -> StructureCheck:
    """Hold a symmetric matrix (N, N) against points (n, 2) or (n, 3), NaN where a node has none.

    Directions count the axes of `displacements` first, then those of `rotations`; rows of direction -1 do not count.
    `members` (m, 2) are pairs of nodes that are joined by straight members and nothing else. Up to what is `allowed`
    forces vanish; nodes that are `excused` (k,) are known to contradict the others, and say nothing.
    """
    x = np.zeros((len(points), 3))
    x[:, : points.shape[1]] = points
    matrix = _without_rounding(matrix)
    rows = _Rows(node_of_row, direction_of_row, displacements, rotations)
    forces = _forces(matrix, rows, x, allowed)
    others = np.isin(node_of_row, np.empty(0, np.int64) if excused is None else excused)
    relative = np.abs(forces.force) / np.where(forces.size > 0, forces.size, 1.0)[:, None]
    wrong = forces.due & ~(relative <= allowed) & ~others[:, None]
    ground = _springs_to_ground(forces, rows, allowed)
    off = np.where(wrong & ~ground, relative, 0.0).max(axis=1, initial=0.0)
    order = np.argsort(-off, kind="stable")
    unexplained = order[: np.count_nonzero(off)]
    counts = forces.due.any(axis=1) & ~wrong.any(axis=1) & ~others
    misfit = np.empty(0)
    if len(members) and rotations:
        misfit = _members(matrix, rows, x, members)
        counts |= _only_members(matrix, node_of_row, members) & ~others
    said = np.where(forces.due & ~(wrong & ground) & ~others[:, None], relative, 0.0).max(initial=0.0)
    error = float(np.maximum(said, misfit.max(initial=0.0)))  # NaN stays
    if error <= allowed and not counts.any():  # all that is wrong is excused, and nothing is right
        error = float("nan")
    unsupported = _unsupported(matrix, rows, members, allowed)
    return StructureCheck(error, counts, touched_by(matrix, counts), unexplained, unsupported)


def touched_by(matrix: sp.csr_array, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) unknowns that some rows (N,) couple to."""
    return np.asarray(abs(matrix[np.flatnonzero(rows)]).sum(axis=0)).ravel() > 0


def determined(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) nodes that have a position."""
    return np.asarray(np.isfinite(points).all(axis=1))


def _without_rounding(matrix: sp.csr_array) -> sp.csr_array:
    """The matrix without entries that are nothing but rounding beside the diagonal entries of row and column."""
    entry = matrix.tocoo()
    diagonal = np.abs(matrix.diagonal())
    real = np.abs(entry.data) > LAST_DIGITS * np.sqrt(diagonal[entry.row] * diagonal[entry.col])
    place = entry.row[real], entry.col[real]
    return sp.csr_array((entry.data[real], place), shape=matrix.shape)


def _forces(matrix: sp.csr_array, rows: _Rows, x: NDArray[np.float64], allowed: float) -> _Forces:
    """Forces of all rows under rotations about each axis."""
    node, direction, displacements, rotations = rows.node, rows.direction, rows.displacements, rows.rotations
    order, moves, axes = len(node), rows.moves, rotations or (0, 1, 2)
    entry = matrix.tocoo()
    i, j, value = entry.row, entry.col, entry.data
    coupled = np.zeros(order, dtype=bool)
    coupled[i[i != j]] = True
    live = coupled & (direction >= 0)
    arm = x[node[j]] - x[node[i]]
    moved = np.array([*displacements, *(-1 for _ in rotations), -1])[direction[j]]

    def added(terms: NDArray) -> NDArray:
        return np.bincount(i, terms, order)

    # Sums of the entries of each direction of displacements, without those of rows whose direction is not known.
    shift = np.column_stack([added(np.where(moved == a, value, 0.0)) for a in displacements])
    scale = added(np.abs(value) * (moved >= 0))[:, None]
    still = np.abs(shift) <= allowed * np.where(scale > 0, scale, 1.0)
    there = np.zeros((len(x), moves + len(rotations)), dtype=bool)
    there[node[live], direction[live]] = True
    reached = determined(x)[node]
    touched = added((~reached[j]).astype(float)) == 0
    diagonal = np.abs(matrix.diagonal())
    penalised = diagonal > PENALTY * (added(np.abs(value)) - diagonal)
    sound = live & touched & ~penalised
    turning = direction >= moves
    firm = np.ones(len(x), dtype=bool)  # nodes no force of which depends on translations
    np.logical_and.at(firm, node[live & ~turning], (still.all(axis=1) & sound)[live & ~turning])
    firm &= there[:, :moves].all(axis=1)
    along = np.take_along_axis(still, np.where(turning, 0, np.maximum(direction, 0))[:, None], axis=1)[:, 0]
    sound &= np.where(turning, firm[node], along)
    length = np.linalg.norm(arm, axis=1)
    lever = np.where(moved >= 0, np.where(np.isfinite(length), length, 0.0), (direction[j] >= 0).astype(float))
    size = added(np.abs(value) * lever)
    force, due = np.zeros((order, len(axes))), np.zeros((order, len(axes)), dtype=bool)
    for k, axis in enumerate(axes):
        turn = np.cross(np.eye(3)[axis], arm)
        part = np.where(moved >= 0, np.take_along_axis(turn, np.maximum(moved, 0)[:, None], axis=1)[:, 0], 0.0)
        if rotations:
            part = np.where(direction[j] == moves + k, 1.0, part)
        force[:, k] = added(value * np.where(np.isfinite(part), part, 0.0))
        across = [m for m, a in enumerate(displacements) if a != axis]
        needed = [*across, moves + k] if rotations else across
        lacks = np.asarray(~there[:, needed].all(axis=1))
        lacking = added(lacks[node[j]].astype(float)) > 0
        due[:, k] = sound & still[:, across].all(axis=1) & ~lacking & (size > 0)
    return _Forces(force, size, due)


def _unsupported(matrix: sp.csr_array, rows: _Rows, members: NDArray[np.int64], allowed: float) -> NDArray[np.int64]:
    """Rows that do not annihilate translations, in a way that no support explains, the worst first.

    What supports leave of an element is a principal submatrix of its stiffness, so that its energy in a translation of
    all that is left is not negative; nor is that of springs. Rows of whole elements have none. So the forces under unit
    translations, added up over nodes that share what supports left of elements, make up a matrix (moves, moves) that is
    symmetric and positive semidefinite, with the sign of the matrix. Which nodes share such an element is not known:
    those are taken together that are coupled otherwise than by a whole member.
    """
    node, direction, moves = rows.node, rows.direction, rows.moves
    n = int(node.max()) + 1
    entry = matrix.tocoo()
    told = direction >= 0
    live = told[entry.row] & told[entry.col] & (direction[entry.row] < moves) & (direction[entry.col] < moves)
    i, value = node[entry.row[live]], entry.data[live] * np.sign(matrix.diagonal().sum())
    a, b = direction[entry.row[live]], direction[entry.col[live]]
    shift, size = np.zeros((n, moves, moves)), np.zeros((n, moves))
    np.add.at(shift, (i, a, b), value)
    np.add.at(size, (i, a), np.abs(value))
    unit = np.where(size > 0, size, 1.0)
    lacking: NDArray[np.bool_] = np.asarray((np.abs(shift) > allowed * unit[:, :, None]).any(axis=(1, 2)))
    if not lacking.any():
        return np.empty(0, np.int64)

    there = np.zeros((n, int(direction.max()) + 1), dtype=bool)
    there[node[told], direction[told]] = True
    whole: NDArray[np.bool_] = np.asarray(there.all(axis=1))
    p, q = node[entry.row], node[entry.col]
    key = np.minimum(p, q) * n + np.maximum(p, q)
    ends = np.sort(members, axis=1) @ np.array([n, 1])
    by_member = np.isin(key, ends) & whole[p] & whole[q]
    joined = lacking[p] & lacking[q] & (p != q) & ~by_member
    graph = sp.coo_array((np.ones(joined.sum()), (p[joined], q[joined])), shape=(n, n))
    _, group = connected_components(graph, directed=False)

    rest, whole_size = np.zeros((n, moves, moves)), np.zeros((n, moves))
    np.add.at(rest, group[lacking], shift[lacking])
    np.add.at(whole_size, group[lacking], size[lacking])
    diagonal = np.abs(np.diagonal(rest, axis1=1, axis2=2))
    scale = np.sqrt(np.maximum(np.where(whole_size > 0, whole_size, 1.0), diagonal))
    relative = rest / (scale[:, :, None] * scale[:, None, :])
    turned = relative.transpose(0, 2, 1)
    least = np.linalg.eigvalsh((relative + turned) / 2)[:, 0]
    wrong = np.maximum(-least, np.abs(relative - turned).max(axis=(1, 2)))
    # Rounding may leave as much in soft directions as in stiff ones.
    soft = np.where(whole_size > 0, whole_size, np.inf).min(axis=1)
    stiffer = np.sqrt(whole_size.max(axis=1) / soft)
    odd = wrong > (CANCELLED + allowed) * np.maximum(stiffer, 1.0)
    where = np.flatnonzero(odd[group[node]] & lacking[node] & told & (direction < moves))
    off = (np.abs(shift) / unit[:, :, None]).max(axis=2)[node[where], direction[where]]
    where, off = where[off > allowed], off[off > allowed]
    return where[np.argsort(-off, kind="stable")]


def _springs_to_ground(forces: _Forces, rows: _Rows, allowed: float) -> NDArray[np.bool_]:
    """(N, axes) moments that springs between the rotations of a node and the ground may have.

    Such springs have a symmetric matrix. Of two moments that mirror each other one alone shows nothing.
    """
    node, direction, moves, turns = rows.node, rows.direction, rows.moves, len(rows.rotations)
    may = np.zeros(forces.force.shape, dtype=bool)
    row_at = np.full((int(node.max()) + 1, turns), -1)
    turning = np.flatnonzero(direction >= moves)
    row_at[node[turning], direction[turning] - moves] = turning
    for a in range(turns):
        for b in range(turns):
            one, other = row_at[:, a], row_at[:, b]
            pair = (one >= 0) & (other >= 0)
            may[one[(one >= 0) & ~pair], b] = True
            one, other = one[pair], other[pair]
            gap = np.abs(forces.force[one, b] - forces.force[other, a])
            alike = gap <= allowed * (forces.size[one] + forces.size[other])
            may[one, b] = alike | ~forces.due[other, a]
    return may


def _members(
    matrix: sp.csr_array, rows: _Rows, x: NDArray[np.float64], members: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(m,) largest misfit of the block of each member's nodes, relative to the part of it where it is largest.

    Members without positions at both ends are left out. Parts couple displacements or rotations to either.
    """
    node, direction, b, moves = rows.node, rows.direction, rows.block_size, rows.moves
    members = members[determined(x)[members].all(axis=1)]
    row_at = np.full((len(x), b), -1)
    told = np.flatnonzero(direction >= 0)
    row_at[node[told], direction[told]] = told
    members = members[(row_at[members] >= 0).all(axis=(1, 2))]
    first_end, second_end = np.broadcast_arrays(row_at[members[:, 0], :, None], row_at[members[:, 1], None, :])
    if not len(members):
        return np.empty(0)
    block = np.asarray(sp.coo_array(matrix[first_end.ravel(), second_end.ravel()]).toarray()).reshape(-1, b, b)
    axes = np.array([*rows.displacements, *(3 + a for a in rows.rotations)])
    whole = np.zeros((len(block), 6, 6))
    whole[:, axes[:, None], axes] = block
    again = _member_between(whole, x[members[:, 1]] - x[members[:, 0]])[:, axes[:, None], axes]
    misfit = np.zeros(len(block))
    for first in (slice(moves), slice(moves, None)):
        for second in (slice(moves), slice(moves, None)):
            size = np.abs(block[:, first, second]).max(axis=(1, 2), initial=0.0)
            off = np.abs(block[:, first, second] - again[:, first, second]).max(axis=(1, 2), initial=0.0)
            misfit = np.maximum(misfit, np.where(off > 0, off / np.where(size > 0, size, np.finfo(float).tiny), 0.0))
    return misfit


def _member_between(block: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 6, 6) blocks of the first end's row and the second end's column of members with the sections of those given.

    In axes of the member deflections v and slopes s, with the stiffness S = 12 E I / l^3 of both planes, (2, 2), have
    -S between deflections, S l / 2 and -S l / 2 between deflections and slopes, and S l^2 / 6 between slopes.
    """
    length = np.linalg.norm(along, axis=1)
    frame = _frames(along / np.where(length > 0, length, 1.0)[:, None])
    turned = np.zeros((len(block), 6, 6))
    turned[:, :3, :3] = turned[:, 3:, 3:] = frame
    local = turned.transpose(0, 2, 1) @ block @ turned
    bending = -(local[:, 1:3, 1:3] + local[:, 1:3, 1:3].transpose(0, 2, 1)) / 2
    slope = np.array([[0.0, 1.0], [-1.0, 0.0]])  # of v by rotations about the two axes across the member
    half, sixth = (length / 2)[:, None, None], (length**2 / 6)[:, None, None]
    again = np.zeros_like(local)
    again[:, 0, 0], again[:, 3, 3] = local[:, 0, 0], local[:, 3, 3]
    again[:, 1:3, 1:3] = -bending
    again[:, 1:3, 4:] = half * bending @ slope
    again[:, 4:, 1:3] = -half * slope.T @ bending
    again[:, 4:, 4:] = sixth * slope.T @ bending @ slope
    return np.asarray(turned @ again @ turned.transpose(0, 2, 1))


def _frames(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3, 3) right-handed axes, as columns, of which the first are the given unit vectors."""
    least = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    second = np.cross(least, axis)
    norm = np.linalg.norm(second, axis=1, keepdims=True)
    second = second / np.where(norm > 0, norm, 1.0)
    return np.stack([axis, second, np.cross(axis, second)], axis=2)


def _only_members(matrix: sp.csr_array, node: NDArray[np.int64], members: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(N,) rows of nodes that members join to all nodes that they are coupled to."""
    entry, n = matrix.tocoo(), int(node.max()) + 1
    i, j = np.minimum(node[entry.row], node[entry.col]), np.maximum(node[entry.row], node[entry.col])
    key = np.unique((i * n + j)[i < j])
    other = key[~np.isin(key, np.sort(members, axis=1) @ np.array([n, 1]))]
    mixed = np.concatenate([other // n, other % n])
    return np.isin(node, members) & ~np.isin(node, mixed)
