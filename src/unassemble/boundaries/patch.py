"""Levenberg-Marquardt where only vertices near the rim move, each with a damping of its own.

Far from each other they have nothing to do with each other, and one place that comes to no end must not hold up the
others: each vertex has a damping, and a step counts where it lowers the squares of the entries near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..topology import Piece
from .fit import Scale, System, WholeEntries, first_flips
from .shape import ShapePrior


@dataclass(frozen=True, eq=False)
class Patch:
    """The triangles with a part in entries that moving vertices change, as a piece without boundary loops."""

    piece: Piece
    vertices: NDArray[np.int64]  # (k,) of the whole piece
    edges: NDArray[np.int64]  # (e,)
    triangles: NDArray[np.int64]  # (m,)
    free: NDArray[np.bool_]  # (k,) vertices that move

    @classmethod
    def about(cls, piece: Piece, free: NDArray[np.bool_]) -> Patch:
        """About vertices (n,) bool that move."""
        touched = np.unique(piece.opposite[free[piece.triangles].any(axis=1)])
        corners = piece.facing[touched]
        chosen = np.unique(corners[corners >= 0] // 3)
        vertices, triangles = np.unique(piece.triangles[chosen], return_inverse=True)
        edges, opposite = np.unique(piece.opposite[chosen], return_inverse=True)
        number = np.full(len(piece.triangles) + 1, -1)
        number[chosen] = np.arange(len(chosen))
        triangle, corner = np.divmod(piece.facing[edges], 3)  # of -1, the last number
        facing = np.where(number[triangle] >= 0, 3 * number[triangle] + corner, -1)
        facing = np.where(facing[:, :1] < 0, facing[:, ::-1], facing)
        ends = np.searchsorted(vertices, piece.edges[edges])
        part = Piece(
            vertices, edges, ends, triangles.reshape(-1, 3), opposite.reshape(-1, 3), facing,
            np.empty((0, 2), np.int64), np.zeros(1, np.int64),
        )  # fmt: skip
        return cls(part, vertices, edges, chosen, free[vertices])


def distance(piece: Piece, vertices: NDArray[np.bool_], most: int) -> NDArray[np.int64]:
    """(n,) edges from the nearest of some vertices, (n,) bool; `most` + 1 beyond that."""
    return nearest(piece, np.where(vertices, 0, -1), most)[0]


def moved_along(
    piece: Piece, z: NDArray[np.complex128], there: NDArray[np.complex128], inside: NDArray[np.bool_]
) -> NDArray[np.complex128]:
    """(n,) the positions `there` of vertices inside, (n,) bool, and z of the others moved as the nearest of these."""
    _, label = nearest(piece, np.where(inside, np.arange(len(inside)), -1), len(inside))
    return np.where(inside, there, z + (there - z)[label])


def nearest(piece: Piece, label: NDArray[np.int64], most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n,) edges from the nearest vertex with a label, of labels (n,) from 0 and -1 elsewhere, and this label."""
    far, label = np.where(label >= 0, 0, most + 1), label.copy()
    both = np.concatenate([piece.edges, piece.edges[:, ::-1]])
    for step in range(1, most + 1):
        reached = (far[both[:, 0]] == step - 1) & (far[both[:, 1]] > step)
        if not reached.any():
            break
        here, there = both[reached].T
        far[there], label[there] = step, label[here]
    return far, label


def spread(piece: Piece, values: NDArray, most: np.ufunc, rounds: int) -> NDArray:
    """The least, or most, of values (n,) at vertices up to so many edges away."""
    for _ in range(rounds):
        here, there = values[piece.edges].T
        values = values.copy()
        most.at(values, piece.edges[:, 0], there)
        most.at(values, piece.edges[:, 1], here)
    return values


def fit_near(
    problem: WholeEntries, z: NDArray, scale: Scale, whole: NDArray[np.bool_], free: NDArray[np.bool_],
    schedule: Sequence[tuple[float, int]], rng: np.random.Generator | None = None,
) -> NDArray[np.complex128]:  # fmt: skip
    """Positions of which some, (n,) bool, are improved; the others, and c, stay.

    A schedule has weights of the prior, one after the other, and numbers of steps with each; with a generator the prior
    has random triangles.
    """
    patch = Patch.about(problem.piece, free)
    region = None if problem.region is None else problem.region[patch.triangles]
    given, guessed = problem.weights[patch.edges], problem.guessed[patch.edges]
    part = WholeEntries(patch.piece, given, guessed, scale, patch.free, region)
    moved = z.copy()
    try:
        for mu, steps in schedule:
            moved[patch.vertices] = _fitted(part, moved[patch.vertices], whole[patch.edges], mu, steps, rng)
    finally:
        part.release()
    return moved


