"""Planar meshes, of linear triangles and of other elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..topology.polygons import Polygons
from .base import Recovery, none_of, occurring, with_mid_nodes

if TYPE_CHECKING:
    from ..cells import Alternative


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlanarMesh(Recovery):
    """A planar mesh of triangles: from a scalar matrix, or from directions that are not coupled.

    Attributes
    ----------
    n_holes : int
        Bounded boundary loops, over all pieces.
    polygons_offsets : (polygons + 1,) int64
    polygons_data : (polygons_offsets[-1],) int64
        Cells that the matrix leaves undivided, counter-clockwise: polygon k is
        ``polygons_data[polygons_offsets[k]:polygons_offsets[k + 1]]``.
    standard_deviations : (n, 2) float64 or None
        One standard deviation of each coordinate, on request.
    chi_square : mapping or None
        With noise, or entries that were rounded: ``statistic``, ``degrees_of_freedom``, ``p_value``, ``sigma``,
        ``largest``, ``largest_p_value``; see :func:`unassemble.certify.chi_square_verdict`.
    estimated_noise : float or None
        Standard deviation of independent errors of the entries that would leave the misfit; None where it is no noise.
    missing_term : str
        ``"mass"``, ``"coefficient"`` or ``"one sign"``, a term that the model lacks, where that explains the misfit.
    suspects : (k, 2) int64
        Entries that stand out from the misfit of their piece, at most one of each.
    areas : (m,) float64 or None
        Of a mass matrix, which tells no shape: s times the areas of the triangles; `points` are NaN.
    row_scaling : (n,) float64 or None
        The diagonal matrix S, of geometric mean 1, where the matrix is S c L S.
    alternatives : tuple of Alternative
        Cells in doubt where other meshes fit as well, and what these have instead.
    n_entries, n_fitting : int
        Entries above the diagonal; those that the mesh gives back to 1e-9 of their row's largest.
    eliminated_points : (k, 2) float64
        Vertices that the matrix has no rows for, where it determines them; see :mod:`unassemble.boundaries`.
    """

    n_holes: int
    polygons_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    polygons_data: NDArray[np.int64] = field(default_factory=none_of())
    standard_deviations: NDArray[np.float64] | None = None
    chi_square: Mapping[str, float] | None = None
    estimated_noise: float | None = None
    missing_term: str = ""
    suspects: NDArray[np.int64] = field(default_factory=none_of(2))
    areas: NDArray[np.float64] | None = None
    row_scaling: NDArray[np.float64] | None = None
    alternatives: tuple[Alternative, ...] = ()
    n_entries: int = 0
    n_fitting: int = 0
    eliminated_points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def n_polygons(self) -> int:
        """Number of cells that the matrix leaves undivided."""
        return len(self.polygons_offsets) - 1

    @property
    def largest_deviation(self) -> float | None:
        """The largest error bar of a coordinate, where there are any."""
        deviations = self.standard_deviations
        if deviations is None or not np.isfinite(deviations).any():
            return None
        return float(np.nanmax(deviations))

    def divided(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles, with the polygons in fans.

        Returns
        -------
        triangles : (m, 3) int64
        outline : (m, 3) bool
            False for sides, from each corner to the next, that are diagonals of polygons.
        """
        fans, outline = Polygons(self.polygons_offsets, self.polygons_data).fans()
        return np.concatenate([self.triangles, fans]), np.concatenate([np.ones(self.triangles.shape, bool), outline])


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ConformingMesh(PlanarMesh):
    """A planar mesh of other elements than linear triangles, or of these beside quadrilaterals.

    Attributes
    ----------
    quads : (m, 4) int64
        Quadrilaterals, counter-clockwise. Of quadratic and cubic cells, as in `triangles`, these are the corners.
    mid_nodes : (m, k) int64
        The nodes that each cell of a higher order has besides its corners, in meshio's order; else empty.
    quadrature : str
        The rule that integrated the elements, where their shape shows it.
    straight : bool
        Whether nodes other than corners lie on straight sides at equal distances.
    """

    quads: NDArray[np.int64] = field(default_factory=none_of(4))
    mid_nodes: NDArray[np.int64] = field(default_factory=none_of(0))
    quadrature: str
    straight: bool

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names."""
        return with_mid_nodes(occurring(triangle=self.triangles, quad=self.quads), self.mid_nodes)
