"""The mesh of a piece of which some entries are whole, and what of it they determine."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..planar.conformal import ConformalOptions, conformal_map, estimate_scale
from ..planar.cotangent import weight_roundings
from ..topology import Piece
from .embedding import tutte
from .fit import Fit, FitOptions, WholeEntries
from .judge import determined
from .local import fit_anew, fit_near
from .patch import distance, nearest
from .rim import Rim

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class InsideOptions:
    """Settings of the search.

    Attributes
    ----------
    fading, slowly, again : tuple of float
        Weights of the prior, one after the other: from the start, from the start once more, with fewer vertices at the
        rim.
    unknown : float
        Guess of the weight of an edge that has no guess, in units of typical ones.
    outlines : int
        Boundary loops, the longest ones, that are tried as the outer one.
    near : float
        Root mean square misfit of a first fit, in units of typical weights, next to which no other is tried: with a
        loop inside out it is far larger.
    steepest : float
        The largest guess of a weight, in units of typical ones.
    band, settling : int
        In edges, how deep the rim is that is fitted by itself in a large mesh, and steps of that.
    newton : FitOptions
        Steps of all vertices that start near: smooth displacements are stiff only in the fourth power of their length,
        so that any damping would hold them.
    held : float
        Whole entries to a vertex, at least, where the rim is taken off as a whole: three far inside, two determine.
    tries, nearly : int, float
        Fits from random triangles where misfits are large, before vertices are taken off, and up to which misfit.
    rounds, patience : int
        Fits, with fewer vertices at the rim each, and those with more of them; and how many come before the rim is
        taken off as a whole in a small mesh, which loses more of it.
    peaks : float
        Part of the largest misfit above which there are places to peel.
    growing : tuple of (float, int)
        Weights of the prior and steps for vertices at the rim, while those inside stay.
    grown, fits : float
        Distance in edges up to which vertices move again, and misfit up to which they need not, in units of rounding.
    regrown : int
        Fits of all that has grown together.
    exact : float
        Root mean square misfit of whole entries that is none, in units of typical ones.
    """

    fading: tuple[float, ...] = (0.1, 0.01, 1e-3, 0.0)
    slowly: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 0.0)
    again: tuple[float, ...] = (0.03, 1e-3, 0.0)
    unknown: float = 0.5
    outlines: int = 4
    near: float = 0.01
    steepest: float = 3.0
    band: int = 5
    settling: int = 3
    newton: FitOptions = field(
        default_factory=lambda: FitOptions(steps=1, last_steps=8, damping=1e-15, exact=1e-12, near=0.05, shortest=1.0)
    )
    held: float = 2.3
    tries: int = 6
    nearly: float = 1e-3
    rounds: int = 8
    patience: int = 3
    peaks: float = 0.25
    growing: tuple[tuple[float, int], ...] = ((1e-3, 5), (0.0, 20))
    grown: int = 3
    fits: float = 1e-7
    regrown: int = 4
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
    """

    z: NDArray[np.complex128]
    scale: float
    given: NDArray[np.bool_]
    entries: NDArray[np.bool_]
    exact: bool
    determined: NDArray[np.bool_]


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
    rim = Rim.of(piece, given)
    unit = float(np.median(np.abs(weights[rim.whole]))) if rim.whole.any() else 0.0
    if not unit:
        return None
    unit *= 1 if weights[rim.whole].sum() > 0 else -1
    weights = weights / unit
    shared = np.zeros_like(given) if shared is None else shared & ~given
    halved = np.where(shared, weights / 2, weights)
    likely = shared & (halved > 0) & (halved < options.steepest)  # others have terms of another kind
    problem = WholeEntries(piece, halved, given | likely, None if scale is None else scale / unit)
    try:
        core = _core(problem, rim, options)
        if core is None:
            return None
        exact = core[0].misfit <= options.exact
        fit, rim = _grown(problem, *core, options) if exact else core
        z, whole = fit.z, rim.whole
        known, entries = np.zeros(len(z), dtype=bool), np.zeros_like(whole)
        if exact:
            known, entries = determined(piece, z, whole, problem.analysed, known_scale=scale is not None)
    finally:
        problem.release()
    if entries.sum() <= 2 * known.sum() - (4 if scale is not None else 3):  # nothing that checks them as a whole
        known, entries = np.zeros_like(known), np.zeros_like(entries)
    return InsideMesh(z, fit.scale * unit, given, entries, exact, known)


