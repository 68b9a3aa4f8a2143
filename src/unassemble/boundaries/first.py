"""First fits of a mesh to its whole entries: from conformal maps of guesses, or from drawings without crossings."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import chain

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import GeometryError, SolverError
from ..linalg import solved
from ..planar.conformal import conformal_map, estimate_scale
from ..planar.cotangent import areas
from ..topology import Piece
from .fit import FitOptions, WholeEntries, WholeEntriesFit
from .patch import distance, fit_near
from .rim import Rim

LARGE = 20_000  # vertices: from there on a step of all of them costs more than what it brings to the first of these
SLOWLY: Sequence[float] = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 0.0)  # weights of the prior, one after the other
FADING: Sequence[float] = (0.1, 0.01, 1e-3, 0.0)


def first_fits(problem: WholeEntries, rim: Rim, newton: FitOptions) -> Iterator[WholeEntriesFit]:
    """Fits, one after the other, steps `newton` being those of all vertices of a large mesh.

    Few entries at the rim may have several solutions, and which of them a fit comes to is decided by what is guessed
    there: the last start has it at random.
    """
    near = nearest_conformal(problem, rim)
    fit = _settled(problem, rim, near, newton)
    if fit is not None:
        yield fit
    anew = nearest_conformal(problem, rim, np.random.default_rng(1))
    for fading, start in ((FADING, near), (SLOWLY, None), (FADING, anew))[fit is not None :]:
        first = _start(problem, rim, fading[0], start)
        if first is not None:
            yield problem.faded(first.z, first.scale, rim.whole, fading[1:])


def nearest_conformal(
    problem: WholeEntries, rim: Rim, rng: np.random.Generator | None = None
) -> NDArray[np.complex128]:
    """(n,) the conformal map of entries that are whole or guessed, at random if so; 0 where there is none."""
    given = np.where(problem.guessed, problem.weights, 0.5)
    weights = guessed(problem.piece, given, rim.given, estimate_scale(problem.piece, given))
    if rng is not None:
        weights = np.where(rim.given, weights, weights * rng.lognormal(sigma=0.6, size=len(weights)))
    return conformal(problem.piece, weights, None if problem.known_scale is None else float(problem.known_scale[0]))


def conformal(piece: Piece, weights: NDArray, scale: float | None) -> NDArray[np.complex128]:
    """(n,) the conformal map of weights (e,), its triangles of mean area 1/2; 0 where there is none."""
    try:
        z = conformal_map(piece, weights, scale=scale, sharp=False, most=2).z
    except (GeometryError, SolverError):
        return np.zeros(piece.n_vertices, dtype=np.complex128)
    area = float(areas(piece, z).mean())
    return np.asarray((z if area > 0 else np.conj(z)) / np.sqrt(abs(area)))


def guessed(piece: Piece, given: NDArray[np.float64], whole: NDArray[np.bool_], c: float) -> NDArray[np.float64]:
    """(e,) weights, guessed where they are not whole, from what is given there, and c.

    Halves of weights are about those g of one triangle, and g1 g2 + g2 g3 + g3 g1 = c^2 / 4 in each. With guesses that
    are too low some map has no energy at the rim, and the conformal map a fold there: of two the larger one counts.
    """
    triangle, place = np.divmod(piece.facing[:, 0], 3)
    one, other = (given[piece.opposite[triangle, (place + turn) % 3]] / 2 for turn in (1, 2))
    third = np.clip((c**2 / 4 - one * other) / np.maximum(one + other, 0.05), 0.0, 2.0)
    return np.where(whole | piece.inner, given, np.maximum(given, third))


def _settled(problem: WholeEntries, rim: Rim, z: NDArray, newton: FitOptions) -> WholeEntriesFit | None:
    """A fit from near, in a large mesh: steps of the rim by itself and of all vertices in turn."""
    band = distance(problem.piece, rim.opened, 5) <= 5
    if 2 * band.sum() >= len(band) or not upright(problem.piece, z):
        return None
    fit = WholeEntriesFit(z, problem.best_scale(z, rim.whole), np.inf, 0.0)
    first, second, third = ((mu, 3) for mu in FADING[:-1])
    large = problem.piece.n_vertices >= LARGE
    for turn in ([first, second], [third]) if large else ([first], [second], [third]):
        z = fit_near(problem, fit.z, fit.scale, rim.whole, band, turn)
        fit = problem.fit(z, fit.scale, rim.whole, turn[-1][0], newton)
    return fit


def _start(problem: WholeEntries, rim: Rim, weight: float, near: NDArray | None) -> WholeEntriesFit | None:
    """The best first fit from drawings without crossings.

    The conformal map of guessed entries is the nearest one, if its ring is not inside out; where it turns triangles
    over, or there are several loops, drawings with one or another of them as the outline are tried.
    """
    piece, whole, best, least = problem.piece, rim.whole, None, np.inf
    drawings: Iterable[NDArray[np.complex128]] = [] if near is None else [near]
    if piece.n_loops > 1 or not any(map(partial(upright, piece), drawings)):
        loops = np.argsort(-np.diff(piece.loop_offsets), kind="stable")[:4]
        drawings = chain(drawings, (tutte(piece, loop) for loop in loops.tolist()))
    for z in drawings:
        if best is not None and best.misfit <= 0.01:
            break
        if not upright(piece, z):
            continue
        c = problem.best_scale(z, whole)
        fit = problem.fit(z, np.where(c > 0, c, 1.0), whole, weight, FitOptions(steps=40, damping=1e-2))
        cost = whole.sum() * fit.misfit**2 + (weight * fit.prior) ** 2
        if cost < least:
            best, least = fit, cost
    return best


def upright(piece: Piece, z: NDArray) -> bool:
    """Whether no triangle is turned over."""
    return bool((areas(piece, z) > 0).all())


def tutte(piece: Piece, outline: int) -> NDArray[np.complex128]:
    """Positions (n,) in which no triangle is turned over, of mean area 1/2; a vertex closes each loop but the outline.

    That loop is on the unit circle (Tutte, "How to draw a graph", Proc. London Math. Soc. 13, 1963). A ring has two
    such drawings, and which of them is nearer to the mesh depends on where it is. Triangles are flat where the graph is
    not 3-connected.
    """
    n = piece.n_vertices
    ends, number = [piece.edges], n
    for k in range(piece.n_loops):
        loop = piece.boundary[piece.loop_offsets[k] : piece.loop_offsets[k + 1], 0]
        if k == outline:
            circle = loop
        else:
            ends.append(np.column_stack([loop, np.full(len(loop), number)]))
            number += 1
    z = np.zeros(number, dtype=np.complex128)
    z[circle] = np.exp(2j * np.pi * np.arange(len(circle)) / len(circle))
    free = np.ones(number, dtype=bool)
    free[circle] = False
    both = np.concatenate(ends)  # may repeat one, as a loop does that comes to a vertex twice
    graph = sp.coo_array((np.ones(len(both)), both.T), shape=(number, number)).tocsr()
    laplacian = sp.csr_array(csgraph.laplacian(graph + graph.T))[free]
    if free.any():
        pull = -(laplacian[:, ~free] @ z[~free])
        z[free] = solved(sp.csr_array(laplacian[:, free]), np.column_stack([pull.real, pull.imag])) @ [1, 1j]
    z = z[:n]
    area = areas(piece, z)
    return np.asarray((z if area.sum() > 0 else np.conj(z)) / np.sqrt(np.abs(area).mean()))
