"""Positions piece by piece: the least singular fields of the identities, and the coordinates among them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import GeometryError
from ...nodes.nodal import NodalMatrix, determined, linked
from ...nodes.shape import Shape, in_gauge, shape
from ...recovery import Evidence
from ...tolerances import SINGULAR
from ..springs import drawn_together
from .atlas import NullFields, null_fields
from .solution import Solution

# Nodes of a body whose best fit, where none is exact, one factorisation finds. Charts are no help there: each fits in
# its own way, and where two of them meet the joined field has a kink that costs far more than the misfit itself.
_WHOLE = {2: 250_000, 3: 30_000}


def placed(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> Solution:
    """Positions piece by piece, from valid identities, (n, d, d) or (n, d, d, d).

    Raises
    ------
    GeometryError
        If no piece has positions.
    """
    component, n_pieces = pieces_of(nodal, valid)
    graph = nodal.graph
    points = np.full((nodal.n, nodal.dim), np.nan)
    evidence, freedoms, exact, warnings = [], [], [], []
    failure: GeometryError | None = None
    for piece in range(n_pieces):
        body = np.flatnonzero(component == piece)
        found = null_fields(nodal, valid, body)
        if found.charts > 1 and not _settled(found):
            if len(body) <= _WHOLE[nodal.dim]:
                found = null_fields(nodal, valid, body, patch=len(body))
            else:
                warnings.append(
                    f"piece {piece} with node {body[0]} is too large for the best fit by one factorisation. The "
                    "points are those of smaller parts, joined, whose distances may be far from right"
                )
        told = np.asarray(valid.reshape(nodal.n, -1).any(axis=1))
        try:
            one = shape(found.fields, found.values, told[found.nodes])
        except GeometryError as error:
            failure = failure or error
            warnings.append(f"piece {piece} with node {body[0]}: {error}")
            evidence.append(Evidence(int((found.values < SINGULAR).sum()), float("nan"), float("nan"), found.rows))
            freedoms.append("")
            continue
        points[found.nodes] = one.points
        points[body] = in_gauge(points[body], graph[body][:, body])
        evidence.append(_evidence(found, one))
        freedoms.append(one.freedom)
        exact.append(one.exact)
    points[drawn_together(nodal, valid, points)] = np.nan
    if not exact:
        raise failure or GeometryError("no row annihilates constants: no node has a valid equation")
    component = np.where(determined(points), component, -1)
    return Solution(valid, component, points, tuple(evidence), tuple(freedoms), all(exact), tuple(warnings))


def _settled(found: NullFields) -> bool:
    """Whether more than translations satisfies the identities exactly, and not all fields that were looked for."""
    d = found.fields.shape[1]
    return len(found.values) > d and bool(found.values[d] <= SINGULAR < found.values[-1])


def pieces_of(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NDArray[np.int64], int]:
    """Pieces held together by valid identities; -1 for nodes that none of them touches.

    That nodes lie in one plane is said in places of rows that they lack; nothing but that makes no piece.
    """
    live = linked(nodal, valid)
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    _, label = sp.csgraph.connected_components(link, directed=False)
    own = valid.reshape(nodal.n, nodal.dim, -1).any(axis=2) & (nodal.row_of >= 0)
    told = np.bincount(label, own.any(axis=1)) > 0
    kept = np.flatnonzero(told & (np.bincount(label) > 1))
    order = np.full(len(told), -1)
    order[kept] = np.arange(len(kept))
    return order[label].astype(np.int64), len(kept)


def _evidence(found: NullFields, one: Shape) -> Evidence:
    d = found.fields.shape[1]
    null = max(one.null, d + 1)
    gap = float(found.values[null]) if null < len(found.values) else float("inf")
    return Evidence(one.dimension, float(found.values[d]), gap, found.rows)
