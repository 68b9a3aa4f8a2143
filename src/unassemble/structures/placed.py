"""Positions of all pieces that linear equations hold together, from equations that others would contradict."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.nodal import determined
from ..recovery import Evidence
from ..tolerances import CERTIFIED


class EquationPiece(NamedTuple):
    """Equations that share no node with others."""

    nodes: NDArray[np.int64]  # (k,), increasing
    rows: NDArray[np.int64]  # (m,) of the equations of all pieces
    operator: sp.csr_array  # (m, k d)
    edges: NDArray[np.int64]  # (e, 2) coupled nodes, by their place in `nodes`


def pieces(
    operator: sp.csr_array, d: int, edges: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> Iterator[EquationPiece]:
    """Connected pieces, in the order of their first nodes, of equations (m, n d); nodes in no equation are in none.

    Coupled nodes, `edges` (e, 2), of different pieces are left out. Used are all equations or those of `rows`, (k,).
    """
    rows = np.arange(operator.shape[0]) if rows is None else rows
    operator = sp.csr_array(operator[rows])
    m, n = operator.shape[0], operator.shape[1] // d
    row = np.repeat(np.arange(m), np.diff(operator.indptr))
    incidence = sp.csr_array((np.ones(len(row), np.int8), (n + row, operator.indices // d)), shape=(n + m, n + m))
    label = sp.csgraph.connected_components(incidence, directed=False)[1]
    of_node, of_row = label[:n], label[n:]
    for k in np.unique(of_row):
        body, own = np.flatnonzero(of_node == k), np.flatnonzero(of_row == k)
        unknowns = (body[:, None] * d + np.arange(d)).ravel()
        links = np.searchsorted(body, edges[(of_node[edges] == k).all(axis=1)])
        if len(body):
            yield EquationPiece(body, rows[own], sp.csr_array(operator[own][:, unknowns]), links)


# Points (k, d) of a piece, NaN where loose, its evidence, and equations (m,) that a disturbance would change without
# being noticed; see :mod:`.turning`.
Solve = Callable[[EquationPiece], tuple[NDArray[np.float64], Evidence, NDArray[np.bool_]]]


@dataclass(frozen=True, eq=False)
class PlacedNodes:
    """Positions of the nodes of all pieces."""

    points: NDArray[np.float64]  # (n, d), NaN where not determined
    component: NDArray[np.int64]  # (n,) piece of each node, -1 where not determined
    evidence: tuple[Evidence, ...]  # one per piece
    used: NDArray[np.bool_]  # (m,) equations that these positions rest on
    unnoticed: NDArray[np.bool_]  # (m,) those of them that a disturbance would change without being noticed
    notes: tuple[str, ...] = ()
    # whether only forces say where the nodes of a piece are, and would fit as well if these were under loads
    loaded: bool = False
    # nodes whose rows contradict the others, and were left out
    spoiled: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def residual(self) -> float:
        """Largest residual of a piece."""
        return max(one.residual for one in self.evidence)

    @property
    def null_dimension(self) -> int:
        """Largest dimension of the null space of a piece."""
        return max(one.null_dimension for one in self.evidence)


def without(found: PlacedNodes, lost: NDArray[np.bool_]) -> PlacedNodes:
    """The same without the positions of some nodes, (n,); GeometryError where none is left."""
    if lost.any() and not (found.component[~lost] >= 0).any():
        raise GeometryError("nothing shows which rows belong to one node: give the numbering if it is known")
    points = np.where(lost[:, None], np.nan, found.points)
    return replace(found, points=points, component=np.where(lost, -1, found.component))


def without_free(found: PlacedNodes, most: int) -> PlacedNodes:
    """The same; GeometryError where the null space of a piece has a larger dimension: positions mean nothing."""
    if found.null_dimension > most:
        raise GeometryError(
            f"no positions were found: the null space has dimension {found.null_dimension} where {most} is expected. "
            "Supports leave too few whole rows, or unknowns of nodes are along axes of their own, as in cylindrical "
            "coordinates"
        )
    return found


def placed(
    operator: sp.csr_array, d: int, edges: NDArray[np.int64], solve: Solve, allowed: float = CERTIFIED
) -> PlacedNodes:
    """Positions from equations that others would contradict; where too few are left, or all contradict, from all.

    Equations (m, n d) that would be disturbed without being noticed are left out, and what only they determine with
    them; they contradict each other if residuals exceed what is `allowed`. GeometryError if no node is determined.
    """

    def from_those(used: NDArray[np.bool_]) -> PlacedNodes:
        n = operator.shape[1] // d
        points, component = np.full((n, d), np.nan), np.full(n, -1)
        unnoticed, notes = np.zeros(len(used), dtype=bool), []
        evidence: list[Evidence] = []
        failure: GeometryError | None = None
        for piece in pieces(operator, d, edges, np.flatnonzero(used)):
            try:
                points[piece.nodes], one, unnoticed[piece.rows] = solve(piece)
            except GeometryError as error:
                failure = failure or error
                notes.append(f"the piece with node {piece.nodes[0]}: {error}")
                continue
            component[piece.nodes[determined(points[piece.nodes])]] = len(evidence)
            evidence.append(one)
        if not evidence:
            raise failure or GeometryError("no node has an equation that supports leave whole")
        return PlacedNodes(points, component, tuple(evidence), used, unnoticed, tuple(notes))

    best = every = from_those(np.ones(operator.shape[0], dtype=bool))
    while best.residual <= allowed and best.unnoticed.any():
        try:
            best = from_those(best.used & ~best.unnoticed)
        except GeometryError:
            return every
    return best if best.null_dimension <= every.null_dimension else every