def fit_anew(
    problem: WholeEntries, z: NDArray, scale: Scale, whole: NDArray[np.bool_], places: NDArray[np.bool_],
    rng: np.random.Generator,
) -> NDArray[np.complex128]:  # fmt: skip
    """Positions about places that do not fit, (n,) bool, from random triangles at the rim; what is no better stays.

    Few entries may have several solutions next to each other and a minimum that is none, each with triangles of its
    own: which of them a fit comes to is decided by the prior.
    """
    piece = problem.piece
    free = distance(piece, places, 3) <= 3
    with np.errstate(all="ignore"):  # random triangles may lead far away
        there = fit_near(problem, z, scale, whole, free, ((0.1, 10), (0.01, 5)), rng)
        there = fit_near(problem, there, scale, whole, free, ((1e-3, 10), (0.0, 20)))
    ends = piece.edges[free[piece.edges].all(axis=1)].T
    graph = sp.coo_array((np.ones(ends.shape[1], np.int8), ends), shape=(len(z), len(z)))
    label = np.where(free, csgraph.connected_components(graph, directed=False)[1], -1)
    touched = label[piece.stencil].max(axis=0)
    asked = whole & (touched >= 0)
    with np.errstate(all="ignore"):
        before, after = (
            np.bincount(touched[asked], problem.misfits(some, scale)[asked] ** 2, len(z)) for some in (z, there)
        )
    return np.where(free & (after < before)[label], there, z)


def _fitted(
    part: WholeEntries, z: NDArray, whole: NDArray[np.bool_], mu: float, steps: int,
    rng: np.random.Generator | None,
) -> NDArray[np.complex128]:  # fmt: skip
    piece, scale = part.piece, part.known_scale
    prior = ShapePrior.of(piece, ~whole).about(part.free)
    prior = prior if rng is None else prior.unlike(rng)
    whole = whole & part.asked
    fitted = piece.triangles[(whole[piece.opposite] | (mu > 0)).any(axis=1)]
    damping = np.full(len(z), 1e-3)
    misfit, shape = part.residuals(z, scale, whole, prior, mu)
    for _ in range(steps):
        if not (np.abs(misfit) > 1e-14).any():
            break
        system = System(part, z, scale, whole, prior, mu, misfit, shape)
        found = part.step(system, np.append(damping[part.free], 1.0)[: part.columns])
        if found is None:
            damping *= 100
            continue
        step, _ = found
        limit = np.ones(len(z))
        np.minimum.at(limit, fitted.ravel(), np.repeat(0.9 * first_flips(fitted, z, step), 3))
        step *= spread(piece, limit, np.minimum, 3)
        there = z + step
        with np.errstate(all="ignore"):
            new, new_shape = part.residuals(there, scale, whole, prior, mu)
        before, after = (_near(piece, prior, m, s) for m, s in ((misfit, shape), (new, new_shape)))
        worse = ~(after < before) & ((before > 1e-28) | ~(after < 1e-26))
        worse[fitted[first_flips(fitted, z, step) < 1]] = True
        refused = spread(piece, worse, np.maximum, 2)
        there = np.where(refused, z, there)
        if (first_flips(fitted, z, there - z) < 1).any():  # between what was taken and what was not
            refused[:] = True
        else:
            z = there
            with np.errstate(all="ignore"):
                misfit, shape = part.residuals(z, scale, whole, prior, mu)
        damping = np.where(refused, np.minimum(10 * damping, 1e6), np.maximum(damping / 10, 1e-14))
    return z


def _near(piece: Piece, prior: ShapePrior, misfit: NDArray, shape: NDArray) -> NDArray[np.float64]:
    """(n,) sums of squares of entries, and of the prior, up to two edges from each vertex."""
    n = piece.n_vertices
    total = np.zeros(n)
    for ends, squares in ((piece.stencil, misfit**2), (prior.corners, shape**2)):
        for end in ends:
            total += np.bincount(end, squares, n)
    one, other = piece.edges.T
    near: NDArray[np.float64] = total + np.bincount(one, total[other], n) + np.bincount(other, total[one], n)
    return near
