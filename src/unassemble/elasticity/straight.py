"""Pieces that the identities leave bent, made straight by what their elements say.

Where a homogeneous body is held all around, no boundary term is left that would fix the axes: the identities have more
solutions than translations and scale. With the boundary terms known to vanish, inside, they are scalar equations, the
same for each coordinate, whose solutions are the affine functions. These make up an affine picture of the piece, of
which :mod:`.frame` finds the axes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from .frame import frame
from .identities import no_terms
from .nodal import NodalMatrix
from .placing import placed
from .shape import in_gauge
from .solution import Solution


def straightened(
    nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_], patch: int | None
) -> Solution | None:
    """The solution with as many of its bent pieces straight as elements explain; unchanged where there are none.

    Parameters
    ----------
    nodal : NodalMatrix
    found : Solution or None
        None where the identities determine nothing.
    valid : (n, d, d) bool
        By the strict rule.
    patch : int, optional
        Most nodes per chart.
    """
    inside = valid & (valid.all(axis=(1, 2)) & _bent(nodal, found))[:, None, None]
    if not inside.any():
        return found
    try:
        picture = placed(nodal, inside, patch, no_terms(nodal.dim), common=nodal.dim * (nodal.dim + 1))
    except GeometryError:
        return found
    points, ratios = np.full_like(picture.points, np.nan), {}
    graph = nodal.graph
    for piece in (piece for piece, freedom in enumerate(picture.freedoms) if freedom == "affine"):
        body = picture.component == piece
        one = frame(nodal, np.where(body[:, None], picture.points, np.nan))
        if one is not None:
            points[body] = in_gauge(picture.points[body] @ one.map.T, graph[body][:, body])
            ratios[piece] = one.ratio
    straight = replace(picture, valid=valid, points=points, freedoms=("",) * len(picture.freedoms))
    return _merged(found, straight, ratios) if ratios else found


def _bent(nodal: NodalMatrix, found: Solution | None) -> NDArray[np.bool_]:
    """(n,) nodes of pieces of which more than translation and scale is free."""
    if found is None:
        return np.ones(nodal.n, dtype=bool)
    return np.isin(found.component, [piece for piece, freedom in enumerate(found.freedoms) if freedom])


def _merged(found: Solution | None, straight: Solution, ratios: dict[int, float]) -> Solution:
    """Straight pieces in place of the bent ones that they are part of."""
    parts = [(straight, piece) for piece in ratios]
    if found is not None:
        better = np.unique(found.component[np.isin(straight.component, list(ratios))])
        parts = [(found, piece) for piece in range(len(found.freedoms)) if piece not in better] + parts
    component, points = np.full_like(straight.component, -1), np.full_like(straight.points, np.nan)
    for number, (source, piece) in enumerate(parts):
        here = source.component == piece
        component[here], points[here] = number, source.points[here]
    return replace(
        straight if found is None else found,
        component=component,
        points=points,
        evidence=tuple(source.evidence[piece] for source, piece in parts),
        freedoms=tuple(source.freedoms[piece] for source, piece in parts),
        straight=tuple(ratios.values()),
    )
