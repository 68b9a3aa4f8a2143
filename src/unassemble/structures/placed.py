"""Positions of all pieces of a structure, from the equations that deserve most trust."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elasticity.nodal import determined
from ..errors import GeometryError, RecoveryError
from ..recovery import Evidence
from .equations import Equations, equations
from .nodes import Nodes
from .pieces import pieces
from .positions import positions

CERTIFIED = 1e-9


@dataclass(frozen=True, eq=False)
class Placed:
    """Positions of the nodes of all pieces.

    Attributes
    ----------
    points : (n, d) float64
        NaN where not determined.
    component : (n,) int64
        Piece of each node, -1 where not determined.
    evidence : tuple of Evidence
        One per piece.
    unchecked : int
        See :class:`.positions.Positions`.
    notes : list of str
    springs : bool
        Whether only equations were used that springs between rotations and the ground leave alone.
    strict : bool
        Whether only equations were used that no support can have spoiled; see :meth:`.nodes.Nodes.whole`.
    valid : (n, b, rotations) bool
        The equations that hold all that assembly gave them, by that rule.
    """

    points: NDArray[np.float64]
    component: NDArray[np.int64]
    evidence: tuple[Evidence, ...]
    unchecked: int
    notes: list[str]
    springs: bool
    strict: bool
    valid: NDArray[np.bool_]

    @property
    def doubts(self) -> tuple[bool, bool, bool, float]:
        """What speaks against these positions, the gravest first."""
        worst = max(one.residual for one in self.evidence)
        free = any(one.null_dimension > self.points.shape[1] for one in self.evidence)
        return worst > CERTIFIED, free, self.unchecked > 0 or not self.strict, worst


def best_positions(nodes: Nodes) -> Placed:
    """Positions from all rows; where these contradict or do not check each other, from those that no spring spoils.

    Where supports leave too few of either, from rows that supports may have spoiled.

    Raises
    ------
    GeometryError
        If no node is determined.
    """
    attempts: list[Placed] = []
    failure: RecoveryError | None = None
    for strict in (True, False):
        valid = nodes.whole(strict=strict)
        for springs in (False, True):
            try:
                attempts.append(_placed(nodes, valid, springs=springs, strict=strict))
            except RecoveryError as error:
                failure = failure or error
                continue
            if not any(attempts[-1].doubts[:3]):
                return attempts[-1]
    if not attempts:
        raise failure or GeometryError("no row annihilates translations: no node has a valid equation")
    return min(attempts, key=lambda one: one.doubts)


def _placed(nodes: Nodes, valid: NDArray[np.bool_], *, springs: bool, strict: bool) -> Placed:
    """Positions piece by piece."""
    d = nodes.layout.dim
    given = equations(nodes, valid, springs=springs)
    points, component = np.full((nodes.n, d), np.nan), np.full(nodes.n, -1)
    evidence: list[Evidence] = []
    notes: list[str] = []
    unchecked = 0
    failure: GeometryError | None = None
    edges = np.column_stack(sp.triu(nodes.graph, 1).nonzero())
    for piece in pieces(given.operator, d, edges):
        part = Equations(piece.operator, given.right[piece.rows], given.trusting[piece.rows])
        try:
            one = positions(part, d, piece.edges)
        except GeometryError as error:
            failure = failure or error
            notes.append(f"the piece with node {piece.nodes[0]}: {error}")
            continue
        points[piece.nodes] = one.points
        component[piece.nodes[determined(one.points)]] = len(evidence)
        unchecked += one.unchecked
        evidence.append(Evidence(one.dimension, one.residual, one.gap, len(piece.rows)))
    if not evidence:
        raise failure or GeometryError(
            "no row annihilates translations and couples to no support: no node has a valid equation"
        )
    return Placed(points, component, tuple(evidence), unchecked, notes, springs, strict, valid)
