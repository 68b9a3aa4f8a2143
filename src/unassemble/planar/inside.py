"""The mesh inside a boundary whose entries tell nothing.

Where unknowns on the boundary were eliminated, entries on the new boundary still have a cotangent of a triangle that is
gone. All others determine nearly every vertex, though by no linear equations: c times the sum of two cotangents is
given on each inner edge, 3 v - 3 - 2 b of them in a disc with b vertices on its boundary. The conformal map for guessed
entries is a start, since what they are off by acts like a line under tension, the less the smaller the triangles are.
Guessed too small they let the map run away into the boundary, so they are guessed large.

Some vertices near the boundary then come to lie on the wrong side, where they stay and bend the others. Entries near
the boundary that stand out are set aside, in rounds, until all others fit.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..topology import Piece
from .cautious import CautiousOptions, cautious_polish
from .conformal import conformal_map
from .cotangent import edge_weights
from .robust import ASIDE, RobustFit

_log = logging.getLogger(__name__)

_SHORT = CautiousOptions(max_steps=10)


@dataclass(frozen=True)
class InsideOptions:
    """Settings of the rounds.

    Attributes
    ----------
    guesses : tuple of float
        Parts of the entries that are unknown, to begin with.
    rounds : int
    gain : float
        Part of the misfit to which a round must lower it for no more entries to be set aside.
    fits, fits_again : float
        Misfit that is none, in typical entries; of one that was set aside, which may have held nothing since.
    out : (float, float)
        What stands out, in median misfits and in largest ones.
    """

    guesses: tuple[float, ...] = (1.0, 0.75)
    rounds: int = 24
    gain: float = 0.5
    fits: float = 1e-9
    fits_again: float = 1e-7
    out: tuple[float, float] = (10.0, 0.2)


_OPTIONS = InsideOptions()


def fit_inside(
    piece: Piece,
    weights: NDArray,
    unknown: NDArray[np.int64],
    *,
    scale: float | None = None,
) -> RobustFit | None:
    """A mesh that fits all entries but those unknown and some near the boundary; None where none is found.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.
    unknown : (k,) int64
        Edges of the piece, on its boundary.
    scale : float, optional
        c, where it is known.
    """
    # What is done does not depend on the size of c then, but for rounding.
    unit = float(np.exp2(np.round(np.log2(np.median(np.abs(weights))))))
    weights, scale = weights / unit, None if scale is None else scale / unit
    for guess in _OPTIONS.guesses:
        guessed = weights.copy()
        guessed[unknown] *= guess
        try:
            start = conformal_map(piece, guessed, scale=scale, sharp=False).z
            found = _in_rounds(piece, guessed, start, unknown, scale)
        except (GeometryError, SolverError):
            continue
        if found is not None:
            aside = _still_aside(piece, weights, unknown, found)
            return RobustFit(found.z, found.scale * unit, aside)
    return None


def _in_rounds(
    piece: Piece,
    weights: NDArray,
    z: NDArray,
    unknown: NDArray[np.int64],
    scale: float | None,
) -> RobustFit | None:
    near = _near_boundary(piece)
    aside = np.zeros(len(weights), dtype=bool)
    aside[unknown] = True
    before = np.inf
    for _ in range(_OPTIONS.rounds):
        spread = np.where(aside, ASIDE, 1.0)
        found = cautious_polish(piece, weights, z, scale=scale, spread=spread, options=_SHORT)
        z, c = found.z, found.scale
        fitted = edge_weights(piece, z)
        misfit = np.abs(fitted - weights / c)
        rest = misfit[~aside]
        left = float(np.linalg.norm(rest))
        _log.debug("%d entries set aside: misfit %.1e", np.count_nonzero(aside), left)
        if (rest <= _OPTIONS.fits * np.median(np.abs(fitted))).all():
            return RobustFit(z, c, np.flatnonzero(aside))
        ended = found.converged or found.steps < _SHORT.max_steps
        if ended or left > _OPTIONS.gain * before:
            aside |= near & (
                misfit > max(_OPTIONS.out[0] * float(np.median(rest)), _OPTIONS.out[1] * float(rest.max()))
            )
        before = left
        weights = np.where(aside, c * fitted, weights)  # held where it is, and no further
    return None


def _still_aside(piece: Piece, weights: NDArray, unknown: NDArray[np.int64], found: RobustFit) -> NDArray[np.int64]:
    """Those set aside that are unknown, or do not fit in the end."""
    fitted = edge_weights(piece, found.z)
    off = np.abs(fitted - weights / found.scale) > _OPTIONS.fits_again * np.median(np.abs(fitted))
    off[unknown] = True
    aside = np.zeros(len(weights), dtype=bool)
    aside[found.aside] = True
    return np.flatnonzero(aside & off)


def _near_boundary(piece: Piece) -> NDArray[np.bool_]:
    """(e,) edges with an end on the boundary, or next to a vertex there."""
    near = np.zeros(piece.n_vertices, dtype=bool)
    near[piece.boundary] = True
    near[piece.edges[near[piece.edges].any(axis=1)]] = True
    return np.asarray(near[piece.edges].any(axis=1))
