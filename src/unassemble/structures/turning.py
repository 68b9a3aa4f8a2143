"""Positions of the nodes of frames, shells and plates, from the equations that deserve most trust."""

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.shape import set_aside
from ..recovery import Evidence
from ..tolerances import CANCELLED, CERTIFIED, SINGULAR, SMALL
from .contradicted import contradicted
from .equations import Equations, equations, joined, told_by
from .layouts import Layout
from .least_squares import least_squares, unnoticed_in, up_to_size
from .loads import told_under_loads
from .nodes import Nodes
from .placed import EquationPiece, PlacedNodes, placed, without, without_free
from .straight import Straight


def turning_positions(
    nodes: Nodes, members: Straight, allowed: float = CERTIFIED
) -> tuple[PlacedNodes, NDArray[np.bool_]]:
    """Positions from all rows; where these contradict or do not check each other, from those that no spring spoils.

    Where these contradict each other as well, from all but the rows of few nodes, if the others agree without them.
    What `members` tell by themselves comes on top. Equations contradict each other if residuals exceed what is
    `allowed`. With (n, b, rotations) rows and rotations that positions rest on, whose forces have to vanish.
    GeometryError if no node is determined, or more is free than translations.
    """
    attempts: list[tuple[PlacedNodes, NDArray[np.bool_]]] = []
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
            some = contradicted(given, nodes)
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
        found = _under_loads(found, given, layout, edges, allowed)
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


def _under_loads(
    found: PlacedNodes, given: Equations, layout: Layout, edges: NDArray[np.int64], allowed: float
) -> PlacedNodes:
    """The same, in doubt where only forces tell positions, and loads could change those of most nodes unnoticed.

    Where they could change those of fewer nodes, these lose their positions. Without rotations no size is told at all.
    Where moments are used, they contradict loads.
    """
    if not layout.rotations or found.residual > allowed:
        return found
    used = given[found.used]
    moments = (used.row >= 0) & (used.row % layout.block_size >= len(layout.displacements))
    node = used.row // layout.block_size
    checked = np.unique(found.component[node[moments]])
    told = None
    for piece in np.setdiff1d(found.component[found.component >= 0], checked):
        told = told_under_loads(used, layout, found, edges) if told is None else told
        if 2 * np.count_nonzero(told & (found.component == piece)) < np.count_nonzero(found.component == piece):
            return replace(found, loaded=True)
    if told is None:
        return found
    return without(found, (found.component >= 0) & ~np.isin(found.component, checked) & ~told)


def _doubts(found: PlacedNodes, allowed: float) -> tuple[bool, bool, bool, int, float]:
    """What speaks against positions, the gravest first."""
    free, lost = found.null_dimension > found.points.shape[1], int(np.count_nonzero(found.component < 0))
    return found.residual > allowed, free, bool(found.unnoticed.any()) or found.loaded, lost, found.residual


def _solved(
    given: Equations, layout: Layout, piece: EquationPiece
) -> tuple[NDArray[np.float64], Evidence, NDArray[np.bool_]]:
    """Coordinates of one piece, evidence, and what would go unnoticed; GeometryError if they are hardly determined."""
    d, b, n, m = layout.dim, layout.block_size, len(piece.nodes), len(piece.rows)
    part = given[piece.rows]
    place = np.searchsorted(piece.nodes, part.row // b)
    # A row may not depend on its node.
    own = (part.row >= 0) & (piece.nodes[np.minimum(place, n - 1)] == part.row // b)
    local = replace(part, operator=piece.operator, row=np.where(own, place * b + part.row % b, -1))
    if not layout.rotations:
        points, evidence, probes = up_to_size(piece, d)
        return points, evidence, unnoticed_in(local, probes, layout, np.nan_to_num(points), piece.edges)
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
    blind = unnoticed_in(local, residuals[:, 2:], layout, x, piece.edges)
    blind |= np.linalg.norm(residuals[:, 1]) < SMALL * np.linalg.norm(part.mixed)  # no row is spare
    blind &= part.rotation >= 0
    evidence = Evidence(null.shape[2], float(np.abs(residuals[:, 0]).max()) / span, gap, m)
    return np.where(loose[:, None], np.nan, x - x[~loose].mean(axis=0)), evidence, blind
