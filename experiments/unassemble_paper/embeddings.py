"""Figures 9 to 12: the paper's embeddings from angles of few digits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unassemble.paper.alignment import aligned, distance
from unassemble.paper.bfs import bfs_embedding
from unassemble.paper.layout import least_squares_layout
from unassemble.paper.smoothing import coordinate_smoothing
from unassemble.paper.validity import inverted

from .cases import Case, Run

# The residuals at which the iteration is stopped. The paper gives 1e-4 for the rocket and an angle error of
# O(1e-2) for the grid, which the iteration has there.
RESIDUALS = {"rocket": 1e-4, "square": 0.1}


@dataclass(frozen=True, eq=False)
class Embedded:
    """One embedding, moved onto the true mesh.

    Attributes
    ----------
    method : str
    z : (n,) complex128
    error : float
        Largest distance from the true mesh, relative to its diameter.
    turned : int
        Triangles turned over: 0 for a planar embedding.
    """

    method: str
    z: NDArray[np.complex128]
    error: float
    turned: int


def rough_angles(case: Case) -> Run:
    """The BiCG-Newton iteration, stopped early."""
    return case.run("1.1^-i", tolerance=RESIDUALS[case.name])


def embeddings(case: Case, angles: NDArray) -> dict[str, Embedded]:
    """BFS, Modified BFS, that with Coordinate-Smoothing, and the least-squares layout."""
    averaged = bfs_embedding(case.piece, angles, averaging=True)
    found = {
        "BFS-Embedding": bfs_embedding(case.piece, angles),
        "Modified BFS-Embedding": averaged,
        "Modified BFS, Coordinate-Smoothing": coordinate_smoothing(case.piece, angles, averaged),
        "least-squares layout": least_squares_layout(case.piece, angles),
    }
    return {
        name: Embedded(name, aligned(z, case.truth), distance(z, case.truth), inverted(z, case.piece.triangles))
        for name, z in found.items()
    }
