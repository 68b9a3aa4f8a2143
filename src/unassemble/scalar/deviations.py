"""Error bars of all points, pieces that hold each other taken together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..planar.deviations import coordinate_covariances, factor_deviations
from ..planar.piece import PieceMesh
from ..topology import Topology
from .evidence import pooled_noise
from .factors import hinged
from .solving import Solved, Task


def coordinate_deviations(solved: Solved, task: Task, placed: list[NDArray]) -> NDArray:
    """(n, 2) standard deviations in the final frame.

    Parameters
    ----------
    solved : Solved
    task : Task
    placed : list of (k,) complex128
        Positions of each piece in that frame.
    """
    topology, meshes, factors, tensor = solved.topology, solved.meshes, solved.factors, task.placement.tensor
    free = task.scale is None
    sigma = solved.noise.sigma if solved.noise else pooled_noise(solved, solved.freedom(free_scale=free))
    stretch = tensor.root if tensor else None
    drawn = [tensor.to_laplacian(z) if tensor else z for z in placed]
    result = np.full((topology.n_vertices, 2), np.nan)
    alone = np.ones(len(meshes), dtype=bool)
    for label in np.unique(factors.fitted[factors.together]) if factors.closings.any() else ():
        inside = np.flatnonzero(factors.fitted == label)
        joined = hinged(topology, inside, [drawn[p] for p in inside])
        if joined is not None:
            alone[inside] = False
            z = np.empty(joined.piece.n_vertices, dtype=np.complex128)
            for p, own in zip(inside, joined.local, strict=True):
                z[own] = drawn[p]
            spreads = [spread for p in inside if (spread := meshes[p].spread) is not None]
            covariance = coordinate_covariances(
                joined.piece,
                z,
                beside=0.0 if free else None,
                stretch=stretch,
                spread=np.concatenate(spreads) if spreads else None,
                pins=joined.pins,
            )
            own = sigma / abs(meshes[inside[0]].scale)
            result[joined.piece.vertices] = own * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    beside = _beside(topology, meshes, factors.fitted) if free and alone.any() else np.zeros(len(meshes))
    for p in np.flatnonzero(alone)[::-1].tolist():
        covariance = coordinate_covariances(
            topology.pieces[p],
            drawn[p],
            beside=beside[p] if free else None,
            stretch=stretch,
            spread=meshes[p].spread,
        )
        own = sigma / abs(meshes[p].scale)
        result[topology.pieces[p].vertices] = own * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result


def _beside(topology: Topology, meshes: list[PieceMesh], fitted: NDArray[np.int64]) -> NDArray[np.float64]:
    """(pieces,) what the others with the same label say of c, for noise 1 in the weights."""
    told = np.zeros(len(meshes))
    several = np.flatnonzero(np.bincount(fitted)[fitted] > 1)
    if len(several):
        pieces, some = [topology.pieces[p] for p in several], [meshes[p] for p in several]
        told[several] = factor_deviations(pieces, [m.z for m in some], [m.spread for m in some]) ** -2
    return np.asarray(np.bincount(fitted, told)[fitted] - told)
