"""Positions of all pieces of a body, from the identities that are valid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from .atlas import NullFields, null_fields
from .material import poisson_ratio
from .nodal import NodalMatrix, determined, valid_pairs
from .planes import with_planes
from .results import Evidence
from .shape import EXACT, Shape, in_gauge, shape

# Nodes of a body whose best fit, where none is exact, one factorisation finds. Charts are no help there: each fits in
# its own way, and where two of them meet the joined field has a kink that costs far more than the misfit itself.
_WHOLE = {2: 250_000, 3: 30_000}


@dataclass(frozen=True, eq=False)
class Solution:
    """Positions of all pieces, and how surely they are known.

    Attributes
    ----------
    valid : (n, d, d) bool
        Row and column directions whose equations were used.
    component : (n,) int64
        Piece of each node, -1 where not determined.
    points : (n, d) float64
    evidence : tuple of Evidence
    freedoms : tuple of str
        What remains free beyond translation and scale, per piece; mostly empty.
    exact : bool
        Whether all pieces have exact null fields.
    warnings : tuple of str
    ratio : float or None
        lambda / mu, where it was used.
    strict : bool
        Whether rows were judged by the strict rule.
    planes : bool
        Whether nodes that lack a direction were taken to lie in planes across it.
    """

    valid: NDArray[np.bool_]
    component: NDArray[np.int64]
    points: NDArray[np.float64]
    evidence: tuple[Evidence, ...]
    freedoms: tuple[str, ...]
    exact: bool
    warnings: tuple[str, ...]
    ratio: float | None = None
    strict: bool = True
    planes: bool = False

    @property
    def whole(self) -> bool:
        """Whether every node is determined, up to translation and scale of its piece."""
        return self.exact and not any(self.freedoms) and bool(np.isfinite(self.points).all())

    @property
    def rank(self) -> tuple[bool, bool, int]:
        """For comparison of solutions: exact, unique, and how many coordinates are determined."""
        return self.exact, not any(self.freedoms), int(np.isfinite(self.points).sum())


def solve(nodal: NodalMatrix, patch: int | None) -> Solution:
    """Place all nodes: read validity strictly, and only where that determines nothing leniently."""
    best: Solution | None = None
    failure: GeometryError | None = None
    for strict in (True, False):
        valid = valid_pairs(nodal, strict=strict)
        if best is not None and np.array_equal(valid, best.valid):
            break
        found = None
        try:
            found = _positions(nodal, valid, patch)
        except GeometryError as error:
            failure = failure or error
        completed = with_planes(nodal, valid) if strict and not (found is not None and found.whole) else None
        if completed is not None:
            found = _with_planes(*completed, found, valid, patch)
        if found is None:
            continue
        found = replace(_with_ratio(nodal, found, completed, patch), strict=strict)
        if found.exact and not any(found.freedoms):
            return found
        best = best or found
    if best is None:
        raise failure or GeometryError("no positions fit the valid rows")
    return best


def _with_planes(
    completed: NodalMatrix, full: NDArray[np.bool_], found: Solution | None, valid: NDArray[np.bool_], patch: int | None
) -> Solution | None:
    """Once more with what rows next to rollers say, if that fits and determines more."""
    try:
        other = replace(_positions(completed, full, patch), planes=True, valid=valid)
    except GeometryError:
        return found
    if not other.exact or (found is not None and other.rank <= found.rank):
        return found
    return other


def _with_ratio(
    nodal: NodalMatrix,
    found: Solution,
    completed: tuple[NodalMatrix, NDArray[np.bool_]] | None,
    patch: int | None,
) -> Solution:
    """Once more with Poisson's ratio, if it is one number and nodes were left loose."""
    if found.whole or not found.exact or any(found.freedoms):  # points that are not unique have no ratio to read off
        return found
    nu = poisson_ratio(nodal, found.valid, found.points)
    if nu is None:
        return found
    rows = completed if completed is not None and found.planes else (nodal, found.valid)
    try:
        other = _positions(*rows, patch, 2 * nu / (1 - 2 * nu))
    except GeometryError:
        return found
    return replace(other, planes=found.planes, valid=found.valid) if other.rank > found.rank else found


def _positions(nodal: NodalMatrix, valid: NDArray[np.bool_], patch: int | None, ratio: float | None = None) -> Solution:
    """Positions piece by piece."""
    component, n_pieces = _pieces(nodal, valid)
    graph = sp.csr_array((np.ones(len(nodal.indices)), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    points = np.full((nodal.n, nodal.dim), np.nan)
    evidence, freedoms, exact, warnings = [], [], [], []
    failure: GeometryError | None = None
    for piece in range(n_pieces):
        body = np.flatnonzero(component == piece)
        found = null_fields(nodal, valid, body, patch=patch, ratio=ratio)
        if found.charts > 1 and not _settled(found):
            if len(body) <= _WHOLE[nodal.dim]:
                found = null_fields(nodal, valid, body, patch=len(body), ratio=ratio)
            else:
                warnings.append(
                    f"piece {piece} with node {body[0]} is too large for the best fit by one factorisation; the "
                    "points are those of smaller parts, joined, whose distances may be far from right"
                )
        try:
            told = np.asarray(valid.reshape(nodal.n, -1)[found.nodes].any(axis=1))
            one = shape(found.fields, found.values, graph[found.nodes][:, found.nodes], told)
        except GeometryError as error:
            failure = failure or error
            warnings.append(f"piece {piece} with node {body[0]}: {error}")
            evidence.append(Evidence(int((found.values < EXACT).sum()), float("nan"), float("nan"), found.rows))
            continue
        points[found.nodes] = one.points
        points[body] = in_gauge(points[body], graph[body][:, body])
        evidence.append(_evidence(found, one))
        freedoms.append(one.freedom)
        exact.append(one.exact)
    if not exact:
        raise failure or GeometryError("no row annihilates constants: no node has a valid equation")
    component = np.where(determined(points), component, -1)
    return Solution(valid, component, points, tuple(evidence), tuple(freedoms), all(exact), tuple(warnings), ratio)


def _settled(found: NullFields) -> bool:
    """Whether more than translations satisfies the identities exactly, and not all fields that were looked for."""
    d = found.fields.shape[1]
    return len(found.values) > d and bool(found.values[d] <= EXACT < found.values[-1])


def _pieces(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NDArray[np.int64], int]:
    """Pieces held together by valid identities; -1 for nodes that none of them touches."""
    pairs = valid if valid.ndim == 3 else np.asarray(valid.any(axis=3))
    live = (np.abs(nodal.data) * pairs[nodal.node]).max(axis=(1, 2)) > 0
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    _, label = sp.csgraph.connected_components(link, directed=False)
    size = np.bincount(label)
    kept = np.flatnonzero(size > 1)
    order = np.full(len(size), -1)
    order[kept] = np.arange(len(kept))
    return order[label].astype(np.int64), len(kept)


def _evidence(found: NullFields, one: Shape) -> Evidence:
    d = found.fields.shape[1]
    null = max(int((found.values <= EXACT).sum()), d + 1)
    gap = float(found.values[null]) if null < len(found.values) else float("inf")
    return Evidence(one.dimension, float(found.values[d]), gap, found.rows)
