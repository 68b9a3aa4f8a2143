"""Ranks of the Jacobian and of its blocks (paper, section 3.2), by dense singular values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..equations import AngleSystem


@dataclass(frozen=True)
class Ranks:
    """Ranks at one point.

    Attributes
    ----------
    edges, linear, whole : int
        Of the rows (1)-(2), of (3)-(4), of all rows.
    deficiency : int
        Unknowns less the rank of all rows.
    least : float
        The least singular value that counts.
    """

    edges: int
    linear: int
    whole: int
    deficiency: int
    least: float


def ranks(system: AngleSystem, x: NDArray, *, threshold: float = 1e-9) -> Ranks:
    """Ranks of J(x); singular values below `threshold` times the greatest are zero."""
    matrix = system.jacobian(x).sparse().toarray()
    edges = matrix[system.row_of_edges : system.row_of_loops]
    whole, least = _rank(matrix, threshold)
    return Ranks(
        _rank(edges, threshold)[0],
        _rank(matrix[: system.row_of_edges], threshold)[0],
        whole,
        system.n_unknowns - whole,
        least,
    )


def _rank(matrix: NDArray, threshold: float) -> tuple[int, float]:
    values = np.linalg.svd(matrix, compute_uv=False)
    kept = values[values > threshold * values[0]]
    return len(kept), float(kept[-1])
