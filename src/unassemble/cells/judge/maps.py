"""The conformal map of a piece that fits its entries best, where cells may be wrong.

The mesh is the map of the least quotient E / a if its cells are right. The area form of a cell of three or four corners
has one positive eigenvalue, so that by interlacing each cell too many brings at most one map of a lesser quotient: one
of the cell that is none. Among the first few maps the mesh is the one that fits most entries.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...errors import GeometryError, SolverError
from ...linalg import factorisation
from ...matrix.operator import row_sizes
from ...planar.conformal import ConformalOptions, conformal_map
from ...planar.cotangent import edge_weights
from ...planar.krylov import ShiftedSearch
from ...planar.pencil import ConformalPencil
from ...planar.piece import PieceMesh
from ...topology import Piece
from .small_maps import SMALL, small_maps

_OPTIONS = ConformalOptions(max_factorisations=4)  # what takes more has wrong cells
_MAPS = 5  # that are looked at in small pieces
_STEPS, _SHIFTS = 24, (0.9, 0.9, 0.99)  # of Krylov spaces that have the next maps to some digits
_NEAR = 0.8  # of c, above which a shift shows the maps about it as they are
_REFINED = 2  # steps to the map itself
_FITS = 1e-3  # mean misfit of a map that need not be compared with others
_EXACT = 1e-9  # and of one that fits


def best_map(piece: Piece, weights: NDArray) -> PieceMesh | None:
    """The map that fits best; None where the entries allow none.

    Of a piece that has no more weights than coordinates all maps fit, and the first is taken.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij of its edges.
    """
    small = piece.n_vertices <= SMALL
    maps = small_maps(piece, weights, _MAPS) if small else _first_map(piece, weights)
    if not maps or piece.redundancy <= 0:
        return next(iter(maps), None)
    unit = maps[0].scale
    relative = weights / unit
    mean = mean_misfit(piece.edges, relative)

    def misfit(z: NDArray, c: float) -> float:
        with np.errstate(all="ignore"):  # flat triangles fit nothing
            return mean(c * edge_weights(piece, z))

    if small:
        return min(maps, key=lambda one: _unfolded(misfit(one.z, one.scale / unit), first=one is maps[0]))
    z, c = best_of(ConformalPencil(piece, relative), maps[0].z, misfit)
    return PieceMesh(z, c * unit)


def _first_map(piece: Piece, weights: NDArray) -> list[PieceMesh]:
    try:
        found = conformal_map(piece, weights, sharp=False, options=_OPTIONS)
    except (GeometryError, SolverError):
        return []
    return [PieceMesh(found.z, found.scale)] if np.isfinite(found.z).all() and found.scale else []


def best_of(
    pencil: ConformalPencil, z: NDArray[np.complex128], misfit: Callable[[NDArray, float], float]
) -> tuple[NDArray[np.complex128], float]:
    """The map that fits best, z (n,), and its c: the first, whose c is 1, or one of the next.

    Parameters
    ----------
    pencil : ConformalPencil
        Of weights over the c of the first map.
    z : (n,) complex128
        The first map.
    misfit : callable
        Mean misfit of a map and its c.
    """
    least = misfit(z, 1.0)
    if least <= _FITS:
        return z, 1.0
    search = ShiftedSearch(pencil, factorisation, _STEPS)
    best = least, z, 1.0
    z = np.random.default_rng(0).standard_normal((len(z), 2)).view(np.complex128).ravel()
    shift = 0.0
    try:
        for nearer in _SHIFTS:  # from a distance maps that have nearly the same c are mixed, and theirs is too great
            if nearer == _SHIFTS[0] and _NEAR * best[2] < shift < best[2]:
                continue
            shift = nearer * best[2]
            search.at(shift, z)
            maps = [(_unfolded(misfit(*one), first=False), *one) for one in search.maps()]
            best = min([best, *maps], key=lambda one: one[0])
            z = best[1]
            if best[0] == least:
                break
        else:
            z, c = best[1:]
            for _ in range(_REFINED):
                z, c = search.nearest(c, z)
            best = min(best, (_unfolded(misfit(z, c), first=False), z, c), key=lambda one: one[0])
    except (GeometryError, SolverError, np.linalg.LinAlgError, ValueError):
        pass
    return best[1], best[2]


def mean_misfit(edges: NDArray, given: NDArray) -> Callable[[NDArray], float]:
    """The mean misfit of weights (e,) relative to the smaller of both rows' largest ones, at most 1.

    The mean of the squares is small where all fit a little, this one where all fit but for some.
    """
    smaller = row_sizes(int(edges.max()) + 1, edges, np.abs(given))[edges].min(axis=1)

    def mean(fitted: NDArray) -> float:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # entries next to far larger ones underflow
            misfit = np.abs(fitted - given) / smaller
        return float(np.where(misfit < 1, misfit, 1.0).mean())

    return mean


def _unfolded(misfit: float, *, first: bool) -> float:
    """The misfit of a map; infinite if it fits and is not the first: then some of its triangles are turned over."""
    return misfit if first or misfit > _EXACT else np.inf
