"""The mesh of a piece of which some entries are whole, and what of it they determine."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..planar.conformal import conformal_map
from ..topology import Piece
from .embedding import tutte
from .fit import Fit, FitOptions, WholeEntries
from .judge import determined
from .rim import Rim

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class InsideOptions:
    """Settings of the search.

    Attributes
    ----------
    fading, slowly, again, regrowing : tuple of float
        Weights of the prior, one after the other: from the start, from the start once more, with fewer vertices at the
        rim, with more of them.
    unknown : float
        Guess of the weight of an edge that has no guess, in units of typical ones.
    outlines : int
        Boundary loops, the longest ones, that are tried as the outer one.
    near : float
        Root mean square misfit of a first fit, in units of typical weights, next to which no other is tried: with a
        loop inside out it is far larger.
    steepest : float
        The largest guess of a weight, in units of typical ones.
    rounds : int
        Fits, with fewer vertices at the rim each.
    grown, quick : int
        Fits with vertices at the rim that were taken off before, and their steps: all else fits already, so that they
        take few or lead nowhere.
    exact : float
        Root mean square misfit of whole entries that is none, in units of typical ones.
    """

    fading: tuple[float, ...] = (0.1, 0.01, 1e-3, 0.0)
    slowly: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 0.0)
    again: tuple[float, ...] = (0.03, 1e-3, 0.0)
    regrowing: tuple[float, ...] = (1e-3, 0.0)
    unknown: float = 0.5
    outlines: int = 4
    near: float = 0.01
    steepest: float = 3.0
    rounds: int = 15
    grown: int = 4
    quick: int = 10
    exact: float = 1e-12


@dataclass(frozen=True, eq=False)
class InsideMesh:
    """Positions, and how much they are worth.

    Attributes
    ----------
    z : (n,) complex128
    scale : float
    given : (e,) bool
        Entries that were said to be whole.
    entries : (e,) bool
        Those that determine and check vertices.
    exact : bool
        Whether all that were fitted fit.
    determined : (n,) bool
        These vertices, up to a similarity of all of them; none where entries do not fit.
    factorisations : int
    """

    z: NDArray[np.complex128]
    scale: float
    given: NDArray[np.bool_]
    entries: NDArray[np.bool_]
    exact: bool
    determined: NDArray[np.bool_]
    factorisations: int


def fit_inside(
    piece: Piece,
    weights: NDArray,
    given: NDArray[np.bool_],
    *,
    shared: NDArray[np.bool_] | None = None,
    scale: float | None = None,
    options: InsideOptions | None = None,
) -> InsideMesh | None:
    """A mesh that fits whole entries; None where there are too few.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.
    given : (e,) bool
        Entries that are those of the piece's triangles, and of no others.
    shared : (e,) bool, optional
        Entries that have another triangle besides, which is gone. Half of them is a guess.
    scale : float, optional
        c, where it is known.
    options : InsideOptions, optional
    """
    options = options or InsideOptions()
    start = rim = Rim.of(piece, given)
    if not rim.whole.any():
        return None
    core, work = None, 0
    unit = float(np.median(np.abs(weights[rim.whole]))) * (1 if weights[rim.whole].sum() > 0 else -1)
    shared = np.zeros_like(given) if shared is None else shared & ~given
    halved = np.where(shared, weights / 2, weights) / unit
    likely = (halved > 0) & (halved < options.steepest)  # others have terms of another kind
    problem = WholeEntries(piece, halved, given | (shared & likely), None if scale is None else scale / unit)
    try:
        for fading, conformal in ((options.fading, True), (options.slowly, False)):
            first = _start(problem, start, fading[0], options, conformal=conformal)
            if first is None:
                continue
            core, rim, done = _shrunk(problem, start, first, fading[1:], options)
            work += done
            if core.misfit <= options.exact:
                break
        if core is None:
            return None
        whole = rim.whole
        exact = core.misfit <= options.exact
        fit = core
        if exact:
            grown = Rim(piece, given, np.ones(len(piece.triangles), dtype=bool))
            for _ in range(options.grown):
                quick = FitOptions(last_steps=options.quick)
                tried = problem.faded(core.z, core.scale, grown.whole, options.regrowing, quick)
                work += tried.factorisations
                _log.debug("grown to %d whole entries: misfit %.1e", grown.whole.sum(), tried.misfit)
                if tried.misfit <= options.exact:
                    fit, whole = tried, grown.whole
                    break
                less = grown.peeled(np.abs(problem.misfits(tried.z, tried.scale)), keep=rim.left)
                if less is None:
                    break
                grown = less
    finally:
        problem.release()
    known, entries = np.zeros(len(fit.z), dtype=bool), np.zeros_like(whole)
    if exact:
        known, entries = determined(piece, fit.z, whole, known_scale=scale is not None)
        if entries.sum() <= 2 * known.sum() - (4 if scale is not None else 3):  # nothing that checks them as a whole
            known, entries = np.zeros_like(known), np.zeros_like(entries)
    return InsideMesh(fit.z, fit.scale * unit, given, entries, exact, known, work)


def _shrunk(
    problem: WholeEntries, rim: Rim, fit: Fit, fading: Sequence[float], options: InsideOptions
) -> tuple[Fit, Rim, int]:
    """Fits with fewer vertices at the rim each, until one has all whole entries."""
    work = fit.factorisations
    for turn in range(options.rounds):
        fit = problem.faded(fit.z, fit.scale, rim.whole, options.again if turn else fading)
        work += fit.factorisations
        _log.debug("%d whole entries: misfit %.1e after %d factorisations", rim.whole.sum(), fit.misfit, work)
        peeled = None if fit.misfit <= options.exact else rim.peeled(np.abs(problem.misfits(fit.z, fit.scale)))
        peeled = None if peeled is None else peeled.pruned()
        if peeled is None or not peeled.whole.any():
            break
        rim = peeled
    return fit, rim, work


def _start(problem: WholeEntries, rim: Rim, weight: float, options: InsideOptions, *, conformal: bool) -> Fit | None:
    """The best first fit from drawings without crossings.

    The conformal map of guessed entries is the nearest one, if its ring is not inside out; where it turns triangles
    over, or there are several loops, drawings with one or another of them as the outline are tried.
    """
    piece, whole, best, least = problem.piece, rim.whole, None, np.inf
    drawings: Iterable[NDArray[np.complex128]] = [_conformal(problem)] if conformal else []
    if piece.n_loops > 1 or not any(map(partial(_upright, piece), drawings)):
        loops = np.argsort(-np.diff(piece.loop_offsets), kind="stable")[: options.outlines]
        drawings = chain(drawings, (tutte(piece, loop) for loop in loops.tolist()))
    for z in drawings:
        if best is not None and best.misfit <= options.near:
            break
        if not _upright(piece, z):
            continue
        c = problem.best_scale(z, whole)
        fit = problem.fit(z, c if c > 0 else 1.0, whole, weight, FitOptions(steps=40, damping=1e-2))
        cost = whole.sum() * fit.misfit**2 + (weight * fit.prior) ** 2
        if cost < least:
            best, least = fit, cost
    return best


def _conformal(problem: WholeEntries) -> NDArray[np.complex128]:
    """The conformal map of entries that are whole or guessed, its triangles of mean area 1/2; 0 where there is none."""
    piece = problem.piece
    weights = np.where(problem.guessed, problem.weights, InsideOptions.unknown)
    try:
        z = conformal_map(piece, weights, scale=problem.known_scale, sharp=False).z
    except (GeometryError, SolverError):
        return np.zeros(piece.n_vertices, dtype=np.complex128)
    area = float(_areas(piece, z).mean())
    return np.asarray((z if area > 0 else np.conj(z)) / np.sqrt(abs(area)))


def _areas(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """(m,) twice the areas of triangles."""
    a, b, c = z[piece.triangles].T
    return np.asarray((np.conj(b - a) * (c - a)).imag)


def _upright(piece: Piece, z: NDArray) -> bool:
    return bool((_areas(piece, z) > 0).all())
