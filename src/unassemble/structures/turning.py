"""Positions of the nodes of frames, shells and plates, from the equations that deserve most trust.

Elements that strain where they move rigidly, as with offsets that lack their moments or springs across the line between
two nodes, spoil the rows of their nodes and no others. Least squares spread that over all positions. Where small
deviations count nearly as much as large ones, equations are satisfied or left alone, as long as those that hold
determine all nodes several times over.

R. Chartrand and W. Yin, Iteratively reweighted algorithms for compressive sensing, ICASSP 2008, 3869-3872.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..errors import GeometryError
from ..linalg import solved
from ..nodes.shape import set_aside
from ..recovery import Evidence
from ..tolerances import ALIKE, CANCELLED, CERTIFIED, MOST, ROUNDED, SINGULAR, SMALL
from ..words import count_of
from .equations import Equations, equations, joined, told_by
from .layouts import Layout
from .nodes import Nodes
from .placed import Piece, Placed, least_squares, placed, up_to_size, without_free
from .straight import Straight


def turning_positions(nodes: Nodes, members: Straight, allowed: float = CERTIFIED) -> tuple[Placed, NDArray[np.bool_]]:
    """Positions from all rows; where these contradict or do not check each other, from those that no spring spoils.

    Where these contradict each other as well, from all but the rows of few nodes, if the others agree without them.
    What `members` tell by themselves comes on top. Equations contradict each other if residuals exceed what is
    `allowed`. With (n, b, rotations) rows and rotations that positions rest on, whose forces have to vanish.
    GeometryError if no node is determined, or more is free than translations.
    """
    attempts: list[tuple[Placed, NDArray[np.bool_]]] = []
    failure: GeometryError | None = None
    layout, valid = nodes.layout, nodes.whole()
    edges = np.column_stack(sp.triu(nodes.pattern(len(layout.displacements)), 1).nonzero())
    ways = [(False, False), (False, True), (True, False)] if layout.rotations else [(False, False)]
    if layout.rotations and layout.dim == 3:  # where nothing drills, forces alone are too few to leave any out
        ways.append((True, True))
    for but_for_some, springs in ways:
        if but_for_some and (allowed > CERTIFIED or any(found.residual <= allowed for found, _ in attempts)):
            break  # of entries with few digits other ones would be left out each time that these are drawn anew
        given = joined(equations(nodes, valid, springs=springs, allowed=allowed), told_by(members, nodes))
        counted = valid.copy()
        if springs:
            counted[:, len(layout.displacements) :] = False
        spoiled = np.empty(0, np.int64)
        if but_for_some:
            some = _contradicted(given, nodes)
            if some is None:
                continue
            given, spoiled = given[~some[0]], some[1]
            counted[spoiled] = False
        try:
            found = placed(given.operator, layout.dim, edges, partial(_solved, given, layout), allowed)
            found = replace(found, spoiled=spoiled)
        except GeometryError as error:
            failure = failure or error
            continue
        left = given[~found.used & (given.row >= 0)]
        counted.reshape(-1, counted.shape[2])[left.row, left.rotation] = False
        attempts.append((found, counted))
        if not any(_doubts(found, allowed)[:3]) and found.used.all():
            break
    if not attempts and failure:
        raise failure
    found, counted = min(attempts, key=lambda one: _doubts(one[0], allowed))
    most = layout.dim + (not layout.rotations)  # no matrix tells translations, nor the size without rotations
    return without_free(found, most), counted


def _doubts(found: Placed, allowed: float) -> tuple[bool, bool, bool, int, float]:
    """What speaks against positions, the gravest first."""
    free, lost = found.null_dimension > found.points.shape[1], int(np.count_nonzero(found.component < 0))
    return found.residual > allowed, free, bool(found.unnoticed.any()), lost, found.residual


def _solved(given: Equations, layout: Layout, piece: Piece) -> tuple[NDArray[np.float64], Evidence, NDArray[np.bool_]]:
    """Coordinates of one piece, evidence, and what would go unnoticed; GeometryError if they are hardly determined."""
    d, b, n, m = layout.dim, layout.block_size, len(piece.nodes), len(piece.rows)
    part = given[piece.rows]
    place = np.searchsorted(piece.nodes, part.row // b)
    # A row may not depend on its node.
    own = (part.row >= 0) & (piece.nodes[np.minimum(place, n - 1)] == part.row // b)
    local = replace(part, operator=piece.operator, row=np.where(own, place * b + part.row % b, -1))
    if not layout.rotations:
        points, evidence, probes = up_to_size(piece, d)
        return points, evidence, _unnoticed(local, probes, layout, np.nan_to_num(points), piece.edges)
    if n < 2 or m < (n - 1) * d:
        raise GeometryError(f"{m} equations are too few for {n} nodes: too much lies next to supports")
    x, residuals, fields, values, gap = least_squares(piece.operator, np.column_stack([part.right, part.mixed]), d)
    x = x.reshape(n, d)
    span = np.linalg.norm(x[piece.edges[:, 0]] - x[piece.edges[:, 1]], axis=1).max(initial=0)
    if span <= CANCELLED * part.lever.max(initial=0):
        raise GeometryError("rotations and displacements do not depend on each other: the nodes would lie in one point")
    null, loose = fields[..., values <= SINGULAR], np.zeros(n, dtype=bool)
    if null.shape[2] > d:
        null, loose = set_aside(null, d)
    blind = _unnoticed(local, residuals[:, 2:], layout, x, piece.edges)
    blind |= np.linalg.norm(residuals[:, 1]) < SMALL * np.linalg.norm(part.mixed)  # no row is spare
    blind &= part.rotation >= 0
    evidence = Evidence(null.shape[2], float(np.abs(residuals[:, 0]).max()) / span, gap, m)
    return np.where(loose[:, None], np.nan, x - x[~loose].mean(axis=0)), evidence, blind


def _contradicted(given: Equations, nodes: Nodes) -> tuple[NDArray[np.bool_], NDArray[np.int64]] | None:
    """Equations to leave out, and the nodes whose rows contradict others; None where that are too many, or none.

    By least squares, with weights that fall with the deviations of the round before, these of not less than a bound
    that falls from round to round. Off is what misses by more than half of the digits; with it go all equations of its
    node, and those of several rows, or of members, in which the node occurs.
    """
    A, b = given.operator, nodes.layout.block_size
    lengths = float(np.abs(given.right).max(initial=0.0))
    if not lengths:
        return None
    x, weight, least = np.zeros(A.shape[1]), np.ones(A.shape[0]), lengths
    for _ in range(REFINEMENTS):
        weighted = sp.csr_array(sp.diags_array(weight / weight.max()) @ A)
        normal = sp.csr_array(A.T @ weighted)
        held = sp.eye_array(A.shape[1]) * (ROUNDED * normal.diagonal().max())  # translations are free
        x = x + solved(sp.csr_array(normal + held), weighted.T @ (given.right - A @ x))
        off = np.abs(given.right - A @ x)
        least = max(least / 3, CERTIFIED * lengths)
        weight = 1 / np.maximum(off, least) ** 1.5
    wrong = off > ALIKE * lengths
    spoiled = np.unique(given.row[wrong & (given.row >= 0)] // b)
    theirs = np.isin(np.arange(A.shape[1]) // nodes.layout.dim, spoiled)
    touched = abs(A) @ theirs.astype(float) > 0
    out = np.asarray(wrong | np.where(given.row < 0, touched, np.isin(given.row // b, spoiled)))
    return (out, spoiled) if out.any() and out.mean() <= 1 - MOST else None


def said_of(nodes: Nodes, spoiled: NDArray[np.int64]) -> str:
    """Which nodes and members these are, in words."""
    pairs = np.column_stack(sp.triu(nodes.graph, 1).nonzero())
    pairs = pairs[np.isin(pairs, spoiled).all(axis=1)]
    between = f" ({_listed(f'{i}-{j}' for i, j in pairs)})" if len(pairs) else ""
    return (
        f"the rows of {count_of(len(spoiled), 'node')} ({_listed(map(str, spoiled))}) contradict the others and were "
        f"left out: elements there{between}, or some of them, strain where they move rigidly, as with offsets or "
        "springs"
    )


def _listed(names: Iterable[str]) -> str:
    """The first ten of some names."""
    first = list(islice(names, 11))
    return ", ".join([*first[:10], *(["..."] if len(first) > 10 else [])])


def _unnoticed(
    given: Equations, probes: NDArray[np.float64], layout: Layout, points: NDArray[np.float64], edges: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(m,) equations of a piece that a disturbance would change without being noticed.

    A disturbance of the matrix adds some e to the right-hand side, and shows unless the coordinates can follow it:
    unless P e = 0, where P projects on what no coordinates reach. Residuals z = P g of random right-hand sides g tell,
    since z . e = g . P e vanishes for all of them only if P e does. Not every e can come about: a spring between two
    nodes that translations do not stretch pulls both alike, so that sums of forces over a whole structure say nothing.

    Disturbances are any of a single equation; springs between two coupled nodes; springs that are the same between
    all coupled nodes, or between the rotations of all nodes and the ground, as regular lattices could take them for a
    change of size. `row` counts the piece's own nodes, `probes` (m, k) are residuals of random right-hand sides.
    """
    blind = _small(probes)
    b, moves, turns = layout.block_size, len(layout.displacements), len(layout.turning)
    inside = np.flatnonzero(given.row >= 0)
    place = np.full((len(points), b, turns), -1)  # of rows without equation the last, which has no weight
    place[given.row[inside] // b, given.row[inside] % b, given.rotation[inside]] = inside
    weight = np.append(1 / given.size, 0.0)
    weighted = np.vstack([probes, np.zeros(probes.shape[1])]) * weight[:, None]
    step = layout.rigid_motions(points[edges[:, 0]] - points[edges[:, 1]])[:, :, moves:]
    for a in range(moves):
        one, other = place[edges[:, 0], a], place[edges[:, 1], a]  # (e, turns)
        both = (one >= 0) & (other >= 0)
        scale = np.where(both, np.hypot(weight[one], weight[other]), 1)[..., None]
        lone = _small((weighted[one] - weighted[other]) / scale) & both
        blind[one[lone]] = blind[other[lone]] = True
        pull = np.zeros((len(points), turns))
        np.add.at(pull, edges[:, 0], step[:, a])
        np.add.at(pull, edges[:, 1], -step[:, a])
        _blind_together(blind, place[:, a], pull, weighted)
    for k in range(len(layout.rotations)):
        _blind_together(blind, place[:, moves + k, k], np.ones(len(points)), weighted)
    return blind


def _small(seen: NDArray) -> NDArray[np.bool_]:
    """Whether next to nothing of a disturbance is left in the residuals."""
    return np.asarray(np.abs(seen).max(axis=-1, initial=0) < SMALL)


def _blind_together(blind: NDArray, place: NDArray, forces: NDArray, weighted: NDArray) -> None:
    """Mark equations as unnoticed, if one disturbance of them all is."""
    there = (place >= 0) & (np.abs(forces) > CANCELLED * np.abs(forces).max(initial=0.0))
    pull = weighted[place[there]] * forces[there][:, None]
    if _small(pull.sum(axis=0) / (np.linalg.norm(pull) or 1.0)):
        blind[place[there]] = True