def _guessed(problem: WholeEntries, whole: NDArray[np.bool_], options: InsideOptions) -> NDArray[np.float64]:
    """(e,) weights, guessed where they are not whole.

    Halves of weights are about those g of one triangle, and g1 g2 + g2 g3 + g3 g1 = c^2 / 4 in each. With guesses that
    are too low some map has no energy at the rim, and the conformal map a fold there: of two the larger one counts.
    """
    piece = problem.piece
    given = np.where(problem.guessed, problem.weights, options.unknown)
    c = estimate_scale(piece, given)
    triangle, place = np.divmod(piece.facing[:, 0], 3)
    one, other = (given[piece.opposite[triangle, (place + turn) % 3]] / 2 for turn in (1, 2))
    third = np.clip((c**2 / 4 - one * other) / np.maximum(one + other, 0.05), 0.0, 2.0)
    return np.where(whole | piece.inner, given, np.maximum(given, third))


def _core(problem: WholeEntries, rim: Rim, options: InsideOptions) -> tuple[Fit, Rim] | None:
    """A fit of all entries that some rim has whole, or else the last one; None where there is no drawing."""
    found, conformal = None, _conformal(problem, _guessed(problem, rim.given, options))
    for fading, start in ((options.fading, conformal), (options.slowly, None)):
        fit = _settled(problem, rim, conformal, options) if start is not None else None
        patience = 0 if fit else options.patience
        if fit is None:
            first = _start(problem, rim, fading[0], options, start)
            fit = None if first is None else problem.faded(first.z, first.scale, rim.whole, fading[1:])
        if fit is None:
            continue
        found = _shrunk(problem, rim, fit, patience, options)
        if found[0].misfit <= options.exact:
            break
    return found


def _settled(problem: WholeEntries, rim: Rim, z: NDArray, options: InsideOptions) -> Fit | None:
    """A fit from near, in a large mesh: steps of the rim by itself and of all vertices in turn."""
    band = distance(problem.piece, rim.opened, options.band) <= options.band
    if 2 * band.sum() >= len(band) or not _upright(problem.piece, z):
        return None
    fit = Fit(z, problem.best_scale(z, rim.whole), np.inf, 0.0)
    for mu in options.fading[:-1]:
        z = fit_near(problem, fit.z, fit.scale, rim.whole, band, ((mu, options.settling),))
        fit = problem.fit(z, fit.scale, rim.whole, mu, options.newton)
    return fit


def _bare(problem: WholeEntries, rim: Rim, fit: Fit, options: InsideOptions) -> tuple[Fit, Rim] | None:
    """A fit without the vertices of the rim, which entries hold well; None where few vertices are left, or it fails.

    What is wrong at the rim then bends nothing inside.
    """
    bare, found = rim.bared(), fit
    for _ in range(options.rounds):
        if bare.whole.sum() <= options.held * bare.inside.sum():
            return None
        found = problem.fit(found.z, found.scale, bare.whole, 0.0, options.newton)
        if found.misfit <= options.exact:
            break
        less = _less(problem, bare, found, options)
        if less is None:
            return None
        bare = less
    else:
        return None
    inside = bare.inside
    _, label = nearest(problem.piece, np.where(inside, np.arange(len(inside)), -1), len(inside))
    moved = np.where(inside, found.z, fit.z + (found.z - fit.z)[label])  # the rim as the nearest vertex inside
    return replace(found, z=moved), bare


def _shrunk(problem: WholeEntries, rim: Rim, fit: Fit, patience: int, options: InsideOptions) -> tuple[Fit, Rim]:
    """Fits with fewer vertices at the rim each, until one has all whole entries; after a few without the rim."""
    for turn in range(options.rounds):
        _log.debug("%d whole entries: misfit %.1e", rim.whole.sum(), fit.misfit)
        if turn < patience:
            fit = _tried(problem, rim, fit, options)
        elif fit.misfit > options.exact and (bare := _bare(problem, rim, fit, options)):
            return bare
        if fit.misfit <= options.exact:
            break
        peeled = _less(problem, rim, fit, options)
        if peeled is None or not (peeled := peeled.pruned()).whole.any():
            break
        rim, fit = peeled, problem.faded(fit.z, fit.scale, peeled.whole, options.again)
    return fit, rim


