"""Meshes whose coefficient is constant on regions, from entries to result."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from ..boundaries import recover_partial
from ..boundaries.first import conformal, guessed, tutte, upright
from ..boundaries.fit import EXACT, FitOptions, WholeEntries, WholeEntriesFit
from ..boundaries.inside import InsideMesh, PieceEntries, finished, fit_inside, shrunk
from ..boundaries.partial import distinct
from ..boundaries.rim import Rim
from ..budget import SAMPLE, Budget
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.piece import left_by_map
from ..recovery import PlanarMesh
from ..scalar.placement import Placement
from .exchange import exchanges
from .guess import guessed_regions

_log = logging.getLogger(__name__)


_FIRST = FitOptions(last_steps=40, damping=1e-3)  # of the fit from a start
_NEXT = FitOptions(last_steps=15, damping=1e-6)  # and of those after exchanges


def exchange_budget(n: int) -> Budget:
    """For trials of exchanges in all pieces of a matrix of n rows, in vertices that are fitted."""
    return Budget(13.0 * max(n, 1000))


def recover_regions(
    matrix: OperatorMatrix, whole: NDArray[np.bool_] | None, placement: Placement, clock: Clock, options: ScalarOptions,
    budget: Budget,
) -> PlanarMesh | None:  # fmt: skip
    """The mesh of the 3-cycles of a matrix, with a factor for each region, as far as a budget of exchanges goes.

    As :func:`..boundaries.recover_partial`; None where entries show one region only, too.
    """
    if options.scale is not None:
        return None
    with np.errstate(all="ignore"):  # flat triangles, which no fit takes
        return recover_partial(matrix, whole, placement, clock, options, partial(_with_regions, budget))


def _with_regions(budget: Budget, given: Sequence[PieceEntries], _: float | None) -> list[InsideMesh | None]:
    """Meshes of pieces, of which some have regions; else none."""
    guesses = [guessed_regions(own.piece, own.weights, own.whole | own.shared) for own in given]
    if all(len(scale) == 1 or _uniform(own) for own, (_, scale) in zip(given, guesses, strict=True)):
        return [None] * len(given)
    whole = all(own.whole.all() for own in given)  # then nothing explains why pieces should have no mesh
    found: list[InsideMesh | None] = []
    for own, (region, scale) in zip(given, guesses, strict=True):
        found.append(fit_inside(own) if len(scale) == 1 else _fitted(own, region, scale, budget))
        if whole and found[-1] is None:
            return [None] * len(given)
    return found


def _uniform(given: PieceEntries) -> bool:
    """Whether all entries are whole, and one factor comes near them, at the conformal map."""
    found = left_by_map(given.piece, given.weights) if given.whole.all() else None
    return found is not None and bool(np.sqrt(np.mean(found[1] ** 2)) < 1e-3)  # entries may have errors


def _fitted(given: PieceEntries, region: NDArray[np.int64], scale: NDArray, budget: Budget) -> InsideMesh | None:
    """Whole entries of a piece fitted from regions (m,) and their factors (k,); None where that comes to no end.

    What rims do not fit where no exchange is left is taken off.
    """
    unit = float(np.median(scale))
    weights = given.weights / unit
    likely = given.shared & (weights > 0)
    problem = WholeEntries(given.piece, weights, given.whole | likely, region=region)
    rim, scale = Rim.of(given.piece, given.whole), scale / unit
    if not rim.whole.any():
        return None
    fit = _exchanged(problem, rim, scale, budget)
    if fit.misfit > EXACT:
        fit, rim = shrunk(problem, rim, fit, 0.25)
    used, place = np.unique(problem.region, return_inverse=True)
    scale, same = distinct(fit.scale[used])
    problem.region = same[place.ravel()]
    return finished(problem, replace(fit, scale=scale), rim, unit)


def _exchanged(problem: WholeEntries, rim: Rim, scale: NDArray, budget: Budget) -> WholeEntriesFit:
    """A fit of the entries that a rim has whole, triangles exchanged where they do not fit; the problem has its region.

    With several triangles wrong, one that is put right may well leave more of a misfit than before: the least misfit of
    all so far is where exchanges go on from, until it has none left, and in small pieces the next one after it.
    """
    piece, weights, whole = problem.piece, problem.weights, rim.whole

    def anew(region: NDArray, scale: NDArray) -> WholeEntriesFit:
        problem.region = region
        z = conformal(piece, guessed(piece, weights / problem.unit(scale), rim.given, 1.0), None)
        if not upright(piece, z):
            z = tutte(piece, int(np.argmax(np.diff(piece.loop_offsets))))
        if not whole.all():
            first = problem.fit(z, scale, whole, 0.1, FitOptions(steps=40, damping=1e-2))
            first = problem.faded(first.z, first.scale, whole, (0.01, 1e-3))
            z, scale = first.z, first.scale
        return problem.fit(z, scale, whole, 0.0, _FIRST)

    region = problem.region
    best = anew(region, scale)
    seen, failed, last = {region.tobytes()}, 0, best.misfit
    reached: list[tuple[float, int, NDArray[np.int64], WholeEntriesFit, Iterator[NDArray[np.int64]]]] = [
        (best.misfit, 0, region, best, exchanges(problem, best.z, best.scale, whole))
    ]
    while best.misfit > EXACT and reached and failed < 24:
        _, _, problem.region, here, others = reached[0]
        other = next(others, None)
        if other is None:
            if piece.n_vertices > SAMPLE:
                break
            heappop(reached)
        elif other.tobytes() not in seen:
            if not budget.take(piece.n_vertices + 50):
                break
            problem.region = other
            found = problem.fit(here.z, here.scale, whole, 0.0, _NEXT)
            if found.misfit > EXACT:  # from where wrong regions have bent the mesh, or from a start of its own
                again = anew(other, here.scale)
                found = again if again.misfit < found.misfit else found
            failed, last = (0, found.misfit) if found.misfit < 0.7 * last else (failed + 1, last)
            if found.misfit < best.misfit:
                best, region = found, other
                _log.debug("%d exchanges: misfit %.1e", len(seen), best.misfit)
            heappush(reached, (found.misfit, len(seen), other, found, exchanges(problem, found.z, found.scale, whole)))
            seen.add(other.tobytes())
    problem.region = region
    return best
