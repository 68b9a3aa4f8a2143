"""Error bars of all points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..planar.deviations import coordinate_covariances
from .evidence import pooled_noise
from .solving import Solved, Task


def coordinate_deviations(solved: Solved, task: Task, placed: list[NDArray]) -> NDArray:
    """(n, 2) standard deviations in the final frame.

    `placed` list of (k,): positions of each piece in that frame.
    """
    pieces, meshes, tensor = solved.topology.pieces, solved.meshes, task.placement.tensor
    free = task.scale is None
    sigma = solved.noise.sigma if solved.noise else pooled_noise(solved, solved.freedom(free_scale=free))
    result = np.full((solved.topology.n_vertices, 2), np.nan)
    for p in range(len(pieces))[::-1]:  # the first piece at a hinge comes last
        covariance = coordinate_covariances(
            pieces[p],
            tensor.to_laplacian(placed[p]) if tensor else placed[p],
            free_scale=free,
            stretch=tensor.root if tensor else None,
            spread=meshes[p].spread,
        )
        own = sigma / abs(meshes[p].scale)
        result[pieces[p].vertices] = own * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result
