"""Positions of the nodes of frames, shells and plates, from the equations that deserve most trust."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.shape import in_gauge, set_aside, shape
from ..recovery import Evidence
from ..tolerances import CANCELLED, CERTIFIED, SINGULAR
from .contradictions import contradicted
from .equations import Equations, equations, joined, told_by
from .layouts import Layout
from .nodes import Nodes
from .placed import Piece, Placed, Positions, placed, without_free
from .positions import least_squares
from .redundancy import unnoticed
from .straight import Straight


def turning_positions(nodes: Nodes, members: Straight, allowed: float = CERTIFIED) -> tuple[Placed, NDArray[np.bool_]]:
    """Positions from all rows; where these contradict or do not check each other, from those that no spring spoils.

    Where these contradict each other as well, from all but the rows of few nodes, if the others agree without them.
    What `members` tell by themselves comes on top. Equations contradict each other if residuals exceed what is
    `allowed`.

    Returns
    -------
    Placed
    (n, b, rotations) bool
        Rows and rotations that these rest on, whose forces have to vanish.

    Raises
    ------
    GeometryError
        If no node is determined, or more is free than translations.
    """
    attempts: list[tuple[Placed, NDArray[np.bool_]]] = []
    failure: GeometryError | None = None
    layout, valid = nodes.layout, nodes.whole()
    telling = valid & _distinct(nodes.matrix, valid.any(axis=2).ravel()).reshape(nodes.n, -1, 1)
    edges = np.column_stack(sp.triu(nodes.moving, 1).nonzero())
    ways = [(False, False), (False, True), (True, False)] if layout.rotations else [(False, False)]
    if layout.rotations and layout.dim == 3:  # where nothing drills, forces alone are too few to leave any out
        ways.append((True, True))
    for but_for_some, springs in ways:
        if but_for_some and (allowed > CERTIFIED or any(found.residual <= allowed for found, _ in attempts)):
            break  # of entries with few digits other ones would be left out each time that these are drawn anew
        given = joined(equations(nodes, telling, springs=springs, allowed=allowed), told_by(members, nodes))
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
            solve = partial(_positions if layout.rotations else _shape, given, layout)
            found = placed(given.operator, layout.dim, edges, solve, allowed)
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
    return without_free(found, layout.free), counted


def _distinct(matrix: sp.csr_array, some: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Some rows, but of those that are multiples of each other one: they check nothing. Two random fields tell them."""
    rows = np.flatnonzero(some)
    size = np.maximum(sp.linalg.norm(matrix, axis=1), np.finfo(float).tiny)[rows, None]
    seen = (matrix @ np.random.default_rng(0).standard_normal((matrix.shape[1], 2)))[rows] / size
    seen *= np.where(seen[:, :1] < 0, -1, 1)
    order = np.lexsort(seen.T)
    again = np.abs(np.diff(seen[order], axis=0)).max(axis=1, initial=0) <= CANCELLED
    result = some.copy()
    result[rows[order[1:][again]]] = False
    return result


def _doubts(found: Placed, allowed: float) -> tuple[bool, bool, bool, int, float]:
    """What speaks against positions, the gravest first."""
    free, lost = found.null_dimension > found.points.shape[1], int(np.count_nonzero(found.component < 0))
    return found.residual > allowed, free, bool(found.unnoticed.any()), lost, found.residual


def _positions(given: Equations, layout: Layout, piece: Piece) -> Positions:
    """Coordinates of one piece.

    Raises
    ------
    GeometryError
        If there are fewer equations than unknowns leave room for, or far more is free than translations.
    """
    d, b, n, m = layout.dim, layout.block_size, len(piece.nodes), len(piece.rows)
    if n < 2 or m < (n - 1) * d:
        raise GeometryError(f"{m} equations are too few for {n} nodes: too much lies next to supports")
    part = given[piece.rows]
    x, residuals, fields, values = least_squares(piece.operator, part.right, d)
    x = x.reshape(n, d)
    span = np.linalg.norm(x[piece.edges[:, 0]] - x[piece.edges[:, 1]], axis=1).max(initial=0)
    if span <= CANCELLED * part.lever.max(initial=0):
        raise GeometryError("rotations and displacements do not depend on each other: the nodes would lie in one point")
    null, gap = fields[..., values <= SINGULAR], values[values > SINGULAR]
    loose = np.zeros(n, dtype=bool)
    if null.shape[2] > d:
        null, loose = set_aside(null, d)
    blind = unnoticed(_local(part, piece, b), residuals[:, 1:], layout, x, piece.edges) & (part.rotation >= 0)
    residual = float(np.abs(residuals[:, 0]).max()) / span
    evidence = Evidence(null.shape[2], residual, float(gap[0]) if len(gap) else float("inf"), m)
    return Positions(np.where(loose[:, None], np.nan, x - x[~loose].mean(axis=0)), evidence, blind)


def _shape(given: Equations, layout: Layout, piece: Piece) -> Positions:
    """Coordinates of one piece whose nodes have displacements only, up to its size.

    Raises
    ------
    GeometryError
        If more is free than translations and size.
    """
    d, m = layout.dim, len(piece.rows)
    order = len(piece.nodes)
    _, residuals, fields, values = least_squares(piece.operator, np.zeros(m), d)
    one = shape(fields, values, np.zeros(order, dtype=bool))
    links = sp.csr_array((np.ones(len(piece.edges)), piece.edges.T), shape=(order, order))
    points, gap = in_gauge(one.points, sp.csr_array(links + links.T)), values[values > SINGULAR]
    local = _local(given[piece.rows], piece, layout.block_size)
    blind = unnoticed(local, residuals[:, 1:], layout, np.nan_to_num(points), piece.edges)
    evidence = Evidence(one.dimension, float(values[d]), float(gap[0]) if len(gap) else float("inf"), m)
    return Positions(points, evidence, blind)


def _local(part: Equations, piece: Piece, b: int) -> Equations:
    """Equations of a piece, rows counted by its own nodes."""
    place = np.searchsorted(piece.nodes, part.row // b)
    known = piece.nodes[np.minimum(place, len(piece.nodes) - 1)] == part.row // b  # a row may not depend on its node
    own = (part.row >= 0) & known
    return replace(part, operator=piece.operator, row=np.where(own, place * b + part.row % b, -1))
