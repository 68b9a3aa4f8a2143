"""Frames, towers, shells, plates and trusses, and what engineers put into their matrices.

Element matrices are Pynite's, assembled by the tests' own helper. Geometric stiffness, springs, rigid floors and rigid
links are put in by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .truth import Truth, damaged, rounded  # first: it names the folders of the tests

import built  # isort: skip
from built import Built, add_members, assembled, grid, model_on  # isort: skip

Generator = np.random.Generator


def any_structure(rng: Generator, *, few: bool = False) -> Built:
    """One of all sorts; of few members where that is asked for."""
    seed = int(rng.integers(1 << 30))
    off = float(rng.choice([0.0, 0.05, 0.4]))
    side = (lambda: int(rng.integers(1, 3))) if few else (lambda: int(rng.integers(2, 5)))
    makers: list[Callable[[], Built]] = [
        lambda: built.frame((side(), min(side(), 3), 2), seed, off),
        lambda: built.frame((side(), 2, side()), seed, off),
        lambda: lattice(rng, few=few),
        lambda: tower(rng, few=few),
        lambda: built.plane_frame((side(), 1 + side()), seed, off),
        lambda: built.grillage((side(), 1 + side()), seed, off),
        lambda: built.truss(2, int(rng.integers(3, 5 if few else 13)), seed),
        lambda: built.truss(3, int(rng.integers(5, 6 if few else 12)), seed),
        lambda: shell(rng, few=few),
        lambda: built.plate((1 + side(), 1 + side()), seed, float(rng.choice([0.0, 0.2]))),
    ]
    if not few:
        makers.append(lambda: built.vault((5, 3)))
    return makers[rng.integers(len(makers))]()


def lattice(rng: Generator, *, few: bool = False) -> Built:
    """Equal members along three axes, each with a step of its own."""
    most = 2 if few else 4
    counts = (int(rng.integers(1, most + 1)), int(rng.integers(1, most)), 2 + int(rng.integers(0, most)))
    points, ends = grid(counts)
    points = points * rng.choice([1.0, 2.0, 3.0, 4.5], 3)
    model = model_on(points)
    add_members(model, ends, int(rng.integers(1 << 30)), turned=False, equal=bool(rng.integers(2)))
    return assembled(model, points, ends)


def round_lattice(rng: Generator) -> Built:
    """Equal tubes along three axes, or in a plane: they bend alike both ways, so that whole lattices look alike."""
    counts = [(2, 2, 2), (3, 2, 2), (3, 3, 2), (2, 2, 3), (4, 2, 2), (3, 3, 1), (5, 3, 1), (2, 3, 3)][rng.integers(8)]
    points, ends = grid(counts)
    points = points * (rng.choice([1.0, 2.0, 3.0]) if rng.random() < 0.7 else rng.choice([1.0, 2.0, 3.0], 3))
    left = rng.random(len(ends)) >= (0.15 if rng.random() < 0.3 else 0.0)
    model = model_on(points)
    model.add_section("tube", 1e-2, 1e-4, 1e-4, 2.5e-4)
    for k, (i, j) in enumerate(ends[left]):
        model.add_member(str(k), str(i), str(j), "steel", "tube")
    return assembled(model, points, ends[left])


def tower(rng: Generator, *, few: bool = False) -> Built:
    """Regular polygons over one another that become smaller, with columns, and diagonals on some sides."""
    sides, storeys = int(rng.integers(3, 5)), int(rng.integers(1, 3 if few else 5))
    turn = 2 * np.pi * np.arange(sides) / sides
    width = np.linspace(2, float(rng.choice([0.5, 2.0])), storeys + 1)
    points = np.concatenate(
        [np.column_stack([w * np.cos(turn), w * np.sin(turn), 0 * turn + 3 * k]) for k, w in enumerate(width)]
    )
    points += float(rng.choice([0.0, 0.1])) * rng.uniform(-1, 1, points.shape)
    ends = []
    for k in range(storeys):
        for a in range(sides):
            here, beside = k * sides + a, k * sides + (a + 1) % sides
            ends += [(here, here + sides), (here + sides, beside + sides)]
            if rng.random() < 0.4:
                ends.append((here, beside + sides))
    model = model_on(points)
    add_members(model, ends, int(rng.integers(1 << 30)), turned=bool(rng.integers(2)))
    return assembled(model, points, ends)


def shell(rng: Generator, *, few: bool = False) -> Built:
    """Flat, curved or doubly graded, thick or thin."""
    most = 3 if few else 5
    counts = int(rng.integers(2, most + 1)), int(rng.integers(2, most + 1))
    shape = (built.curved, built.flat, lambda u, v: np.column_stack([u, v**1.5, 0 * u]))[rng.integers(3)]
    return built.shell(shape, counts, thickness=float(rng.choice([0.01, 0.05, 0.2])))


def truth_of(given: Built) -> Truth:
    """Displacements alone tell no size."""
    n = len(given.points)
    gauge = "homothety" if given.block == given.points.shape[1] and given.unknowns[-1] < 3 else "translation"
    node, direction = np.divmod(np.arange(n * given.block), given.block)
    return Truth(sp.csr_array(given.matrix), node, given.points, gauge, direction)


def as_handed_over(given: Built, rng: Generator, *, exact: float = 0.6) -> Truth:
    """With supports of some sort, nodes in random order, by component now and then, and maybe rounded."""
    truth = held(given, rng)
    order = rng.permutation(len(truth.points))[truth.node]
    components = rng.random() < 0.1
    truth = truth.kept(np.lexsort((order, truth.direction) if components else (truth.direction, order)))
    return truth if rng.random() < exact else rounded(truth, rng)


def held(given: Built, rng: Generator) -> Truth:
    """Free; the lowest nodes clamped or hinged and eliminated, by the identity or by a penalty; rows at random gone."""
    truth, how = truth_of(given), int(rng.integers(7))
    rows = np.arange(len(truth.node))
    if how == 0:
        return truth
    height = given.points[:, rng.integers(given.points.shape[1])]
    feet = height <= np.quantile(height, rng.choice([0.0, 0.1, 0.3])) + 1e-9
    if feet.all():
        feet = np.arange(len(feet)) == 0
    fast = feet[truth.node]
    moves = np.isin(np.array(given.unknowns)[rows % given.block], (0, 1, 2))
    if how in (1, 2):
        return truth.kept(rows[~fast])
    if how == 3:
        return truth.kept(rows[~(fast & moves)])
    if how == 4:
        free = sp.diags_array((~fast).astype(float))
        stiff = given.matrix.diagonal().mean() if rng.integers(2) else 1.0
        matrix = free @ truth.matrix @ free + sp.diags_array(fast * stiff)
        return replace(truth, matrix=sp.csr_array(matrix))
    if how == 5:
        stiff = np.where(fast, 10 ** rng.uniform(3, 12) * given.matrix.diagonal().max(), 0.0)
        return replace(truth, matrix=sp.csr_array(truth.matrix + sp.diags_array(stiff)))
    gone = rng.choice(len(rows), min(int(rng.integers(1, 7)), len(rows) - 1), replace=False)
    return truth.kept(np.setdiff1d(rows, gone))


def plain(rng: Generator) -> Truth:
    """Nothing but a structure."""
    return as_handed_over(any_structure(rng), rng)


def few_members(rng: Generator) -> Truth:
    """One to a dozen members or cells."""
    return as_handed_over(any_structure(rng, few=True), rng)


def prestressed(rng: Generator) -> Truth:
    """Members with an axial force of their own: geometric stiffness besides the elastic one."""
    given = with_members(rng)
    axial = np.full(len(given.members), 1.0)
    sort = rng.integers(6)
    if sort == 1:
        axial = rng.standard_normal(len(axial))
    elif sort == 2:
        axial = axial * (rng.random(len(axial)) < 0.3)
    elif sort == 3:
        axial = rng.uniform(0, 1, len(axial))
    added = geometric(given, axial, consistent=bool(rng.integers(2)))
    largest = np.abs(added.data).max(initial=0.0)
    size = 10 ** rng.uniform(-9, 0.5) * np.abs(given.matrix.data).max() / largest if largest > 0 else 0.0
    return as_handed_over(replace(given, matrix=sp.csr_array(given.matrix + size * added)), rng, exact=0.8)


def with_members(rng: Generator) -> Built:
    """Half of them lattices of members, most of them regular: there forces alone may fit a wrong size."""
    if rng.random() < 0.4:
        return round_lattice(rng)
    if rng.random() < 0.25:
        counts = (int(rng.integers(2, 4)), int(rng.integers(1, 4)), int(rng.integers(2, 4)))
        return built.frame(counts, int(rng.integers(1 << 30)), float(rng.choice([0.0, 0.0, 0.1])))
    if rng.random() < 0.25:
        return lattice(rng)
    given = any_structure(rng)
    while len(given.members) == 0:
        given = any_structure(rng)
    return given


def geometric(given: Built, axial: NDArray, *, consistent: bool) -> sp.csr_array:
    """Of members with axial forces, (m,): as of cubic beams, or as of taut strings, whose nodes' rotations are free."""
    n = len(given.points)
    points = np.column_stack([given.points, np.zeros((n, 3 - given.points.shape[1]))])
    total = np.zeros((n, 6, n, 6))
    for (i, j), force in zip(given.members, axial, strict=True):
        along = points[j] - points[i]
        length = np.linalg.norm(along)
        e = along / length
        across = np.eye(3) - np.outer(e, e)
        cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])  # e x
        unit = force / (30 * length)
        move = (36.0 if consistent else 30.0) * unit * across
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            total[a, :3, b, :3] += sign * move
        if not consistent:
            continue
        for a, b, factor in ((i, i, 4.0), (j, j, 4.0), (i, j, -1.0), (j, i, -1.0)):
            total[a, 3:, b, 3:] += factor * length**2 * unit * across
        # A deflection w grows along e with the slope theta x e, so that slopes of lines w' couple as 3 L.
        couple = 3 * length * unit * cross
        for end in (i, j):
            for other, sign in ((i, 1), (j, -1)):
                total[other, :3, end, 3:] += -sign * couple
                total[end, 3:, other, :3] += -sign * couple.T
    own = total[:, given.unknowns][:, :, :, given.unknowns]
    return sp.csr_array(own.reshape(n * given.block, -1))


