"""Levenberg-Marquardt where only vertices near the rim move, each with a damping of its own.

Far from each other they have nothing to do with each other, and one place that comes to no end must not hold up the
others: each vertex has a damping, and a step counts where it lowers the squares of the entries near.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .fit import System, WholeEntries, first_flips
from .shape import ShapePrior


def _about(piece: Piece, free: NDArray[np.bool_]) -> tuple[Piece, NDArray[np.int64]]:
    """The triangles (m,) with a part in entries that moving vertices, (n,) bool, change; as a piece without loops."""
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
    ends, loops = np.searchsorted(vertices, piece.edges[edges]), (np.empty((0, 2), np.int64), np.zeros(1, np.int64))
    return Piece(vertices, edges, ends, triangles.reshape(-1, 3), opposite.reshape(-1, 3), facing, *loops), chosen


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
    problem: WholeEntries, z: NDArray, scale: NDArray, whole: NDArray[np.bool_], free: NDArray[np.bool_],
    schedule: Sequence[tuple[float, int]],
) -> NDArray[np.complex128]:  # fmt: skip
    """Positions of which some, (n,) bool, are improved; the others, and c, stay.

    A schedule has weights of the prior, one after the other, and numbers of steps with each.
    """
    piece, triangles = _about(problem.piece, free)
    here, edges = piece.vertices, piece.edge_rows
    given, guessed = problem.weights[edges], problem.guessed[edges]
    part = WholeEntries(piece, given, guessed, scale, free[here], problem.region[triangles])
    moved = z.copy()
    for mu, steps in schedule:
        moved[here] = _fitted(part, moved[here], scale, whole[edges], mu, steps)
    return moved


def _fitted(
    part: WholeEntries, z: NDArray, scale: NDArray, whole: NDArray[np.bool_], mu: float, steps: int
) -> NDArray[np.complex128]:
    piece, prior = part.piece, ShapePrior.of(part.piece, ~whole).about(part.free)
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
