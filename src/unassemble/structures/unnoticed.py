"""Equations that a disturbance of the matrix would change without being noticed."""

import numpy as np
from numpy.typing import NDArray

from ..tolerances import CANCELLED, SMALL
from .equations import Equations
from .layouts import Layout


def unnoticed_in(
    given: Equations, probes: NDArray[np.float64], layout: Layout, points: NDArray[np.float64], edges: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(m,) equations of a piece that a disturbance would change without being noticed.

    A disturbance of the matrix adds some e to the right-hand side, and shows unless the coordinates can follow it:
    unless P e = 0, where P projects on what no coordinates reach. Residuals z = P g of random right-hand sides g tell,
    since z . e = g . P e vanishes for all of them only if P e does. Not every e can come about: a spring between two
    nodes that translations do not stretch pulls both alike, so that sums of forces over a whole structure say nothing.

    Disturbances are any of a single equation; springs between two coupled nodes; springs that are the same between
    all coupled nodes, or between the rotations of all nodes and the ground, as regular lattices could take them for a
    change of size. `row` counts the piece's own nodes, `probes` (m, k) are residuals of random right-hand sides.
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
        one, other = place[edges[:, 0], a], place[edges[:, 1], a]  # (e, turns)
        both = (one >= 0) & (other >= 0)
        scale = np.where(both, np.hypot(weight[one], weight[other]), 1)[..., None]
        lone = _small((weighted[one] - weighted[other]) / scale) & both
        blind[one[lone]] = blind[other[lone]] = True
        pull = np.zeros((len(points), turns))
        np.add.at(pull, edges[:, 0], step[:, a])
        np.add.at(pull, edges[:, 1], -step[:, a])
        _blind_together(blind, place[:, a], pull, weighted)
    for k in range(len(layout.rotations)):
        _blind_together(blind, place[:, moves + k, k], np.ones(len(points)), weighted)
    return blind


def _small(seen: NDArray) -> NDArray[np.bool_]:
    """Whether next to nothing of a disturbance is left in the residuals."""
    return np.asarray(np.abs(seen).max(axis=-1, initial=0) < SMALL)


def _blind_together(blind: NDArray, place: NDArray, forces: NDArray, weighted: NDArray) -> None:
    """Mark equations as unnoticed, if one disturbance of them all is."""
    there = (place >= 0) & (np.abs(forces) > CANCELLED * np.abs(forces).max(initial=0.0))
    pull = weighted[place[there]] * forces[there][:, None]
    if _small(pull.sum(axis=0) / (np.linalg.norm(pull) or 1.0)):
        blind[place[there]] = True
