"""Equations for coordinates solved by least squares: what they leave free, and which of them are spare."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..errors import GeometryError
from ..linalg import UpperTriangle, nearly_singular
from ..nodes.shape import in_gauge, least_fields, shape
from ..recovery import Evidence
from ..tolerances import CANCELLED, LAST_DIGITS, SINGULAR, SMALL
from .equations import Equations
from .layouts import Layout
from .placed import EquationPiece

_PROBES = 3


def up_to_size(piece: EquationPiece, d: int) -> tuple[NDArray[np.float64], Evidence, NDArray[np.float64]]:
    """Points of a piece whose equations leave the size free, evidence, and residuals (m, k) of random right-hand sides.

    GeometryError if more is free than translations and size.
    """
    n, m = len(piece.nodes), len(piece.rows)
    _, residuals, fields, values, _ = least_squares(piece.operator, np.zeros(m), d)
    one = shape(fields, values, np.zeros(n, dtype=bool), m)
    links = sp.csr_array((np.ones(len(piece.edges)), piece.edges.T), shape=(n, n))
    return in_gauge(one.points, links), one.evidence, residuals[:, 1:]


def least_squares(
    operator: sp.csr_array, right: NDArray[np.float64], d: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Solve equations for n nodes with d coordinates each, and see what they leave free and which of them are spare.

    The solution (n d,) for the right-hand side, the first if there are several, without what is free; residuals (m, k)
    of all and of random ones; orthonormal fields (n, d, k), all null fields and some more, and their singular values,
    increasing; and the least of these that is none of a null field. GeometryError if far more is free than translations
    and enlargements.
    """
    random = np.random.default_rng(0).standard_normal((len(right), _PROBES))
    sides = np.column_stack([right, random])
    normal = operator.T @ operator
    stored = sp.eye_array(normal.shape[0]) * np.finfo(float).tiny  # coordinates in no equation have a diagonal too
    with nearly_singular(UpperTriangle.of(sp.csr_array(normal + stored))) as solver:
        fields, values = least_fields(operator.__matmul__, solver, operator.shape[1], d, SINGULAR)
        if values[-1] <= SINGULAR and len(values) < operator.shape[1]:
            raise GeometryError("the equations away from supports leave most of the structure free")
        free = fields[:, values <= SINGULAR]
        x = np.zeros((operator.shape[1], sides.shape[1]))
        for _ in range(REFINEMENTS):
            step = solver.solve(operator.T @ (sides - operator @ x))
            step -= free @ (free.T @ step)
            x += step
            if np.abs(step[:, 0]).max() <= LAST_DIGITS * np.abs(x[:, 0]).max():
                break
    gap = float(values[values > SINGULAR].min(initial=np.inf))
    return x[:, 0], sides - operator @ x, fields.reshape(-1, d, len(values)), values, gap


def unnoticed_in(
    given: Equations, probes: NDArray[np.float64], layout: Layout, points: NDArray[np.float64], edges: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(m,) equations of a piece that a disturbance would change without being noticed.

    A disturbance of the matrix adds some e to the right-hand side, and shows unless the coordinates can follow it:
    unless P e = 0, where P projects on what no coordinates reach. Residuals z = P g of random right-hand sides g tell,
    since z . e = g . P e vanishes for all of them only if P e does. Not every e can come about: a spring between two
    nodes that translations do not stretch pulls both alike, so that sums of forces over a whole structure say nothing.

    Disturbances are any of a single equation; springs along an axis between two coupled nodes; springs that are the
    same between all coupled nodes, or between the rotations of all nodes and the ground, as regular lattices could take
    them for a change of size. `row` counts the piece's own nodes, `probes` (m, k) are residuals of random right-hand
    sides.
    """
    blind = _small(probes)
    b, moves, turns = layout.block_size, len(layout.displacements), len(layout.turning)
    inside = np.flatnonzero(given.row >= 0)
    place = np.full((len(points), b, turns), -1)  # of rows without equation the last, which has no weight
    place[given.row[inside] // b, given.row[inside] % b, given.rotation[inside]] = inside
    weight = np.append(1 / given.size, 0.0)
    weighted = np.vstack([probes, np.zeros(probes.shape[1])]) * weight[:, None]
    step = layout.rigid_motions(points[edges[:, 0]] - points[edges[:, 1]])[:, :, moves:]
    for a in range(moves):
        _blind_to_springs(blind, place[edges, a], step[:, a], weight, weighted)
        pull = np.zeros((len(points), turns))
        np.add.at(pull, edges[:, 0], step[:, a])
        np.add.at(pull, edges[:, 1], -step[:, a])
        _blind_together(blind, place[:, a], pull, weighted)
    for k in range(len(layout.rotations)):
        _blind_together(blind, place[:, moves + k, k], np.ones(len(points)), weighted)
    return blind


def _blind_to_springs(
    blind: NDArray, place: NDArray, step: NDArray[np.float64], weight: NDArray[np.float64], weighted: NDArray
) -> None:
    """Mark equations of forces along one axis that a spring between two nodes could change unnoticed.

    The spring pulls at both nodes by what a rotation about any axis moves them against each other, `step` (e, turns).
    So it enters the equations about all axes at once, `place` (e, 2, turns), of both nodes or of that which has some.
    Coordinates that change along the line between the nodes may follow it in all of these, though in none alone.
    """
    largest = np.abs(step).max(axis=1, initial=0.0)[:, None]
    step = np.where(np.abs(step) > CANCELLED * largest, step, 0.0)
    pull = np.where(place >= 0, np.stack([step, -step], axis=1), 0.0)
    size = np.sqrt(((pull * weight[place]) ** 2).sum(axis=(1, 2)))
    seen = np.einsum("est,estp->ep", pull, weighted[place])
    hidden = (size > 0) & _small(seen / np.where(size > 0, size, 1.0)[:, None])
    blind[place[(pull != 0) & hidden[:, None, None]]] = True


def _small(seen: NDArray) -> NDArray[np.bool_]:
    """Whether next to nothing of a disturbance is left in the residuals."""
    return np.asarray(np.abs(seen).max(axis=-1, initial=0) < SMALL)


def _blind_together(blind: NDArray, place: NDArray, forces: NDArray, weighted: NDArray) -> None:
    """Mark equations as unnoticed, if one disturbance of them all is."""
    there = (place >= 0) & (np.abs(forces) > CANCELLED * np.abs(forces).max(initial=0.0))
    pull = weighted[place[there]] * forces[there][:, None]
    if _small(pull.sum(axis=0) / (np.linalg.norm(pull) or 1.0)):
        blind[place[there]] = True
