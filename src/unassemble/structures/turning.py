"""Positions of the nodes of frames, shells and plates, from the equations that deserve most trust."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elasticity.nullspace.shape import EXACT, set_aside
from ..elasticity.results import Evidence
from ..errors import GeometryError, RecoveryError
from ..tolerances import CERTIFIED
from .equations import Equations, equations
from .layouts import Layout
from .nodes import Nodes
from .pieces import Piece
from .placed import Placed, Positions, placed
from .positions import least_squares
from .redundancy import unnoticed

_NOTHING = 1e-9  # of what rotations of nodes contribute: displacements between coupled nodes that are rounding


@dataclass(frozen=True, eq=False)
class Turned:
    """Positions that make rigid rotations free of forces.

    Attributes
    ----------
    placed : Placed
    counted : (n, b, rotations) bool
        Rows and rotations whose forces have to vanish.
    springs : bool
        Whether only equations were used that springs between rotations and the ground leave alone.
    """

    placed: Placed
    counted: NDArray[np.bool_]
    springs: bool

    @property
    def doubts(self) -> tuple[bool, bool, bool, int, float]:
        """What speaks against these positions, the gravest first."""
        found, d = self.placed, self.placed.points.shape[1]
        free = any(one.null_dimension > d for one in found.evidence)
        lost = int(np.count_nonzero(found.component < 0))
        return found.residual > CERTIFIED, free, bool(found.unnoticed.any()), lost, found.residual


def turning_positions(nodes: Nodes) -> Turned:
    """Positions from all rows; where these contradict or do not check each other, from those that no spring spoils.

    Raises
    ------
    GeometryError
        If no node is determined.
    """
    attempts: list[Turned] = []
    failure: RecoveryError | None = None
    for springs in (False, True):
        try:
            attempts.append(_attempt(nodes, springs=springs))
        except RecoveryError as error:
            failure = failure or error
            continue
        if not any(attempts[-1].doubts[:3]) and attempts[-1].placed.used.all():
            break
    if not attempts:
        raise failure or GeometryError("no node has an equation that supports leave whole")
    return min(attempts, key=lambda one: one.doubts)


def _attempt(nodes: Nodes, *, springs: bool) -> Turned:
    layout, valid = nodes.layout, nodes.whole()
    given = equations(nodes, valid, springs=springs)
    edges = np.column_stack(sp.triu(nodes.graph, 1).nonzero())
    found = placed(given.operator, layout.dim, edges, lambda piece: _positions(given, layout, piece), CERTIFIED)
    if springs:
        valid[:, len(layout.displacements) :] = False
    left = given[~found.used]
    valid.reshape(-1, valid.shape[2])[left.row, left.rotation] = False
    return Turned(found, valid, springs)


def _positions(given: Equations, layout: Layout, piece: Piece) -> Positions:
    """Coordinates of one piece.

    Raises
    ------
    GeometryError
        If there are fewer equations than unknowns leave room for, or far more is free than translations.
    """
    d, b, n = layout.dim, layout.block_size, len(piece.nodes)
    m = len(piece.rows)
    if n < 2 or m < (n - 1) * d:
        raise GeometryError(f"{m} equations are too few for {n} nodes: too much lies next to supports")
    part = given[piece.rows]
    x, probes, fields, values = least_squares(piece.operator, part.right, d)
    x = x.reshape(n, d)
    span = np.linalg.norm(x[piece.edges[:, 0]] - x[piece.edges[:, 1]], axis=1).max(initial=0)
    if span <= _NOTHING * part.lever.max(initial=0):
        raise GeometryError("rotations and displacements do not depend on each other: the nodes would lie in one point")
    null, gap = fields[..., values <= EXACT], values[values > EXACT]
    loose = np.zeros(n, dtype=bool)
    if null.shape[2] > d:
        null, loose = set_aside(null, d)
    place = np.searchsorted(piece.nodes, part.row // b)
    own = (part.row >= 0) & (piece.nodes[np.minimum(place, n - 1)] == part.row // b)
    local = replace(part, operator=piece.operator, row=np.where(own, place * b + part.row % b, -1))
    blind = unnoticed(local, probes[:, 1:], layout, x, piece.edges)
    residual = float(np.abs(probes[:, 0]).max()) / span
    evidence = Evidence(null.shape[2], residual, float(gap[0]) if len(gap) else float("inf"), m)
    return Positions(np.where(loose[:, None], np.nan, x - x[~loose].mean(axis=0)), evidence, blind)
