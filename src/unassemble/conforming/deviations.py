"""Error bars of all nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..planar.deviations import covariances
from ..planar.normal import distant_pair
from ..scalar.solving import Task
from .fit import Fitted


def deviations_of(n: int, fits: Sequence[Fitted], placed: Sequence[NDArray], task: Task) -> NDArray[np.float64]:
    """(n, 2) standard deviations in the final frame, NaN for rows of no cell.

    `placed` sequence of (k,): nodes of each part in that frame.
    """
    result = np.full((n, 2), np.nan)
    tensor = task.placement.tensor
    for fit, z in list(zip(fits, placed, strict=True))[::-1]:
        z = np.asarray(tensor.to_laplacian(z)) if tensor else z
        a, b, c = z[fit.part.piece.triangles].T
        mirrored = (np.conj(b - a) * (c - a)).imag.sum() < 0
        z = np.conj(z) if mirrored else z
        parameters = z[: fit.entries.n]
        stretch = (tensor.root if tensor else np.eye(2)) @ np.diag([1, -1 if mirrored else 1])
        sigma = float(np.sqrt(np.mean(fit.spread**2)))
        if task.noise is None:
            sigma *= float(np.linalg.norm(fit.misfit / fit.spread)) / np.sqrt(max(fit.freedom, 1))
        spread = fit.spread / np.sqrt(np.mean(fit.spread**2))
        covariance = covariances(
            fit.entries.jacobian(parameters, spread),
            fit.entries.weights(parameters) / spread,
            z,
            distant_pair(parameters),
            free_scale=task.scale is None,
            stretch=stretch,
            nodes=fit.entries.nodes,
        )
        result[fit.part.piece.vertices] = sigma / abs(fit.scale) * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result