def sprung(rng: Generator) -> Truth:
    """Springs, equal in all directions, between nodes, or to the ground; some of rotations."""
    given = any_structure(rng) if rng.integers(2) else with_members(rng)
    n, block = len(given.points), given.block
    moves = np.flatnonzero(np.isin(given.unknowns, (0, 1, 2)))
    turns = np.flatnonzero(np.isin(given.unknowns, (3, 4, 5)))
    used = turns if len(turns) and rng.random() < 0.15 else moves
    if rng.random() < 0.15:
        used = rng.choice(used, 1)
    sort = rng.integers(4)
    if sort == 0 and len(given.members):
        pairs = given.members
    elif sort == 1:
        far = np.linalg.norm(given.points[:, None] - given.points[None], axis=2)
        pairs = np.argwhere(np.triu(np.abs(far - 1.01 * far[far > 0].min()) < 0.02 * far.max(), 1))
    else:
        pairs = np.sort(rng.integers(n, size=(int(rng.choice([1, 2, 5, n])), 2)), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    share = 10 ** rng.uniform(-9, 0.5)
    rows = (block * pairs[:, :, None] + used).transpose(1, 0, 2).reshape(2, -1)
    if rng.random() < 0.2:
        nodes = rng.choice(n, max(1, n // 4), replace=False)
        given = given.with_springs((block * nodes[:, None] + used).ravel(), share=share)
    if rows.size:
        one = bool(rng.integers(2))
        for some in [rows] if one else np.array_split(rows, min(5, rows.shape[1]), axis=1):
            given = given.with_springs(some[0], some[1], share=share if one else 10 ** rng.uniform(-9, 0.5))
    return as_handed_over(given, rng, exact=0.8)


def tied(given: Built, slaves: NDArray, masters: NDArray, directions: NDArray) -> tuple[sp.csr_array, NDArray]:
    """T^T K T, where each slave node moves rigidly with its master in these of six directions, (k, 6) bool.

    Masters may be nodes beyond those given, whose points are in `given` all the same. Also which rows are left.
    """
    n, unknowns = len(given.points), np.array(given.unknowns)
    points = np.column_stack([given.points, np.zeros((n, 3 - given.points.shape[1]))])
    own = np.full((n, 6), -1)
    own[:, unknowns] = np.arange(n * given.block).reshape(n, -1)
    tie = sp.lil_array(sp.eye_array(n * given.block))
    gone = np.zeros(n * given.block, dtype=bool)
    for slave, master, which in zip(slaves, masters, directions, strict=True):
        r = points[slave] - points[master]
        rigid = np.eye(6)
        rigid[:3, 3:] = [[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]]
        for a in np.flatnonzero(which & (own[slave] >= 0)):
            tie[[own[slave, a]]] = 0
            gone[own[slave, a]] = True
            for b in np.flatnonzero((rigid[a] != 0) & (own[master] >= 0)):
                tie[own[slave, a], own[master, b]] = rigid[a, b]
    kept = np.flatnonzero(~gone)
    tie = sp.csr_array(tie)[:, kept]
    matrix = sp.csr_array(tie.T @ given.matrix @ tie)
    live = np.flatnonzero(abs(matrix).sum(axis=1) > 0)
    return sp.csr_array(matrix[live][:, live]), kept[live]


def with_ties(given: Built, tied_to: tuple[NDArray, NDArray, NDArray], held_fast: NDArray, rng: Generator) -> Truth:
    """After ties, without the rows of nodes that are held fast, (n,) bool."""
    matrix, kept = tied(given, *tied_to)
    whole = truth_of(given)
    truth = replace(whole, matrix=matrix, node=whole.node[kept], direction=whole.direction[kept])
    order = rng.permutation(len(given.points))[truth.node]
    rows = np.lexsort((truth.direction, order))
    truth = truth.kept(rows[~held_fast[truth.node[rows]]])
    return truth if rng.random() < 0.8 else rounded(truth, rng)


def rigid_floors(rng: Generator) -> Truth:
    """A building whose storeys are rigid in their planes: a master for each, at its centre or one of its own nodes."""
    counts = int(rng.integers(2, 4)), int(rng.integers(2, 4)), int(rng.integers(2, 5))
    points, ends = grid(counts)
    storey = points[:, 2].astype(int)
    points = points * rng.choice([3.0, 4.0, 5.0], 3)
    if rng.integers(2):
        points[:, :2] += rng.uniform(-0.3, 0.3, (len(points), 2))
    if rng.random() < 0.3:  # columns that run upright
        first = np.flatnonzero(storey == 0)
        points[:, :2] = points[first, :2].repeat(counts[2], axis=0)
    ends = ends[(storey[ends] > 0).any(axis=1)]
    n, own_master = len(points), bool(rng.integers(2))
    if not own_master:
        centres = [points[storey == k].mean(axis=0) for k in range(1, counts[2])]
        points = np.concatenate([points, centres])
    model = model_on(points)
    add_members(model, ends, int(rng.integers(1 << 30)), turned=False, equal=bool(rng.integers(2)))
    given = assembled(model, points, ends)
    slaves, masters = [], []
    for k in range(1, counts[2]):
        floor = np.flatnonzero(storey == k)
        master = floor[0] if own_master else n + k - 1
        slaves += [node for node in floor if node != master]
        masters += [master for node in floor if node != master]
    in_plane = np.tile(np.array([1, 1, 0, 0, 0, 1], dtype=bool), (len(slaves), 1))
    feet = np.append(storey == 0, np.zeros(len(points) - n, dtype=bool)) & (rng.random() < 0.8)
    return with_ties(given, (np.array(slaves), np.array(masters), in_plane), feet, rng)


def rigid_links(rng: Generator) -> Truth:
    """Some nodes move rigidly with others, in all directions or in displacements alone (pins), and have no rows."""
    given = any_structure(rng)
    n = len(given.points)
    while given.points.shape[1] == given.block:  # without rotations nothing turns
        given = any_structure(rng)
        n = len(given.points)
    count = int(rng.integers(1, max(2, n // 3)))
    some = rng.permutation(n)
    slaves, others = some[:count], some[count:]
    if rng.integers(2):
        masters = rng.choice(others, count)
    else:
        far = np.linalg.norm(given.points[slaves][:, None] - given.points[others][None], axis=2)
        masters = others[far.argmin(axis=1)]
    pinned = (rng.random(count) < 0.2)[:, None] & np.array([0, 0, 0, 1, 1, 1], dtype=bool)
    height = given.points[:, -1]
    feet = (height <= np.quantile(height, 0.1)) & (rng.random() < 0.5)
    feet[masters] = False
    return with_ties(given, (slaves, masters, ~pinned), feet, rng)


def contrasts(rng: Generator) -> Truth:
    """Some members 1e-12 to 1e12 as stiff as the others, or all of a stiffness of their own."""
    given = with_members(rng)
    contrast = 10 ** rng.uniform(-12, 12)
    parts = 2 if rng.integers(2) else 5
    part = rng.integers(parts, size=len(given.members))
    turned, seed = bool(rng.integers(2)), int(rng.integers(1 << 30))
    total = sp.csr_array(given.matrix.shape)
    for k in range(parts):
        ends = given.members[part == k]
        model = model_on(given.points)
        pinned = given.block == given.points.shape[1] and given.unknowns[-1] < 3
        add_members(model, ends, seed + k, turned=turned and given.block == 6, pinned=pinned)
        if len(ends):
            one = assembled(model, given.points, ends)
            one = one if given.block == 6 else one.only(given.unknowns, given.points.shape[1])
            total = total + contrast ** (k / (parts - 1)) * one.matrix
    return as_handed_over(replace(given, matrix=sp.csr_array(total)), rng, exact=0.8)


def spoiled(rng: Generator) -> Truth:
    """Entries that are not what they were."""
    return damaged(as_handed_over(any_structure(rng, few=rng.random() < 0.2), rng, exact=1.0), rng)


STRUCTURES = {
    "structure": plain,
    "structure-few": few_members,
    "structure-contrast": contrasts,
    "structure-prestress": prestressed,
    "structure-springs": sprung,
    "structure-floors": rigid_floors,
    "structure-links": rigid_links,
    "structure-damaged": spoiled,
}
