"""Curved surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import Recovery


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Surface(Recovery):
    """A triangulated surface, known by its edge lengths.

    `points` are NaN unless coordinates in space were asked for; `node_status` says for which vertices the entries tell
    lengths. Triangles of a piece run the same way round where it is orientable. `boundary` holds the edges with one
    triangle, loop by loop, in no order and direction.

    Attributes
    ----------
    edges : (e, 2) int64
        Sides of the triangles, rows i < j.
    edge_lengths : (e,) float64
        Mean 1 in each piece.
    curvature : (n,) float64
        What the angles about a vertex lack: of 2 pi, or of pi on the boundary; added up where several sheets touch in a
        vertex, NaN where there is none. Over a piece it adds up to 2 pi times the Euler characteristic.
    euler : (number of pieces,) int64
        Euler characteristic of each piece; sheets that only touch in a vertex count as apart there.
    orientable : (number of pieces,) bool
    loops : (number of pieces,) int64
        Boundary loops of each piece.
    realisation : mapping or None
        Of coordinates in space: ``misfit``, the root mean square difference of edge lengths relative to their mean,
        ``largest``, the largest such difference, and ``misfits``, those of all starts.
    chi_square : mapping or None
        With noise: the test that rows sum to zero, as in :class:`PlanarMesh`.
    length_deviations : (e,) float64 or None
        With noise, on request: one standard deviation of each edge length.
    """

    edges: NDArray[np.int64]
    edge_lengths: NDArray[np.float64]
    curvature: NDArray[np.float64]
    euler: NDArray[np.int64]
    orientable: NDArray[np.bool_]
    loops: NDArray[np.int64]
    realisation: Mapping[str, Any] | None = None
    chi_square: Mapping[str, float] | None = None
    length_deviations: NDArray[np.float64] | None = None

    @property
    def flat(self) -> bool:
        """Whether the angles about every vertex inside add up to a full turn, up to rounding."""
        inside = np.isfinite(self.curvature)
        inside[self.boundary] = False
        return bool(np.abs(self.curvature[inside]).max(initial=0.0) < 1e-8)

    @property
    def fits_no_plane(self) -> bool:
        """Whether a piece is closed, one-sided or has a handle, so that no mesh in the plane has these triangles."""
        return bool(((self.loops == 0) | ~self.orientable | (self.genus > 0)).any())

    @property
    def genus(self) -> NDArray[np.int64]:
        """(number of pieces,) handles, or cross-caps of pieces that are not orientable."""
        total = 2 - self.loops - self.euler
        return np.asarray(np.where(self.orientable, total // 2, total))
