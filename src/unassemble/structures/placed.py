"""Positions of all pieces that linear equations hold together, from equations that others would contradict."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.nodal import determined
from ..nodes.numbering import Numbering
from ..recovery import Evidence
from ..tolerances import CERTIFIED
from ..words import count_of
from .recognise import StructuralNumbering


@dataclass(frozen=True, eq=False)
class Piece:
    """Equations that share no node with others.

    Attributes
    ----------
    nodes : (k,) int64
        Increasing.
    rows : (m,) int64
        Of the equations of all pieces.
    operator : (m, k d) sparse
    edges : (e, 2) int64
        Coupled nodes, by their place in `nodes`.
    """

    nodes: NDArray[np.int64]
    rows: NDArray[np.int64]
    operator: sp.csr_array
    edges: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Positions:
    """Coordinates of one piece.

    Attributes
    ----------
    points : (n, d) float64
        Centroid at the origin; NaN where loose.
    evidence : Evidence
    unnoticed : (m,) bool
        Equations that a disturbance would change without being noticed; see :mod:`.redundancy`.
    """

    points: NDArray[np.float64]
    evidence: Evidence
    unnoticed: NDArray[np.bool_]


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
    used : (m,) bool
        Equations that these positions rest on.
    unnoticed : (m,) bool
        Those of them that a disturbance would change without being noticed.
    notes : tuple of str
    spoiled : (k,) int64
        Nodes whose rows contradict the others, and were left out.
    """

    points: NDArray[np.float64]
    component: NDArray[np.int64]
    evidence: tuple[Evidence, ...]
    used: NDArray[np.bool_]
    unnoticed: NDArray[np.bool_]
    notes: tuple[str, ...]
    spoiled: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    def fields(self, numbering: Numbering | StructuralNumbering) -> dict[str, Any]:
        """What every structure's recovery says of nodes, rows and pieces."""
        return {
            "component": self.component,
            "scale": np.full(len(self.evidence), np.nan),
            "node_status": (self.component < 0).astype(np.int8),
            "evidence": self.evidence,
            "node_of_row": numbering.node_of_row,
            "direction_of_row": numbering.direction_of_row,
            "numbering": numbering.kind,
        }

    @property
    def residual(self) -> float:
        """Largest residual of a piece."""
        return max(one.residual for one in self.evidence)

    @property
    def null_dimension(self) -> int:
        """Largest dimension of the null space of a piece."""
        return max(one.null_dimension for one in self.evidence)


def without_free(found: Placed, most: int) -> Placed:
    """Positions of the pieces whose null space has no larger dimension; of others they mean nothing.

    Raises
    ------
    GeometryError
        If no piece is left.
    """
    free = [k for k, one in enumerate(found.evidence) if one.null_dimension > most]
    if not free:
        return found
    largest = found.null_dimension
    said = f"the null space has dimension {largest} where {most} is expected"
    if len(free) == len(found.evidence):
        raise GeometryError(
            f"no positions were found: {said}. Supports leave too few whole rows, or unknowns of nodes are along axes "
            "of their own, as in cylindrical coordinates"
        )
    kept = np.setdiff1d(np.arange(len(found.evidence)), free)
    place = np.full(len(found.evidence) + 1, -1)
    place[kept] = np.arange(len(kept))
    component = place[found.component]
    return replace(
        found,
        points=np.where(component[:, None] < 0, np.nan, found.points),
        component=component,
        evidence=tuple(found.evidence[k] for k in kept),
        notes=(*found.notes, f"{said} in {count_of(len(free), 'piece')}, which were left out"),
    )


def covered(rows: NDArray[np.bool_], columns: NDArray[np.bool_]) -> str:
    """How much of a matrix speaks for the coordinates, in words: masks of its rows, and of the unknowns they touch."""
    return f"{rows.mean():.0%} of the rows say so, of {columns.mean():.0%} of the unknowns"


