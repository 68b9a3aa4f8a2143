"""The mesh of a piece of which some entries are whole, and what of it they determine."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..planar.cotangent import areas, weight_roundings
from ..topology import Piece
from .first import LARGE, first_fits, nearest_conformal
from .fit import EXACT, Fit, FitOptions, WholeEntries
from .grow import grow
from .judge import determined, unknowns
from .lengths import fit_lengths
from .patch import distance, fit_anew, fit_near, moved_along
from .rim import Rim

_log = logging.getLogger(__name__)


_MOST = 0.99  # of the entries, that are enough
_ROUNDS = 8  # fits with fewer vertices at the rim each

# Steps of all vertices that start near: smooth displacements are stiff only in the fourth power of their length, so
# that any damping would hold them.
_NEWTON = FitOptions(steps=1, last_steps=8, damping=1e-15, exact=EXACT, near=0.1, shortest=1.0)
_STEP = replace(_NEWTON, last_steps=1)  # where a step costs more than what holds others up and is taken off after it


@dataclass(frozen=True, eq=False)
class InsideMesh:
    """Positions, and how much they are worth."""

    z: NDArray[np.complex128]
    scale: NDArray[np.float64]  # (k,) factors of regions, or the only one
    region: NDArray[np.int64]  # (m,)
    given: NDArray[np.bool_]  # (e,) entries that were said to be whole
    entries: NDArray[np.bool_]  # (e,) those that determine and check vertices
    exact: bool  # whether all that were fitted fit
    determined: NDArray[np.bool_]  # (n,) vertices, up to a similarity of all; none where entries do not fit

    @property
    def factor(self) -> NDArray[np.float64]:
        """(m,) of each triangle."""
        return self.scale[self.region]


@dataclass(frozen=True, eq=False)
class PieceEntries:
    """What a matrix says of a piece."""

    piece: Piece
    weights: NDArray[np.float64]  # (e,) -A_ij
    whole: NDArray[np.bool_]  # (e,) entries that are those of the piece's triangles and of no others
    shared: NDArray[np.bool_]  # (e,) those with another triangle besides, which is gone

    @property
    def halved(self) -> NDArray[np.float64]:
        """(e,) weights, of which half is a guess where they are shared."""
        return np.where(self.shared, self.weights / 2, self.weights)


def fit_inside(given: PieceEntries, scale: float | None = None) -> InsideMesh | None:
    """A mesh that fits whole entries, with c where it is known; None where there are too few."""
    piece, weights, whole = given.piece, given.weights, given.whole
    rim = Rim.of(piece, whole)
    unit = float(np.median(np.abs(weights[rim.whole]))) if rim.whole.any() else 0.0
    if not unit:
        return None
    unit *= 1 if weights[rim.whole].sum() > 0 else -1
    halved = given.halved / unit
    likely = given.shared & (halved > 0) & (halved < 3.0)  # others have terms of another kind
    problem = WholeEntries(piece, halved, whole | likely, None if scale is None else scale / unit)
    try:
        core = _core(problem, rim)
        if core is None:
            return None
        return finished(problem, *core, unit)
    finally:
        problem.release()


def finished(problem: WholeEntries, fit: Fit, rim: Rim, unit: float) -> InsideMesh:
    """A fit with what fits of the vertices taken off, and its verdict; c was in this unit."""
    exact = fit.misfit <= EXACT
    if exact:
        enough = _MOST * np.count_nonzero(replace(rim, left=np.ones_like(rim.left)).whole)
        before, held = 0, rim.inside
        while before < rim.whole.sum() < enough:  # from a larger core to one larger still
            if before:
                held = determined(problem, fit.z, fit.scale, rim.whole)[0]
            before = rim.whole.sum()
            fit, rim = _grown(problem, fit, rim, held)
        if rim.whole.sum() < enough:
            fit, rim = _grown_by_sets(problem, fit, rim)
    known, entries = np.zeros(len(fit.z), dtype=bool), np.zeros_like(rim.whole)
    if exact:
        known, entries, step = determined(problem, fit.z, fit.scale, rim.whole)
        fit = problem.moved(fit, rim.whole, step)  # what is left is rounding
    scale, region = np.atleast_1d(fit.scale) * unit, problem.region
    region = np.zeros(len(problem.piece.triangles), np.int64) if region is None else region
    if entries.sum() <= unknowns(known, 0 if problem.known_scale is not None else len(scale)):
        known, entries = np.zeros_like(known), np.zeros_like(entries)  # nothing checks them as a whole
    return InsideMesh(fit.z, scale, region, rim.given, entries, exact, known)


def _core(problem: WholeEntries, rim: Rim) -> tuple[Fit, Rim] | None:
    """A fit of all entries that some rim has whole, or else the last one; None where there is no drawing."""
    found = None
    for again, (fit, near) in enumerate(first_fits(problem, rim, _NEWTON)):
        # What comes to a bad end with one part of the largest misfit for peaks often does not with another. A small
        # mesh loses more of its rim where that is taken off as a whole, and is peeled a few times before.
        found = shrunk(problem, rim, fit, 0 if near else 3, 0.35 if again else 0.25)
        if found[0].misfit <= EXACT:
            return found
    flat = fit_lengths(problem, rim, nearest_conformal(problem, rim), _NEWTON)
    return flat if flat is not None and flat[0].misfit <= EXACT else found


def _bare(problem: WholeEntries, rim: Rim, fit: Fit, peaks: float, newton: FitOptions) -> tuple[Fit, Rim] | None:
    """A fit without the vertices of the rim, which bend nothing then; None where few entries are left, or it fails."""
    bare, found = rim.bared(), fit
    for _ in range(_ROUNDS):
        if bare.whole.sum() <= 2.3 * bare.inside.sum():  # two to a vertex determine, far inside there are three
            return None
        found = problem.fit(found.z, found.scale, bare.whole, 0.0, newton)
        if found.misfit <= EXACT:
            break
        less = _less(problem, bare, found, peaks)
        if less is None:
            return None
        bare = less
    else:
        return None
    return replace(found, z=moved_along(problem.piece, fit.z, found.z, bare.inside)), bare


def shrunk(problem: WholeEntries, rim: Rim, fit: Fit, patience: int, peaks: float) -> tuple[Fit, Rim]:
    """Fits with fewer vertices at the rim each, until one has all whole entries; after a few without the rim."""
    for turn in range(_ROUNDS):
        _log.debug("%d whole entries: misfit %.1e", rim.whole.sum(), fit.misfit)
        if turn < patience:
            fit = _tried(problem, rim, fit, peaks)
        elif fit.misfit > EXACT and (bare := _bare(problem, rim, fit, peaks, _NEWTON if patience else _STEP)):
            return bare
        if fit.misfit <= EXACT:
            break
        less = _less(problem, rim, fit, peaks)
        if less is None or not (less := less.pruned()).whole.any():
            break
        rim, fit = less, problem.faded(fit.z, fit.scale, less.whole, (0.03, 1e-3, 0.0))
    return fit, rim


def _less(problem: WholeEntries, rim: Rim, fit: Fit, peaks: float) -> Rim | None:
    """Without vertices of the rim next to peaks of misfit."""
    misfit = np.abs(problem.misfits(fit.z, fit.scale))
    return rim.peeled(misfit, peaks * float(misfit[rim.whole].max(initial=0.0)))


def _tried(problem: WholeEntries, rim: Rim, fit: Fit, peaks: float) -> Fit:
    """A fit, from random triangles again and again where misfits are large, if that is in a few places."""
    rng, first, tries = np.random.default_rng(1), fit.misfit, 6
    for turn in range(tries):
        misfit = np.where(rim.whole, np.abs(problem.misfits(fit.z, fit.scale)), 0.0)
        places = np.isin(np.arange(len(fit.z)), problem.piece.edges[misfit > peaks * misfit.max()])
        if fit.misfit <= EXACT or fit.misfit > 1e-3 or 4 * places.sum() > len(places):
            break
        if 2 * turn >= tries and 2 * fit.misfit > first:
            break
        z = fit_anew(problem, fit.z, fit.scale, rim.whole, places, rng)
        found = problem.fit(z, fit.scale, rim.whole, 0.0, _NEWTON)
        fit = found if found.misfit < fit.misfit else fit
    return fit


def _grown(problem: WholeEntries, core: Fit, rim: Rim, held: NDArray[np.bool_]) -> tuple[Fit, Rim]:
    """A core that fits, and what fits of the other vertices: by themselves first, then with those that are held.

    Best held, (n,) bool, are those that the core determines: what fits elsewhere in it is one of many.
    """
    piece, z, movable = problem.piece, core.z, ~held
    keep = np.logical_not(movable[piece.triangles].any(axis=1))
    folded = np.zeros(piece.n_vertices, dtype=bool)
    folded[piece.triangles[areas(piece, z) <= 0]] = True
    grown = Rim(piece, rim.given, keep | ~folded[piece.triangles].any(axis=1))
    free = movable
    for _ in range(24):
        if free.any():
            z = fit_near(problem, z, core.scale, grown.whole, free, ((1e-5, 5), (0.0, 20)))
        misfit = np.abs(problem.misfits(z, core.scale))
        relative = misfit / weight_roundings(piece, z)
        bad = grown.whole & ~(relative <= 1e-12)
        _log.debug("grown to %d whole entries: %d do not fit", grown.whole.sum(), bad.sum())
        if not bad.any():
            return replace(core, z=z), grown
        less = grown.peeled(np.where(bad, relative, 0.0), 0.0, keep=keep)
        if less is None or not less.whole.any():
            return core, rim
        near = np.zeros(piece.n_vertices, dtype=bool)
        near[piece.edges[bad]] = True
        grown, free = less, movable & (distance(piece, near, 3) <= 3)
        if piece.n_vertices < LARGE and misfit[grown.whole].max() < 1e-3:  # these come to the end that patches do not
            fit = problem.fit(z, core.scale, grown.whole, 0.0, _NEWTON)
            if fit.misfit <= EXACT:
                return fit, grown
    fit = problem.fit(z, core.scale, grown.whole, 0.0, _NEWTON)
    return (fit, grown) if fit.misfit <= EXACT else (core, rim)


def _grown_by_sets(problem: WholeEntries, core: Fit, rim: Rim) -> tuple[Fit, Rim]:
    """What grows by small sets from vertices that a core determines, and fits as a whole; else the core."""
    piece, held = problem.piece, determined(problem, core.z, core.scale, rim.whole)[0]
    every = replace(rim, left=np.ones_like(rim.left))
    z, known = grow(problem, core.z, core.scale, every.whole, held)
    if known.sum() == held.sum():
        return core, rim
    grown = replace(rim, left=np.asarray(known[piece.triangles].all(axis=1)))
    several = FitOptions(last_steps=3, trials=1, damping=1e-15, exact=0.0)  # what was near by itself is not in all
    fit = problem.fit(z, core.scale, grown.whole, 0.0, several)
    return (fit, grown) if fit.misfit <= EXACT else (core, rim)
