"""Corners in which planes of rollers meet: nodes that only rows touch which lack coefficients of every direction.

The node in such a corner lacks all directions and is not in the matrix. If it lies on all of the planes, what
:mod:`.planes` says of rows next to one plane holds next to all of them: block (c, b) with the missing sum put to the
plane across b gives A^{cb} x_b = p_c + 2 delta_cb q_b. In space that leaves d - 2 equations of each row, in the plane
none, unless lambda / mu is known. They are few and local, so that a small dense problem at each corner places its
nodes after all others.

That the missing node lies on all planes is an assumption, and so is that nodes lie in the planes across the directions
that they lack. They are borne out where the equations hold exactly and are more than the coordinates they determine, by
as many as are assumed at least: a node that lies elsewhere could make up for no more.

Of each coordinate x_b only the unknowns of direction b feel something, so that three nodes with one row each fit as
well as one with three. Nodes that are not beyond doubt for other reasons need elements that show them; and since these
have the missing node for a corner, it is given a place, too.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..corner_nodes import Corner
from ..nodal import NodalMatrix, determined, eliminated, surrounded
from .identities import Identities, identities
from .planes import with_planes
from .shape import EXACT, SOFT


def with_corners(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    terms: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and pieces after loose nodes next to corners were placed, as far as that is borne out.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) bool
        By the strict rule.
    points : (n, d) float64
        Unique but for translation and scale, mean edge length 1; NaN where not determined.
    component : (n,) int64
        Piece of each node, -1 where not determined.
    terms : (d, d, d, t) float64, optional
        Unknown boundary terms; see :func:`.identities.identities`.

    Returns
    -------
    points : (n, d) float64
    component : (n,) int64
    """
    whole = surrounded(nodal, valid)
    lacking = eliminated(nodal)
    loose = ~determined(points)
    corner = _next_to_corners(nodal, valid, loose)
    completed = with_planes(nodal, valid, whole=whole | corner) if corner.any() else None
    if completed is None:
        return points, component
    changed, full = completed
    points, component = points.copy(), component.copy()
    for rows, nodes in _places(nodal, corner, loose):
        around = identities(changed, full, rows, terms)
        pieces = np.unique(component[around.columns])
        if len(pieces[pieces >= 0]) == 1:
            points[nodes] = _placed(around, corner, nodes, int(lacking[nodes].sum()), points)
            component[nodes] = np.where(determined(points[nodes]), pieces[-1], -1)
    return points, component


def corners_of(
    nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64], loose: NDArray[np.bool_]
) -> tuple[Corner, ...]:
    """Where planes meet next to nodes that are not determined otherwise.

    A corner lies at the level of the nodes that lack a direction, for each; where these differ there is none.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) bool
        By the strict rule.
    points : (n, d) float64
        Mean edge length 1; NaN where not determined.
    loose : (n,) bool
        Nodes that nothing but what holds next to corners determines, if anything does.
    """
    corner, lacking = _next_to_corners(nodal, valid, loose), eliminated(nodal) & determined(points)[:, None]
    open_rows = ~surrounded(nodal, valid) & (nodal.row_of >= 0).any(axis=1)
    found = []
    for rows, nodes in _places(nodal, corner, loose):
        near = np.unique(nodal.graph[np.union1d(nodes, rows[corner[rows]])].indices)
        held = [points[near[lacking[near, b]], b] for b in range(nodal.dim)]
        if all(len(level) and np.ptp(level) <= EXACT for level in held):
            found.append(Corner(np.array([level.mean() for level in held]), near[open_rows[near]].astype(np.int64)))
    return tuple(found)


def _next_to_corners(nodal: NodalMatrix, valid: NDArray[np.bool_], loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes whose rows lack coefficients of every direction, and couple to loose ones."""
    near = (nodal.graph @ eliminated(nodal).astype(float) > 0).all(axis=1)
    return np.asarray(~surrounded(nodal, valid) & near & (nodal.graph @ loose.astype(float) > 0))


def _places(
    nodal: NodalMatrix, corner: NDArray[np.bool_], loose: NDArray[np.bool_]
) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Rows and the loose nodes that they touch, corner by corner; rows of loose nodes say which planes hold these."""
    graph = nodal.graph
    touched = loose & (graph @ corner.astype(float) > 0)
    rows = corner | touched
    pairs = rows[nodal.node] & touched[nodal.indices]
    shape = (2 * nodal.n, 2 * nodal.n)
    link = sp.csr_array((np.ones(pairs.sum()), (nodal.node[pairs], nodal.n + nodal.indices[pairs])), shape=shape)
    label = sp.csgraph.connected_components(link, directed=False)[1]
    found = []
    for place in np.unique(label[nodal.n :][touched]):
        here = label[: nodal.n] == place
        found.append((np.flatnonzero(here & rows), np.flatnonzero((label[nodal.n :] == place) & touched)))
    return found


def _placed(
    around: Identities, corner: NDArray[np.bool_], nodes: NDArray[np.int64], level: int, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k, d) points of the loose nodes of one corner, NaN where they are not determined or it is not borne out.

    The loose nodes lack `level` directions in all, and so many of their coordinates are assumed to be those of planes.
    """
    d, count = around.dim, len(nodes)
    none = np.full((count, d), np.nan)
    known = determined(points[around.columns])
    if np.isin(around.columns[~known], nodes, invert=True).any():
        return none
    unit = np.zeros((len(around.columns), d, count * d))
    place = np.searchsorted(around.columns, nodes)
    touched = np.isin(nodes, around.columns)
    for k in np.flatnonzero(touched):
        unit[place[k], range(d), range(k * d, k * d + d)] = 1
    design = around.residual(unit).reshape(len(around.rows), -1, count * d)
    given = np.where(known[:, None], points[around.columns], 0.0)[:, :, None]
    right = -around.residual(given).reshape(-1)
    whole = design.reshape(-1, count * d)
    u, s, v = np.linalg.svd(whole, full_matrices=False)
    strong = s > SOFT
    found = v[strong].T @ ((u[:, strong].T @ right) / s[strong])
    here = corner[around.rows]
    planes = np.linalg.matrix_rank(design[~here].reshape(-1, count * d), tol=SOFT) if (~here).any() else 0
    spare = said(around, here) - (strong.sum() - planes)
    if spare < d + level or np.abs(whole @ found - right).max() > EXACT:
        return none
    free = np.abs(v[~strong]).max(axis=0, initial=0) > EXACT
    loose = free.reshape(count, d).any(axis=1) | ~touched
    return np.where(loose[:, None], np.nan, found.reshape(count, d))


def said(around: Identities, some: NDArray[np.bool_]) -> int:
    """Independent equations of some rows, (m,) bool; those whose coefficients all vanish say nothing."""
    count = around.dim**3  # as many as a row can have
    fields = np.random.default_rng(0).standard_normal((len(around.columns), around.dim, count))
    values = around.residual(fields)[some].reshape(-1, count, count)
    return int(np.linalg.matrix_rank(values, tol=SOFT).sum()) if len(values) else 0