def placed(
    operator: sp.csr_array,
    d: int,
    edges: NDArray[np.int64],
    solve: Callable[[Piece], Positions],
    allowed: float = CERTIFIED,
) -> Placed:
    """Positions from equations that others would contradict; where too few are left, or all contradict, from all.

    Equations that would be disturbed without being noticed are left out, and what only they determine with them.

    Parameters
    ----------
    operator : (m, n d) sparse
    d : int
    edges : (e, 2) int64
        Coupled nodes.
    solve : callable
        Positions of one piece.
    allowed : float
        Residual up to which equations do not contradict each other.

    Raises
    ------
    GeometryError
        If no node is determined.
    """
    best = every = _placed(operator, d, edges, solve, np.ones(operator.shape[0], dtype=bool))
    while best.residual <= allowed and best.unnoticed.any():
        try:
            best = _placed(operator, d, edges, solve, best.used & ~best.unnoticed)
        except GeometryError:
            return every
    return best if best.null_dimension <= every.null_dimension else every


def _placed(
    operator: sp.csr_array,
    d: int,
    edges: NDArray[np.int64],
    solve: Callable[[Piece], Positions],
    used: NDArray[np.bool_],
) -> Placed:
    n = operator.shape[1] // d
    points, component = np.full((n, d), np.nan), np.full(n, -1)
    unnoticed = np.zeros(len(used), dtype=bool)
    found: list[Positions] = []
    notes: list[str] = []
    failure: GeometryError | None = None
    for piece in pieces(operator, d, edges, np.flatnonzero(used)):
        try:
            one = solve(piece)
        except GeometryError as error:
            failure = failure or error
            notes.append(f"the piece with node {piece.nodes[0]}: {error}")
            continue
        points[piece.nodes] = one.points
        component[piece.nodes[determined(one.points)]] = len(found)
        unnoticed[piece.rows] = one.unnoticed
        found.append(one)
    if not found:
        raise failure or GeometryError("no node has an equation that supports leave whole")
    return Placed(points, component, tuple(one.evidence for one in found), used, unnoticed, tuple(notes))


def pieces(
    operator: sp.csr_array, d: int, edges: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> Iterator[Piece]:
    """Connected pieces, in the order of their first nodes; nodes in no equation are in none.

    The work is that of one pass over the equations, however many pieces there are.

    Parameters
    ----------
    operator : (m, n d) sparse
    d : int
        Coordinates of a node.
    edges : (e, 2) int64
        Coupled nodes; those of different pieces are left out.
    rows : (k,) int64, optional
        The equations to use; all by default.
    """
    rows = np.arange(operator.shape[0]) if rows is None else rows
    operator = sp.csr_array(operator[rows])
    m, n = operator.shape[0], operator.shape[1] // d
    node = operator.indices // d
    row = np.repeat(np.arange(m), np.diff(operator.indptr))
    incidence = sp.csr_array((np.ones(len(node), np.int8), (row, m + node)), shape=(m + n, m + n))
    count, label = sp.csgraph.connected_components(incidence, directed=False)
    of_row, of_node = label[:m], label[m:]
    bodies, equations = _groups(of_node, count), _groups(of_row, count)
    inside = edges[of_node[edges[:, 0]] == of_node[edges[:, 1]]]
    links = _groups(of_node[inside[:, 0]], count)
    place = np.empty(n, np.int64)
    for body in bodies:
        place[body] = np.arange(len(body))
    used = [k for k in range(count) if len(bodies[k]) and len(equations[k])]
    for k in sorted(used, key=lambda k: bodies[k][0]):
        part = sp.csr_array(operator[equations[k]])
        columns = place[part.indices // d] * d + part.indices % d
        shape = (len(equations[k]), len(bodies[k]) * d)
        local = sp.csr_array((part.data, columns, part.indptr), shape=shape)
        yield Piece(bodies[k], rows[equations[k]], local, place[inside[links[k]]])


def _groups(label: NDArray, count: int) -> list[NDArray[np.int64]]:
    """Indices of each label, increasing."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
