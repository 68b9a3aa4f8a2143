"""The mesh of a piece of which some entries are whole, and what of it they determine."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..planar.cotangent import weight_roundings
from ..topology import Piece
from .embedding import areas
from .first import first_fits
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
    again : tuple of float
        Weights of the prior, one after the other, with fewer vertices at the rim.
    steepest : float
        The largest guess of a weight, in units of typical ones.
    newton : FitOptions
        Steps of all vertices that start near: smooth displacements are stiff only in the fourth power of their length,
        so that any damping would hold them.
    last : FitOptions
        One step more where what is left is not rounding.
    held : float
        Whole entries to a vertex, at least, where the rim is taken off as a whole: three far inside, two determine.
    tries, nearly : int, float
        Fits from random triangles where misfits are large, before vertices are taken off, and up to which misfit.
    rounds, patience : int
        Fits, with fewer vertices at the rim each, and those with more of them; and how many come before the rim is
        taken off as a whole in a small mesh, which loses more of it.
    peaks, peaks_again : float
        Part of the largest misfit above which there are places to peel, from the first start and from the next one:
        what one comes to a bad end with the other often does not.
    growing : tuple of (float, int)
        Weights of the prior and steps for vertices at the rim, while those inside stay.
    grown, fits : float
        Distance in edges up to which vertices move again, and misfit up to which they need not, in units of rounding.
    growths, regrown : int
        Fits of what grows, with fewer vertices each, and of all together.
    exact : float
        Root mean square misfit of whole entries that is none, in units of typical ones.
    """

    again: tuple[float, ...] = (0.03, 1e-3, 0.0)
    steepest: float = 3.0
    newton: FitOptions = field(
        default_factory=lambda: FitOptions(steps=1, last_steps=8, damping=1e-15, exact=1e-12, near=0.05, shortest=1.0)
    )
    last: FitOptions = field(default_factory=lambda: FitOptions(last_steps=1, trials=1, damping=1e-15))
    held: float = 2.3
    tries: int = 6
    nearly: float = 1e-3
    rounds: int = 8
    patience: int = 3
    peaks: float = 0.25
    peaks_again: float = 0.35
    growing: tuple[tuple[float, int], ...] = ((1e-3, 5), (0.0, 20))
    grown: int = 3
    fits: float = 1e-12
    growths: int = 24
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
        fit = problem.fit(fit.z, fit.scale, rim.whole, 0.0, options.last) if exact else fit
        z, whole = fit.z, rim.whole
        known, entries = np.zeros(len(z), dtype=bool), np.zeros_like(whole)
        if exact:
            known, entries = determined(problem, z, fit.scale, whole)
    finally:
        problem.release()
    if entries.sum() <= 2 * known.sum() - (4 if scale is not None else 3):  # nothing that checks them as a whole
        known, entries = np.zeros_like(known), np.zeros_like(entries)
    return InsideMesh(z, fit.scale * unit, given, entries, exact, known)


def _core(problem: WholeEntries, rim: Rim, options: InsideOptions) -> tuple[Fit, Rim] | None:
    """A fit of all entries that some rim has whole, or else the last one; None where there is no drawing."""
    found = None
    for again, (fit, near) in enumerate(first_fits(problem, rim, options.newton)):
        less = replace(options, peaks=options.peaks_again) if again else options
        found = _shrunk(problem, rim, fit, 0 if near else options.patience, less)
        if found[0].misfit <= options.exact:
            break
    return found


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
    folded[piece.triangles[areas(piece, z) <= 0]] = True
    grown = Rim(piece, rim.given, rim.left | ~folded[piece.triangles].any(axis=1))
    free = movable
    for _ in range(options.growths):
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