def _less(
    problem: WholeEntries, rim: Rim, fit: Fit, options: InsideOptions, keep: NDArray[np.bool_] | None = None
) -> Rim | None:
    """Without vertices of the rim next to peaks of misfit."""
    misfit = np.abs(problem.misfits(fit.z, fit.scale))
    return rim.peeled(misfit, options.peaks * float(misfit[rim.whole].max(initial=0.0)), keep)


def _tried(problem: WholeEntries, rim: Rim, fit: Fit, options: InsideOptions) -> Fit:
    """A fit, from random triangles again and again where misfits are large, if that is in a few places."""
    rng, first = np.random.default_rng(1), fit.misfit
    for turn in range(options.tries):
        places = _places(problem, rim, fit, options.peaks)
        if fit.misfit <= options.exact or fit.misfit > options.nearly or 4 * places.sum() > len(places):
            break
        if 2 * turn >= options.tries and 2 * fit.misfit > first:
            break
        z = fit_anew(problem, fit.z, fit.scale, rim.whole, places, rng)
        found = problem.fit(z, fit.scale, rim.whole, 0.0, options.newton)
        fit = found if found.misfit < fit.misfit else fit
    return fit


def _places(problem: WholeEntries, rim: Rim, fit: Fit, part: float) -> NDArray[np.bool_]:
    """(n,) vertices next to large misfits."""
    misfit = np.where(rim.whole, np.abs(problem.misfits(fit.z, fit.scale)), 0.0)
    return np.isin(np.arange(len(fit.z)), problem.piece.edges[misfit > part * misfit.max()])


def _grown(problem: WholeEntries, core: Fit, rim: Rim, options: InsideOptions) -> tuple[Fit, Rim]:
    """A core that fits, and what fits of the vertices outside of it: first by themselves, then with the core."""
    piece, z = problem.piece, core.z
    movable = ~rim.inside
    folded = np.zeros(piece.n_vertices, dtype=bool)
    folded[piece.triangles[_areas(piece, z) <= 0]] = True
    grown = Rim(piece, rim.given, rim.left | ~folded[piece.triangles].any(axis=1))
    free = movable
    for _ in range(options.rounds):
        if not free.any():
            break
        z = fit_near(problem, z, core.scale, grown.whole, free, options.growing)
        misfit = np.abs(problem.misfits(z, core.scale)) / weight_roundings(piece, z)
        bad = grown.whole & ~(misfit <= options.fits)
        _log.debug("grown to %d whole entries: %d do not fit", grown.whole.sum(), bad.sum())
        if not bad.any():
            break
        less = grown.peeled(np.where(bad, misfit, 0.0), 0.0, keep=rim.left)
        if less is None:
            return core, rim
        near = np.zeros(piece.n_vertices, dtype=bool)
        near[piece.edges[bad]] = True
        grown, free = less, movable & (distance(piece, near, options.grown) <= options.grown)
    for _ in range(options.regrown):
        fit = problem.fit(z, core.scale, grown.whole, 0.0, options.newton)
        if fit.misfit <= options.exact:
            return fit, grown
        less = _less(problem, grown, fit, options, keep=rim.left)
        if less is None:
            break
        grown = less
    return core, rim


def _start(
    problem: WholeEntries, rim: Rim, weight: float, options: InsideOptions, conformal: NDArray | None
) -> Fit | None:
    """The best first fit from drawings without crossings.

    The conformal map of guessed entries is the nearest one, if its ring is not inside out; where it turns triangles
    over, or there are several loops, drawings with one or another of them as the outline are tried.
    """
    piece, whole, best, least = problem.piece, rim.whole, None, np.inf
    drawings: Iterable[NDArray[np.complex128]] = [] if conformal is None else [conformal]
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


def _conformal(problem: WholeEntries, weights: NDArray) -> NDArray[np.complex128]:
    """The conformal map of entries that are whole or guessed, its triangles of mean area 1/2; 0 where there is none."""
    piece = problem.piece
    try:
        z = conformal_map(
            piece, weights, scale=problem.known_scale, sharp=False, options=ConformalOptions(max_factorisations=2)
        ).z
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
