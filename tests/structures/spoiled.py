"""Structures whose elements strain where they move rigidly, all of them: axial forces, and springs between nodes."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from built import Built, assembled, grid, model_on

_YOUNG = 200e9


def braced(counts, step=(2.0, 2.0, 2.0), braces: str = "none") -> tuple[np.ndarray, np.ndarray]:
    """Points of a regular lattice in space, and members along its lines; with `braces` along diagonals of faces."""
    points, ends = grid(counts)
    if braces != "none":
        place = np.arange(len(points)).reshape(counts)
        more = []
        for first, second in combinations(range(3), 2):
            lower = [slice(None)] * 3
            upper = [slice(None)] * 3
            for axis in (first, second):
                lower[axis], upper[axis] = slice(None, -1), slice(1, None)
            more.append(np.column_stack([place[tuple(lower)].ravel(), place[tuple(upper)].ravel()]))
        ends = np.concatenate([ends, *more])
    return points * np.asarray(step), ends


def members_on(points, ends, rng, *, equal: bool = True, round_section: bool = True):
    """A model with members along the given lines, of one section or of sections of their own."""
    model = model_on(points)
    for k, (i, j) in enumerate(ends):
        factor = 1.0 if equal else rng.uniform(1, 3)
        other = 1.0 if round_section else 2.0
        model.add_section(str(k), 1e-2 * factor, 1e-4 * factor, other * 1e-4 * factor, 2.5e-4)
        model.add_member(str(k), str(i), str(j), "steel", str(k))
    return model


def prestressed(
    counts=(3, 2, 2),
    seed: int = 0,
    *,
    step=(2.0, 2.0, 2.0),
    share: float = 0.2,
    forces: str = "random",
    equal: bool = True,
    round_section: bool = True,
    braces: str = "none",
    off: float = 0.0,
) -> Built:
    """A lattice each of whose members has an axial force, up to a share of what buckles it, of either sign.

    Forces are `random` by member, `alike` in all, or alike in those of one `direction`.
    """
    rng = np.random.default_rng(seed)
    points, ends = braced(counts, step, braces)
    points = points + rng.uniform(-off, off, points.shape)
    model = members_on(points, ends, rng, equal=equal, round_section=round_section)
    given = assembled(model, points, ends)
    along = np.round((points[ends[:, 1]] - points[ends[:, 0]]), 6)
    kind = {
        "random": np.arange(len(ends)),
        "alike": np.zeros(len(ends), np.int64),
        "direction": np.unique(along, axis=0, return_inverse=True)[1],
    }[forces]
    factor = rng.uniform(-share, share, len(ends))[kind]
    members = list(model.members.values())
    rows, columns, values = [], [], []
    for member, one, (i, j) in zip(members, factor, ends, strict=True):
        buckling = np.pi**2 * _YOUNG * member.section.Iy / member.L() ** 2
        unknowns = np.concatenate([6 * i + np.arange(6), 6 * j + np.arange(6)])
        rows.append(np.repeat(unknowns, 12))
        columns.append(np.tile(unknowns, 12))
        values.append(np.asarray(member.Kg(one * buckling)).ravel())
    more = sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), given.matrix.shape)
    return replace(given, matrix=sp.csr_array(given.matrix + (more + more.T) / 2))


def tied(given: Built, seed: int = 0, *, share: float = 0.1, alike: bool = True) -> Built:
    """Isotropic springs for displacements between all coupled nodes, all alike or each of its own stiffness."""
    rng = np.random.default_rng(seed)
    entry = sp.triu(given.matrix, 1).tocoo()
    pairs = np.unique(np.column_stack([entry.row, entry.col]) // given.block, axis=0)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    stiffness = share * np.median(given.matrix.diagonal()) * np.ones(len(pairs))
    if not alike:
        stiffness *= rng.uniform(0.1, 1, len(pairs))
    moves = given.points.shape[1] if given.unknowns != (2, 3, 4) else 1
    matrix = given.matrix
    for a in range(moves):
        i, j = given.block * pairs.T + a
        place = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
        values = np.concatenate([stiffness, stiffness, -stiffness, -stiffness])
        matrix = matrix + sp.csr_array((values, place), shape=matrix.shape)
    return replace(given, matrix=sp.csr_array(matrix))


def constrained(given: Built, masters, slaves: list, directions=(0, 1, 5)) -> tuple[sp.csr_array, np.ndarray]:
    """A structure some of whose unknowns follow those of masters as on rigid bodies, and so are no unknowns; T^T A T.

    With `directions` (0, 1, 5) bodies are floors that are rigid in their plane: rows of other nodes have the others.
    `masters` are positions (k, 3), of nodes of their own with these directions only, which come last. With positions
    (N, 3) of the nodes of all rows that are left.
    """
    n, moved = given.matrix.shape[0], np.asarray(directions)
    follower = np.full(len(given.points), -1)
    for k, some in enumerate(slaves):
        follower[some] = k
    bound = np.zeros(n, dtype=bool)
    bound[(6 * np.flatnonzero(follower >= 0)[:, None] + moved).ravel()] = True
    free = np.flatnonzero(~bound)
    turn = sp.lil_array((n, len(free) + len(moved) * len(masters)))
    turn[free, np.arange(len(free))] = 1
    for node in np.flatnonzero(follower >= 0):
        arm = given.points[node] - masters[follower[node]]
        motion = np.eye(6)
        for axis in range(3):
            motion[:3, 3 + axis] = np.cross(np.eye(3)[axis], arm)
        start = len(free) + len(moved) * follower[node]
        for row in moved:
            turn[6 * node + row, start + np.arange(len(moved))] = motion[row, moved]
    turn = sp.csr_array(turn)
    places = np.concatenate([given.points[free // 6], np.repeat(np.asarray(masters), len(moved), axis=0)])
    return sp.csr_array(turn.T @ given.matrix @ turn), places


def storeys(
    counts=(3, 2, 4), seed: int = 0, *, off: float = 0.0, step=(5.0, 4.0, 3.0)
) -> tuple[sp.csr_array, np.ndarray]:
    """A building, clamped at the ground, whose floors are rigid in their plane; and places of its rows' nodes."""
    rng = np.random.default_rng(seed)
    points, ends = grid(counts)
    points = points * np.asarray(step)
    points[:, :2] += rng.uniform(-off, off, (len(points), 2)) if off else 0.0
    given = assembled(members_on(points, ends, rng, equal=off == 0, round_section=False), points, ends)
    given = given.clamped(points[:, 2] < 0.1)
    levels = np.unique(given.points[:, 2])
    floors = [np.flatnonzero(given.points[:, 2] == level) for level in levels]
    return constrained(given, [given.points[some].mean(axis=0) for some in floors], floors)
