"""Whether pieces that share vertices have one factor c: each by itself, small ones fit nearly anything."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc, ndtr

from ..cells.agreement import SAME_SCALE, SCALE_ERROR
from ..certify import CONFIDENCE
from ..errors import SolverError
from ..planar.deviations import factor_deviation
from ..planar.hinges import groups
from ..planar.piece import EXACT, PieceMesh
from ..topology import Topology

_CHANCE = 1e-6  # that factors which agree to within their errors do so by coincidence


def discord(
    topology: Topology, meshes: Sequence[PieceMesh], backward_error: float, noise: float | None = None
) -> str | None:
    """What is wrong where pieces share vertices but not c, errors of the entries being allowed for.

    Parameters
    ----------
    topology : Topology
    meshes : sequence of PieceMesh
    backward_error : float
        Of the entries.
    noise : float, optional
        Standard deviation of their errors.
    """
    if not len(topology.hinges):
        return None
    scale = np.array([mesh.scale for mesh in meshes])
    _, one, group = np.unique(groups(topology), return_index=True, return_inverse=True)
    first = one[group]
    difference = np.abs(scale / scale[first] - 1)
    worst = int(difference.argmax())
    # With noise its size tells how far factors may differ: a misfit of a hundred thousandth would excuse anything.
    if difference[worst] <= max(SAME_SCALE, 0.0 if noise else SCALE_ERROR * backward_error):
        return None
    a, b = int(first[worst]), worst
    differ = (
        f"the matrix is given back to {backward_error:.1e}, but by pieces with different factors c that "
        f"share vertices: {scale[a]:.6g} in piece {a}, of row {topology.pieces[a].vertices.min()}, and "
        f"{scale[b]:.6g} in piece {b}, of row {topology.pieces[b].vertices.min()}"
    )
    if (scale * scale[first] < 0).any():
        return differ
    ratio = np.log(scale / scale[first])
    deviation = _deviations(topology, meshes)  # for noise 1
    several = np.bincount(group)[group] > 1
    misfit = (ratio - _mean(ratio, deviation, group))[several] / deviation[several]
    freedom = len(misfit) - len(np.unique(group[several]))
    if noise is None:
        sigma = float(np.sqrt(misfit @ misfit / freedom))
        return f"{differ}; noise of standard deviation {sigma:.2g} in the entries would make them differ as much"
    misfit /= noise
    largest = 2 * len(misfit) * float(ndtr(-np.abs(misfit).max()))
    if min(float(gammaincc(freedom / 2, misfit @ misfit / 2)), largest) < CONFIDENCE:
        return f"{differ}, more than noise of standard deviation {noise:.3g} explains"
    # The first piece of each group tells c, and every other one confirms it to within its error.
    others = several & (np.arange(len(scale)) != first)
    unproved = others & _to_be_confirmed(topology, group)
    if unproved.any() and np.log(np.minimum(noise * deviation[others], 1.0)).sum() > np.log(_CHANCE):
        return f"{differ}, as much as noise of standard deviation {noise:.3g} explains, but too few for a certificate"
    return None


def _to_be_confirmed(topology: Topology, group: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(pieces,) those that may be something else, as far as the entries of each by itself go.

    A piece with entries to spare tells c. One that hangs by a single vertex on pieces of which one does so can only be
    read in itself, and no other way if nothing has vanished and no triangle may be a hole.
    """
    rows = np.zeros(len(topology.edges), dtype=bool)
    rows[topology.vanished] = True
    spare = np.array([piece.redundancy > 0 for piece in topology.pieces])
    loose = np.array(
        [
            rows[piece.edge_rows].any()
            or bool(piece.enclosed.any())
            or np.count_nonzero(topology.multiplicity[piece.vertices] > 1) > 1
            for piece in topology.pieces
        ]
    )
    told = np.bincount(group, spare) > 0
    return np.asarray(~told[group] | (loose & ~spare))


def _mean(values: NDArray, deviation: NDArray, group: NDArray[np.int64]) -> NDArray[np.float64]:
    """(k,) mean of each group, with weights 1 / deviation^2."""
    weight = deviation**-2
    return np.asarray((np.bincount(group, weight * values) / np.bincount(group, weight))[group])


def _deviations(topology: Topology, meshes: Sequence[PieceMesh]) -> NDArray[np.float64]:
    """(pieces,) standard deviations of log c for noise 1 in the entries; those that have vanished are exact."""
    vanished = np.zeros(len(topology.edges), dtype=bool)
    vanished[topology.vanished] = True
    found = []
    for piece, mesh in zip(topology.pieces, meshes, strict=True):
        try:
            deviation = factor_deviation(piece, mesh.z, np.where(vanished[piece.edge_rows], EXACT, 1.0))
        except SolverError:
            deviation = np.inf
        found.append(min(deviation / abs(mesh.scale), 1e100))
    return np.array(found)
