"""The mesh of a piece of which some entries are whole, and what of it they determine."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..planar.cotangent import areas, weight_roundings
from ..topology import Piece
from .first import FADING, LARGE, first_fits, nearest_conformal
from .fit import EXACT, FitOptions, WholeEntries, WholeEntriesFit
from .grow import grow
from .judge import determined, unknowns
from .lengths import fit_lengths
from .patch import distance, fit_near, moved_along
from .rim import Rim

_log = logging.getLogger(__name__)


_MOST = 0.992  # of the entries, that are enough
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
    determined: NDArray[np.bool_]  # (n,) vertices, up to a similarity of all

    @property
    def factor(self) -> NDArray[np.float64]:
        """(m,) of each triangle."""
        return self.scale[self.region]


@dataclass(frozen=True, eq=False)
class PieceEntries:
    """What a matrix says of a piece."""

    piece: Piece
    weights: NDArray[np.float64]  # (e,) -A_ij, half of it where it is shared, which is a guess
    whole: NDArray[np.bool_]  # (e,) entries that are those of the piece's triangles and of no others
    shared: NDArray[np.bool_]  # (e,) those with another triangle besides, which is gone


def fit_inside(given: PieceEntries, scale: float | None = None) -> InsideMesh | None:
    """A mesh that fits whole entries, with c where it is known; None where there are too few."""
    piece, weights, whole = given.piece, given.weights, given.whole
    rim = Rim.of(piece, whole)
    unit = float(np.median(np.abs(weights[rim.whole]))) if rim.whole.any() else 0.0
    if not unit:
        return None
    unit *= 1 if weights[rim.whole].sum() > 0 else -1
    weights = weights / unit
    likely = given.shared & (weights > 0) & (weights < 3.0)  # others have terms of another kind
    problem = WholeEntries(piece, weights, whole | likely, None if scale is None else np.array([scale / unit]))
    core = _core(problem, rim)
    return None if core is None else finished(problem, *core, unit)


def finished(problem: WholeEntries, fit: WholeEntriesFit, rim: Rim, unit: float) -> InsideMesh | None:
    """A fit with what fits of the vertices taken off, and its verdict; c was in this unit. None where it is no fit."""
    if not fit.misfit <= EXACT:
        return None
    enough = _MOST * np.count_nonzero(replace(rim, left=np.ones_like(rim.left)).whole)
    before, held = 0, rim.inside
    while before < rim.whole.sum() < enough:  # from a larger core to one larger still
        if before:
            held = determined(problem, fit.z, fit.scale, rim.whole)[0]
        before = rim.whole.sum()
        fit, rim = _grown(problem, fit, rim, held)
    if rim.whole.sum() < enough:
        fit, rim = _grown_by_sets(problem, fit, rim)
    known, entries, step = determined(problem, fit.z, fit.scale, rim.whole)
    fit = problem.moved(fit, rim.whole, step)  # what is left is rounding
    if entries.sum() <= unknowns(known, 0 if problem.known_scale is not None else len(fit.scale)):
        known, entries = np.zeros_like(known), np.zeros_like(entries)  # nothing checks them as a whole
    return InsideMesh(fit.z, fit.scale * unit, problem.region, rim.given, entries, known)


def _core(problem: WholeEntries, rim: Rim) -> tuple[WholeEntriesFit, Rim] | None:
    """A fit of all entries that some rim has whole, or else the last one; None where there is no drawing."""
    found = None
    for again, fit in enumerate(first_fits(problem, rim, _NEWTON)):
        # What comes to a bad end with one part of the largest misfit for peaks often does not with another.
        found = shrunk(problem, rim, fit, 0.35 if again else 0.25)
        if found[0].misfit <= EXACT:
            return found
    flat = fit_lengths(problem, rim, nearest_conformal(problem, rim), _NEWTON)
    return flat if flat is not None and flat[0].misfit <= EXACT else found


def _bare(problem: WholeEntries, rim: Rim, fit: WholeEntriesFit, peaks: float) -> tuple[WholeEntriesFit, Rim] | None:
    """A fit without the vertices of the rim, which bend nothing then; None where few entries are left, or it fails."""
    bare: Rim | None = rim.bared()
    start = fit.z
    for _ in range(_ROUNDS):
        if bare is None or bare.whole.sum() <= 2.3 * bare.inside.sum():  # two to a vertex determine, inside are three
            break
        fit = problem.fit(fit.z, fit.scale, bare.whole, 0.0, _STEP)
        if fit.misfit <= EXACT:
            return replace(fit, z=moved_along(problem.piece, start, fit.z, bare.inside)), bare
        bare = _less(problem, bare, fit, peaks)
    return None


def shrunk(problem: WholeEntries, rim: Rim, fit: WholeEntriesFit, peaks: float) -> tuple[WholeEntriesFit, Rim]:
    """Fits with fewer vertices at the rim each, until one has all whole entries, or has them without the rim."""
    for _ in range(_ROUNDS):
        _log.debug("%d whole entries: misfit %.1e", rim.whole.sum(), fit.misfit)
        if fit.misfit <= EXACT:
            break
        if bare := _bare(problem, rim, fit, peaks):
            return bare
        less = _less(problem, rim, fit, peaks)
        if less is None or not (less := less.pruned()).whole.any():
            break
        rim, fit = less, problem.faded(fit.z, fit.scale, less.whole, FADING)
    return fit, rim


def _less(problem: WholeEntries, rim: Rim, fit: WholeEntriesFit, peaks: float) -> Rim | None:
    """Without vertices of the rim next to peaks of misfit."""
    misfit = np.abs(problem.misfits(fit.z, fit.scale))
    return rim.peeled(misfit, peaks * float(misfit[rim.whole].max(initial=0.0)))


def _grown(
    problem: WholeEntries, core: WholeEntriesFit, rim: Rim, held: NDArray[np.bool_]
) -> tuple[WholeEntriesFit, Rim]:
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


def _grown_by_sets(problem: WholeEntries, core: WholeEntriesFit, rim: Rim) -> tuple[WholeEntriesFit, Rim]:
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
