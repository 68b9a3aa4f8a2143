"""Meshes whose boundary was eliminated: entries between two rows next to it still contain cells that are gone.

What such an entry has from the cell that is left is unknown, so that it has no part in the fit. Half of it, as where
the cells on both sides are alike, is what the fit begins with: on grids, which the other entries do not determine, the
fit stays there.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..matrix import OperatorMatrix
from ..planar.conformal import conformal_map
from ..planar.cotangent import edge_weights
from ..planar.inside import fit_inside
from ..planar.piece import PieceMesh
from ..planar.polish import SHORT, PolishedMesh, polish
from ..planar.robust import ASIDE
from ..tolerances import ALIKE, SUMMED
from ..topology import Piece
from ..words import count_of
from .judge.labelling import Labelling
from .search.search import first_labelling

_NOTE = (
    "entries between rows that do not add up to zero, as next to unknowns that were eliminated, still contain cells "
    "that are gone"
)


def incomplete_rows(matrix: OperatorMatrix) -> NDArray[np.bool_]:
    """(n,) rows that do not add up to zero, if any others do; none otherwise.

    A mass matrix that was added leaves none. How many there are is no matter: of small grids most rows are next to the
    boundary, and whether they are just those on the boundary of what is left is asked in any case.
    """
    size = np.abs(matrix.diagonal)
    sums = matrix.diagonal.copy()
    for end in matrix.edges.T:
        sums += np.bincount(end, matrix.entries, matrix.n)
        size += np.bincount(end, np.abs(matrix.entries), matrix.n)
    incomplete = np.abs(sums) > SUMMED * size
    return incomplete & ~incomplete.all()


def without_boundary(
    n: int, edges: NDArray, weights: NDArray, incomplete: NDArray[np.bool_], scale: float | None = None
) -> Labelling | None:
    """What angles suggest, where incomplete rows are just those of its boundary, and where it does not fit whole.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order; at least one.
    weights : (e,) float64
        -A_ij of each edge.
    incomplete : (n,) bool
        See :func:`incomplete_rows`.
    scale : float, optional
        c, where it is known.

    Returns
    -------
    Labelling or None
        With entries set aside if these are all that does not fit. None if the boundary is another, or if the mesh may
        be whole, with a diagonal matrix added on its boundary: it takes a search to tell which.
    """
    if not incomplete.any():
        return None
    between = np.asarray(incomplete[edges].all(axis=1))
    labellings = [first_labelling(n, edges, some) for some in (weights, np.where(between, weights / 2, weights))]
    inside = [one for one in labellings if one is not None and np.array_equal(_on_boundary(one), incomplete)]
    if not inside:
        return None
    whole = [Labelling.of(replace(one.candidates, weights=weights), one.labels) for one in inside]
    if any(one.fits for one in whole):  # a diagonal matrix was added on the boundary
        return None
    inner = _left_to_others(whole[-1], incomplete, scale)
    if inner.has_wrong_entries and None not in inner.meshes and (not _has_corners(inner) or _redundancy(inner) > 0):
        return inner
    may_be_whole = any(_has_corners(one) for one in whole)
    return None if may_be_whole else whole[0]


def _has_corners(labelling: Labelling) -> bool:
    """Whether sides have been supposed to have vanished; then a first labelling is easily wrong inside its boundary."""
    return bool((labelling.labels & labelling.candidates.corner).any())


def _redundancy(labelling: Labelling) -> int:
    """Entries that are not set aside, vanished ones counted, less positions and c of each piece."""
    aside = sum(len(mesh.aside) for mesh in labelling.meshes if mesh is not None and mesh.aside is not None)
    return sum(piece.redundancy for piece in labelling.pieces) - aside


def _left_to_others(labelling: Labelling, incomplete: NDArray[np.bool_], scale: float | None) -> Labelling:
    """The same cells, placed without the entries on their boundary between incomplete rows."""
    between = np.asarray(incomplete[labelling.edges].all(axis=1))
    meshes = []
    for piece in labelling.pieces:
        aside = np.flatnonzero(~piece.inner & between[piece.edge_rows])
        meshes.append(_without(piece, labelling.weights[piece.edge_rows], aside, scale))
    return labelling.placed(tuple(meshes))


def _on_boundary(labelling: Labelling) -> NDArray[np.bool_]:
    """(n,) vertices on the boundary of pieces, or with edges on none."""
    on_boundary = np.zeros(labelling.candidates.n_vertices, dtype=bool)
    bare = np.ones(len(labelling.edges), dtype=bool)
    for piece in labelling.pieces:
        on_boundary[piece.vertices[piece.boundary]] = True
        bare[piece.edge_rows] = False
    on_boundary[labelling.edges[bare]] = True
    return on_boundary


def _without(piece: Piece, weights: NDArray, aside: NDArray[np.int64], scale: float | None) -> PieceMesh | None:
    """Positions that fit all weights but some; None where there are none.

    With half of these grids are right to begin with, and stay so. Elsewhere more of them may be left out, near the
    boundary.
    """
    halved = weights.copy()
    halved[aside] /= 2
    spread = np.ones(len(weights))
    spread[aside] = ASIDE
    with suppress(GeometryError, SolverError):
        start = conformal_map(piece, halved, sharp=False)
        found = polish(piece, halved, start.z, scale=scale, spread=spread, options=SHORT)
        if np.delete(_fit(piece, weights, found), aside).all():
            return PieceMesh(found.z, found.scale, (_NOTE,), aside=aside)
    inner = fit_inside(piece, weights, aside, scale=scale)
    if inner is None:
        return None
    # Of entries set aside by choice there are fewer than of those that the mesh is held against.
    more = len(inner.aside) - len(aside)
    if piece.redundancy - len(inner.aside) <= more:
        return None
    return PieceMesh(inner.z, inner.scale, (_NOTE, *_more(more)), aside=inner.aside)


def _fit(piece: Piece, weights: NDArray, found: PolishedMesh) -> NDArray[np.bool_]:
    """(e,) entries that a mesh has."""
    given = weights / found.scale
    return np.asarray(np.abs(edge_weights(piece, found.z) - given) <= ALIKE * np.abs(given).max())


def _more(count: int) -> tuple[str, ...]:
    """What to say of entries near the boundary that have been set aside."""
    if not count:
        return ()
    return (f"{count_of(count, 'more entry', 'more entries')} near them did not fit, and points there may be wrong",)
