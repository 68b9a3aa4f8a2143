"""The mesh that fits all entries but a few.

Least squares spread what a wrong entry does over the mesh. So entries that stand out
(:mod:`unassemble.planar.suspects`) are set aside and the others are fitted again; that brings the mesh nearer to the
right one, where other entries may stand out, until nothing is left to explain or nothing more is gained.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..topology import Piece
from .conformal import conformal_map
from .cotangent import edge_weights
from .polish import SHORT, Problem, polish
from .suspects import find_suspects

_log = logging.getLogger(__name__)

ASIDE = 1e6
"""Standard deviation of entries set aside, over that of the others: it counts where nothing else holds a vertex."""


@dataclass(frozen=True, eq=False)
class RobustFit:
    """A mesh, and the entries that it does not fit.

    Attributes
    ----------
    z : (n,) complex128
    scale : float
    aside : (k,) int64
        Edges of the piece.
    """

    z: NDArray[np.complex128]
    scale: float
    aside: NDArray[np.int64]


def robust_fit(
    piece: Piece,
    weights: NDArray,
    z: NDArray | None,
    settled: Callable[[NDArray[np.float64]], bool],
    *,
    scale: float | None = None,
) -> RobustFit | None:
    """A mesh that fits all entries but a few; None where none is found.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.
    z : (n,) complex128, optional
        Start, where there is one.
    settled : callable
        Whether misfits, relative to the entry and a typical one, leave nothing to explain.
    scale : float, optional
        c, where it is known.
    """
    size = np.abs(weights) + np.median(np.abs(weights))
    for start in _starts(piece, weights, z):
        with suppress(SolverError), np.errstate(all="ignore"):  # a given scale may be out of all proportion
            found = _matched(piece, weights, start, size, settled, scale)
            if found is not None:
                return found
    return None


def _starts(piece: Piece, weights: NDArray, z: NDArray | None) -> Iterator[NDArray]:
    """The start given, and the conformal map of entries of ordinary size: a single one may bend or prevent it."""
    if z is not None:
        yield z
    size = np.abs(weights)
    sign = np.sign(np.median(weights))
    tame = sign * np.clip(sign * weights, 0.1 * np.median(size), np.quantile(size, 0.9))
    with suppress(GeometryError, SolverError):
        yield conformal_map(piece, tame, sharp=False).z


def _matched(
    piece: Piece,
    weights: NDArray,
    z: NDArray,
    size: NDArray,
    settled: Callable[[NDArray[np.float64]], bool],
    scale: float | None,
) -> RobustFit | None:
    """Entries set aside, in rounds; once the others fit, as few as will do."""
    aside = np.empty(0, dtype=np.int64)
    before, best = np.inf, None
    while True:
        rest = np.ones(len(weights), dtype=bool)
        rest[aside] = False
        found = polish(piece, weights, z, scale=scale, spread=np.where(rest, size, ASIDE * size), options=SHORT)
        fit = Problem(piece, weights, size, found.scale).at(found.z)
        misfit = np.abs(fit.misfit * fit.scale)
        left = float(np.linalg.norm(misfit[rest]))
        _log.debug("%d entries set aside: misfit %.1e, then %.1e", len(aside), before, left)
        if settled(misfit[rest]):
            best = RobustFit(found.z, found.scale, aside)
        elif best is not None or not 2 * left < before:
            return best
        before, z = left, found.z
        aside = find_suspects(piece, weights, z, found.scale, size, free_scale=scale is None).edges
        if not len(aside) or (best is not None and len(aside) >= len(best.aside)):
            return best


def differences_without(
    piece: Piece, weights: NDArray, z: NDArray, scale: float, aside: NDArray[np.int64], *, free_scale: bool
) -> NDArray[np.float64]:
    """(e,) what the mesh that is fitted to all entries but a few leaves of each weight; 0 for these few.

    Infinite where there is no such mesh.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.
    z : (n,) complex128
        Start.
    scale : float
        c, or where to begin with it.
    aside : (k,) int64
        Edges of the piece.
    free_scale : bool
        Whether c is fitted.
    """
    spread = np.abs(weights) + np.median(np.abs(weights))
    spread[aside] *= ASIDE
    try:
        with np.errstate(all="ignore"):
            found = polish(piece, weights, z, scale=None if free_scale else scale, spread=spread, options=SHORT)
            left = weights - found.scale * edge_weights(piece, found.z)
    except SolverError:
        return np.full(len(weights), np.inf)
    left[aside] = 0.0
    return np.where(np.isfinite(left), left, np.inf)
