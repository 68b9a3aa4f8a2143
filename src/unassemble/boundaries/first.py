"""First fits of a mesh to its whole entries: from conformal maps of guesses, or from drawings without crossings."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import chain

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import GeometryError, SolverError
from ..linalg import UpperTriangle, factorisation
from ..planar.conformal import conformal_map, estimate_scale
from ..planar.cotangent import areas
from ..topology import Piece
from .fit import Fit, FitOptions, WholeEntries
from .patch import distance, fit_near
from .rim import Rim

# Weights of the prior, one after the other, and once more.
_FADING = (0.1, 0.01, 1e-3, 0.0)
LARGE = 20_000  # vertices: from there on a step of all of them costs more than what it brings to the first of these
SLOWLY: Sequence[float] = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 0.0)


def first_fits(problem: WholeEntries, rim: Rim, newton: FitOptions) -> Iterator[tuple[Fit, bool]]:
    """Fits, one after the other, each with whether it started so near that the rim alone needed more than one step.

    Steps `newton` are those of all vertices of a large mesh.
    """
    conformal = nearest_conformal(problem, rim)
    fit = _settled(problem, rim, conformal, newton)
    if fit is not None:
        yield fit, True
    for fading, start in ((_FADING, conformal), (SLOWLY, None))[fit is not None :]:
        first = _start(problem, rim, fading[0], start)
        if first is not None:
            yield problem.faded(first.z, first.scale, rim.whole, fading[1:]), False


def nearest_conformal(problem: WholeEntries, rim: Rim) -> NDArray[np.complex128]:
    """(n,) the conformal map of entries that are whole or guessed; 0 where there is none."""
    given = np.where(problem.guessed, problem.weights, 0.5)
    c = estimate_scale(problem.piece, given)
    return _conformal(problem, guessed(problem.piece, given, rim.given, c))


def guessed(piece: Piece, given: NDArray[np.float64], whole: NDArray[np.bool_], c: float) -> NDArray[np.float64]:
    """(e,) weights, guessed where they are not whole, from what is given there, and c.

    Halves of weights are about those g of one triangle, and g1 g2 + g2 g3 + g3 g1 = c^2 / 4 in each. With guesses that
    are too low some map has no energy at the rim, and the conformal map a fold there: of two the larger one counts.
    """
    triangle, place = np.divmod(piece.facing[:, 0], 3)
    one, other = (given[piece.opposite[triangle, (place + turn) % 3]] / 2 for turn in (1, 2))
    third = np.clip((c**2 / 4 - one * other) / np.maximum(one + other, 0.05), 0.0, 2.0)
    return np.where(whole | piece.inner, given, np.maximum(given, third))


def _settled(problem: WholeEntries, rim: Rim, z: NDArray, newton: FitOptions) -> Fit | None:
    """A fit from near, in a large mesh: steps of the rim by itself and of all vertices in turn."""
    band = distance(problem.piece, rim.opened, 5) <= 5
    if 2 * band.sum() >= len(band) or not _upright(problem.piece, z):
        return None
    fit = Fit(z, problem.best_scale(z, rim.whole), np.inf, 0.0)
    first, second, third = ((mu, 3) for mu in _FADING[:-1])
    large = problem.piece.n_vertices >= LARGE
    for turn in ([first, second], [third]) if large else ([first], [second], [third]):
        z = fit_near(problem, fit.z, fit.scale, rim.whole, band, turn)
        fit = problem.fit(z, fit.scale, rim.whole, turn[-1][0], newton)
    return fit


def _start(problem: WholeEntries, rim: Rim, weight: float, conformal: NDArray | None) -> Fit | None:
    """The best first fit from drawings without crossings.

    The conformal map of guessed entries is the nearest one, if its ring is not inside out; where it turns triangles
    over, or there are several loops, drawings with one or another of them as the outline are tried.
    """
    piece, whole, best, least = problem.piece, rim.whole, None, np.inf
    drawings: Iterable[NDArray[np.complex128]] = [] if conformal is None else [conformal]
    if piece.n_loops > 1 or not any(map(partial(_upright, piece), drawings)):
        loops = np.argsort(-np.diff(piece.loop_offsets), kind="stable")[:4]
        drawings = chain(drawings, (tutte(piece, loop) for loop in loops.tolist()))
    for z in drawings:
        if best is not None and best.misfit <= 0.01:
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
        z = conformal_map(piece, weights, scale=problem.known_scale, sharp=False, most=2).z
    except (GeometryError, SolverError):
        return np.zeros(piece.n_vertices, dtype=np.complex128)
    area = float(areas(piece, z).mean())
    return np.asarray((z if area > 0 else np.conj(z)) / np.sqrt(abs(area)))


def _upright(piece: Piece, z: NDArray) -> bool:
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
    z = relaxed(np.concatenate(ends), z, free)[:n]
    area = areas(piece, z)
    return np.asarray((z if area.sum() > 0 else np.conj(z)) / np.sqrt(np.abs(area).mean()))


def relaxed(edges: NDArray, z: NDArray[np.complex128], free: NDArray[np.bool_]) -> NDArray[np.complex128]:
    """The same positions (n,), those that are `free`, (n,) bool, at the means of their neighbours.

    `edges` (e, 2) may repeat one, as a loop does that comes to a vertex twice. Raises SolverError.
    """
    graph = sp.coo_array((np.ones(len(edges)), edges.T), shape=(len(z), len(z))).tocsr()
    laplacian = sp.csr_array(csgraph.laplacian(graph + graph.T))[free]
    if free.any():
        matrix = UpperTriangle.of(sp.csr_array(laplacian[:, free]))
        solver = factorisation(matrix, definite=True)
        solver.factorise(matrix)
        pull = -(laplacian[:, ~free] @ z[~free])
        z = z.copy()
        z[free] = np.ascontiguousarray(solver.solve(np.column_stack([pull.real, pull.imag]))) @ np.array([1, 1j])
        solver.release()
    return z
