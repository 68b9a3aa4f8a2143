"""How far two embeddings are apart, after the best similarity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def aligned(z: NDArray, target: NDArray) -> NDArray[np.complex128]:
    """z (n,) moved by the similarity that brings it nearest to the target, without reflection."""
    a, b = z - z.mean(), target - target.mean()
    return target.mean() + a * (np.vdot(a, b) / np.vdot(a, a))


def distance(z: NDArray, target: NDArray) -> float:
    """Largest distance between corresponding points after alignment, relative to the target's diameter.

    The mirror image counts as the same mesh.
    """
    span = abs(complex(np.ptp(target.real), np.ptp(target.imag)))
    candidates = (np.abs(aligned(y, target) - target).max() for y in (z, z.conj()))
    return float(min(candidates) / span)
