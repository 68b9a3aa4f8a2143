"""Frozen results of the room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..recovery import Evidence
from .materials.cells import Cells


@dataclass(frozen=True, eq=False)
class ElasticityRecovery:
    """Nodes and directions of a vector-valued matrix, and their positions.

    Attributes
    ----------
    points : (n, d) float64
        Row i belongs to node i; NaN where the matrix does not determine it. Axes are those of the matrix; per piece the
        centroid is the origin and the mean edge length of the graph 1. The sign (a point reflection) is free.
    node_of_row, direction_of_row : (N,) int64
        A direction of -1 is not known.
    node_status : (n,) int8
        0 determined, 1 not.
    component : (n,) int64
        Piece of each node, -1 for nodes without one.
    evidence : tuple of Evidence
        One per piece.
    poisson_ratio : float or None
        Where it is one number; plane strain in the plane.
    cells : Cells
        Elements, where they are recognised.
    backward_error : float
        Largest residual of a valid identity; or of the re-assembled matrix where `cells` hold.
    position_error : float or None
        See :class:`~unassemble.recovery.mechanical.Mechanical`.
    status : {"certified", "uncertified"}
    reason, advice : str
        Why; what to do next where they are not certified.
    numbering : str
        How the unknowns are numbered: ``"interleaved"``, ``"by component"`` or ``"pattern"``.
    warnings : tuple of str
    timings : mapping of str to float
        Seconds by stage.
    """

    points: NDArray[np.float64]
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    node_status: NDArray[np.int8]
    component: NDArray[np.int64]
    evidence: tuple[Evidence, ...]
    poisson_ratio: float | None
    cells: Cells
    backward_error: float
    position_error: float | None
    status: str
    reason: str
    numbering: str
    advice: str = ""
    warnings: tuple[str, ...] = ()
    timings: Mapping[str, float] = field(default_factory=dict)

    @property
    def certified(self) -> bool:
        """Whether the coordinates satisfy the matrix to rounding, and nothing else does."""
        return self.status == "certified"
