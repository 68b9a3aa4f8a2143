"""Positions piece by piece: the least singular fields of the identities, and the coordinates among them.

Of springs no linear field knows: what hangs on them alone has no position.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import GeometryError
from ...nodes.nodal import NodalMatrix, determined, valid_pairs
from ...nodes.shape import Shape, in_gauge, shape
from ...recovery import Evidence
from ...tolerances import ALIKE, SINGULAR
from .atlas import null_fields

# Nodes of a body whose best fit, where none is exact, one factorisation finds. Charts are no help there: each fits in
# its own way, and where two of them meet the joined field has a kink that costs far more than the misfit itself.
_WHOLE = {2: 250_000, 3: 30_000}


@dataclass(frozen=True, eq=False)
class Solution:
    """Positions of all pieces, and how surely they are known."""

    valid: NDArray[np.bool_]  # (n, d, d) row and column directions whose equations were used
    component: NDArray[np.int64]  # (n,) piece of each node, -1 where not determined
    points: NDArray[np.float64]  # (n, d)
    evidence: tuple[Evidence, ...]
    freedoms: tuple[str, ...]  # what remains free beyond translation and scale, per piece; mostly empty
    exact: bool  # whether all pieces have exact null fields
    warnings: tuple[str, ...]
    planes: bool = False  # whether nodes that lack a direction were taken to lie in planes across it
    straight: tuple[float, ...] = ()  # lambda / mu of the pieces whose axes the identities leave free and elements told
    # (n,) nodes that only equations determine that rest on an assumption, of planes
    hanging: NDArray[np.bool_] | None = None

    @property
    def unique(self) -> bool:
        """Whether what is determined is so up to translation and scale of its piece."""
        return self.exact and not any(self.freedoms)

    @property
    def firm_points(self) -> NDArray[np.float64]:
        """(n, d) the points, NaN where they hang on an assumption that nothing controls."""
        return self.points if self.hanging is None else np.where(self.hanging[:, None], np.nan, self.points)

    @property
    def rank(self) -> tuple[bool, bool, int, int]:
        """For comparison of solutions: exact, unique, and how many coordinates are determined, firmly and at all."""
        firm, points = np.isfinite(self.firm_points).sum(), np.isfinite(self.points).sum()
        return self.exact, not any(self.freedoms), int(firm), int(points)


# Some nodes of a piece and their shape; of a matrix, its valid rows and the nodes that the identities leave bent.
Straighten = Callable[[NodalMatrix, NDArray[np.bool_], NDArray[np.int64]], tuple[NDArray[np.int64], Shape] | None]


def placed(nodal: NodalMatrix, valid: NDArray[np.bool_], straighten: Straighten | None = None) -> Solution:
    """Positions piece by piece, from valid identities, (n, d, d) or (n, d, d, d); GeometryError if no piece has any."""
    component, n_pieces = pieces_of(nodal, valid)
    graph, d = nodal.graph, nodal.dim
    points = np.full((nodal.n, d), np.nan)
    shapes: list[Shape] = []
    warnings: list[str] = []
    failure: GeometryError | None = None
    told = np.asarray(valid.reshape(nodal.n, -1).any(axis=1))
    for piece in range(n_pieces):
        body = np.flatnonzero(component == piece)
        found = null_fields(nodal, valid, body)
        values = found.values
        # Unless more than translations satisfies the identities exactly, and not all fields that were looked for.
        if found.charts > 1 and not (len(values) > d and values[d] <= SINGULAR < values[-1]):
            if len(body) <= _WHOLE[d]:
                found = null_fields(nodal, valid, body, patch=len(body))
            else:
                warnings.append(
                    f"piece {piece} with node {body[0]} is too large for the best fit by one factorisation. The "
                    "points are those of smaller parts, joined, whose distances may be far from right"
                )
        one: tuple[NDArray[np.int64], Shape] | None = None
        try:
            one = found.nodes, shape(found.fields, found.values, told[found.nodes], found.rows)
        except GeometryError as error:
            why = error
        if straighten is not None and (one is None or one[1].freedom):
            one = straighten(nodal, valid, body) or one
        if one is None:
            failure = failure or why
            warnings.append(f"piece {piece} with node {body[0]}: {why}")
            lost = Evidence(int((found.values < SINGULAR).sum()), float("nan"), float("nan"), found.rows)
            shapes.append(Shape(np.empty((0, d)), lost))
            continue
        points[one[0]] = one[1].points
        points[body] = in_gauge(points[body], graph[body][:, body])
        shapes.append(one[1])
    points[drawn_together(nodal, valid, points)] = np.nan
    if not any(len(one.points) for one in shapes):
        raise failure or GeometryError("no row annihilates constants: no node has a valid equation")
    component = np.where(determined(points), component, -1)
    evidence, freedoms = tuple(one.evidence for one in shapes), tuple(one.freedom for one in shapes)
    straight = tuple(one.ratio for one in shapes if one.ratio is not None)
    exact = all(one.exact for one in shapes)
    return Solution(valid, component, points, evidence, freedoms, exact, tuple(warnings), straight=straight)


def pieces_of(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NDArray[np.int64], int]:
    """Pieces held together by valid identities; -1 for nodes that none of them touches.

    That nodes lie in one plane is said in places of rows that they lack; nothing but that makes no piece.
    """
    pairs = np.asarray(valid.reshape(*valid.shape[:3], -1).any(axis=3))
    live = (np.abs(nodal.data) * pairs[nodal.node]).max(axis=(1, 2)) > 0
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    _, label = sp.csgraph.connected_components(link, directed=False)
    own = valid.reshape(nodal.n, nodal.dim, -1).any(axis=2) & (nodal.row_of >= 0)
    told = np.bincount(label, own.any(axis=1)) > 0
    kept = np.flatnonzero(told & (np.bincount(label) > 1))
    order = np.full(len(told), -1)
    order[kept] = np.arange(len(kept))
    return order[label].astype(np.int64), len(kept)


def without_springs(nodal: NodalMatrix) -> NodalMatrix:
    """The matrix without blocks between two nodes that have no neighbour in common, and what they add to diagonals.

    A spring adds a block S to the rows of its two nodes, and takes it off between them. In the identities it stands for
    S (x_i - x_j), which vanishes for nodes in one place and is wrong for all others, since no linear field knows a
    spring. So a node that hangs on springs alone would be drawn onto its neighbours; it has no position. Two nodes of
    an element are coupled to its other nodes, too: a pair with no neighbour in common belongs to none.

    One of the two has whole rows, at least: next to eliminated nodes the neighbours in common may be gone.
    """
    i, j = nodal.node, nodal.indices
    graph = sp.csr_array((np.ones(len(j), dtype=np.int32), j, nodal.indptr), shape=(nodal.n, nodal.n))
    common = sp.csr_array((graph @ graph).multiply(graph))
    common.sort_indices()  # as those of the graph, so that places are the same
    alone = (common.data <= 2) & (i != j) & (nodal.data != 0).any(axis=(1, 2))  # each of the two is its own neighbour
    if not alone.any():
        return nodal
    whole = np.asarray(valid_pairs(nodal).all(axis=(1, 2)))
    alone &= whole[i] | whole[j]
    data = nodal.data.copy()
    np.add.at(data, np.flatnonzero(i == j)[i[alone]], data[alone])
    data[alone] = 0
    held = np.bincount(i, (data != 0).any(axis=(1, 2)) & (i != j), nodal.n) > 0
    return replace(nodal, data=data, size=np.where(held, nodal.size, 0.0))


def drawn_together(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) nodes in the place of one that they are coupled to, without whole rows that couple to nodes elsewhere.

    A web of springs that touches a body in one node is drawn there, whatever its nodes have in common. Bodies in
    contact have nodes upon each other that have rows of elements. Mean edges of the points have length one.
    """
    i, j, present = nodal.node, nodal.indices, nodal.row_of >= 0
    live = (i != j) & (nodal.data != 0).any(axis=(1, 2))
    away = np.abs(points[i] - points[j]).max(axis=1)
    near = live & (away <= ALIKE)
    near &= (present[i] & present[j]).any(axis=1)  # those with no direction in common may be halves of one node
    elsewhere = np.bincount(i, live & (away > ALIKE), nodal.n) > 0
    own = valid.reshape(nodal.n, -1).all(axis=1) & elsewhere
    return np.asarray((np.bincount(i, near, nodal.n) > 0) & ~own & determined(points))
