"""Which equations of a structure others contradict, whatever disturbs them.

A disturbance of the matrix adds some e to the right-hand side, and shows unless the coordinates can follow it: unless
P e = 0, where P projects on what no coordinates reach. Residuals z = P g of random right-hand sides g tell, since
z . e = g . P e vanishes for all of them only if P e does.

Not every e can come about. A spring between two nodes that translations do not stretch pulls both alike, so that sums
of forces over a whole structure say nothing: its forces are disturbed in pairs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .equations import Equations
from .layouts import Layout

NOTICED = 1e-4  # how much of a disturbance has to be left in the residuals


def unnoticed(
    given: Equations,
    probes: NDArray[np.float64],
    layout: Layout,
    points: NDArray[np.float64],
    edges: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Equations that a disturbance would change without being noticed.

    Disturbances are any of a single equation; springs between two coupled nodes; springs that are the same between
    all coupled nodes, or between the rotations of all nodes and the ground, as regular lattices could take them for a
    change of size.

    Parameters
    ----------
    given : Equations
        Of a piece; `row` counts its own nodes.
    probes : (m, k) float64
        Residuals of random right-hand sides.
    layout : Layout
    points : (n, dim) float64
    edges : (e, 2) int64
        Coupled nodes.

    Returns
    -------
    (m,) bool
    """
    blind = _small(probes)
    b, moves, turns = layout.block_size, len(layout.displacements), len(layout.rotations)
    single = np.flatnonzero(given.row >= 0)
    place = np.full((len(points), b, turns), -1)
    place[given.row[single] // b, given.row[single] % b, given.rotation[single]] = single
    weighted = np.vstack(
        [probes / given.size[:, None], np.zeros(probes.shape[1])]
    )  # the last for rows without equation
    weight = np.append(1 / given.size, 0.0)
    step = layout.rigid_motions(points[edges[:, 0]] - points[edges[:, 1]])[:, :, moves:]
    for a in range(moves):
        one, other = place[edges[:, 0], a], place[edges[:, 1], a]  # (e, turns)
        scale = np.hypot(weight[one], weight[other])
        pull = weighted[one] - weighted[other]
        lone = _small(pull / np.where(scale > 0, scale, 1)[..., None]) & (one >= 0) & (other >= 0)
        blind[one[lone]] = blind[other[lone]] = True
        forces = np.zeros((len(points), turns))
        for end, sign in ((0, 1), (1, -1)):
            np.add.at(forces, edges[:, end], sign * step[:, a])
        _blind_together(blind, place[:, a], forces, weighted)
    for k in range(turns) if (given.row % b >= moves)[single].any() else ():
        _blind_together(blind, place[:, moves + k, [k]], np.ones((len(points), 1)), weighted)
    return blind


def _small(seen: NDArray) -> NDArray[np.bool_]:
    return np.asarray(np.abs(seen).max(axis=-1, initial=0) < NOTICED)


def _blind_together(blind: NDArray, place: NDArray, forces: NDArray, weighted: NDArray) -> None:
    """Mark equations as unnoticed, if one disturbance of them all is."""
    there = (place >= 0) & (np.abs(forces) > 1e-9 * np.abs(forces).max(initial=0.0))
    which, force = place[there], forces[there]
    if not len(which):
        return
    pull = weighted[which] * force[:, None]
    if _small(pull.sum(axis=0) / np.linalg.norm(pull)):
        blind[which] = True
