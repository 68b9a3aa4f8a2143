"""Planar meshes and surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..tolerances import PLACED, SUSPICIOUS
from ..topology.polygons import Polygons
from ..words import kind_text
from .base import SHOWN, Look, Recovery, none_of, occurring, with_mid_nodes

if TYPE_CHECKING:
    from ..cells import Alternative


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlanarMesh(Recovery):
    """A planar mesh of triangles: from a scalar matrix, or from directions that are not coupled."""

    look: ClassVar[Look] = Look(outlined=True)

    n_holes: int  #: Bounded boundary loops, over all pieces.
    polygons_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))  #: (polygons + 1,)
    #: (polygons_offsets[-1],) cells that the matrix leaves undivided, counter-clockwise, where polygon k is
    #: ``polygons_data[polygons_offsets[k]:polygons_offsets[k + 1]]``.
    polygons_data: NDArray[np.int64] = field(default_factory=none_of())
    #: (n, 2) one standard deviation of each coordinate, on request.
    standard_deviations: NDArray[np.float64] | None = None
    #: With noise, or entries that were rounded, ``statistic``, ``degrees_of_freedom``, ``p_value``, ``sigma``,
    #: ``largest``, ``largest_p_value``; see :func:`unassemble.certificate.chi_square_verdict`.
    chi_square: Mapping[str, float] | None = None
    #: Standard deviation of independent errors of the entries that would leave the misfit; None where it is no noise.
    estimated_noise: float | None = None
    #: ``"mass"``, ``"coefficient"`` or ``"one sign"``, a term that the model lacks, where that explains the misfit.
    missing_term: str = ""
    #: (m,) of a mass matrix, which tells no shape, s times the areas of the triangles; `points` are NaN.
    areas: NDArray[np.float64] | None = None
    #: (n,) the diagonal matrix S, of geometric mean 1, where the matrix is S c L S.
    row_scaling: NDArray[np.float64] | None = None
    #: Cells in doubt where other meshes fit as well, and what these have instead.
    alternatives: tuple[Alternative, ...] = ()
    #: (k, 2) vertices that the matrix has no rows for, where it determines them; see :mod:`unassemble.boundaries`.
    eliminated_points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    #: (m,) of each cell, where coefficients are constant on regions; `scale` has one factor for each region then.
    region: NDArray[np.int64] | None = None

    @property
    def n_polygons(self) -> int:
        """Number of cells that the matrix leaves undivided."""
        return len(self.polygons_offsets) - 1

    @property
    def cells_to_assemble(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind as elements have them: polygons are divided, in any way."""
        return {"triangle": self.divided()[0]}

    @property
    def rules(self) -> dict[str, str]:
        """The quadrature that integrates each kind of `cells_to_assemble`."""
        return {"triangle": "degree 1"}

    @property
    def largest_deviation(self) -> float | None:
        """The largest error bar of a coordinate, where there are any."""
        deviations = self.standard_deviations
        if deviations is None or not np.isfinite(deviations).any():
            return None
        return float(np.nanmax(deviations))

    @property
    def shapeless(self) -> str:
        """That areas alone are known, where that is so."""
        return "" if self.areas is None else "a mass matrix tells areas only"

    def facts(self) -> list[tuple[str, str]]:
        """Holes, factors, terms and error bars."""
        rows = [("holes", f"{self.n_holes:,}")]
        if self.region is not None:
            rows.append(("regions", f"{len(self.scale):,}, each with a factor of its own"))
        rows.append(("scale c", self.scale_text()))
        if self.reaction:
            rows.append(("reaction s", f"{self.reaction:.10g}"))
        if self.estimated_noise is not None and self.backward_error > SUSPICIOUS:
            much = f"the misfit is that of a standard deviation of {self.estimated_noise:.1e} (absolute)"
            rows.append(("noise", much))
        if self.largest_deviation is not None:
            rows.append(("std deviation", f"at most {self.largest_deviation:.1e} in a coordinate (absolute)"))
        return rows

    def entries_of_report(self) -> dict[str, Any]:
        """Tests of the misfit, error bars, what stands out, and other meshes."""
        return {
            "chi_square": self.chi_square,
            "estimated_noise": self.estimated_noise,
            "n_entries": self.n_entries,
            "n_fitting": self.n_fitting,
            "largest_standard_deviation": self.largest_deviation,
            "suspects": [{"row": i, "column": j} for i, j in self.suspects],
            "alternatives": [asdict(other) for other in self.alternatives],
        }

    def point_data(self) -> dict[str, NDArray]:
        """One standard deviation of each coordinate."""
        if self.standard_deviations is None:
            return {}
        columns = zip("xyz", self.standard_deviations.T, strict=False)
        return {f"standard_deviation_{name}": np.ascontiguousarray(column) for name, column in columns}

    def polygons_by_size(self) -> list[NDArray[np.int64]]:
        """Cells that the matrix leaves undivided, (m, k) for each number k of vertices that occurs."""
        start, size = self.polygons_offsets[:-1], np.diff(self.polygons_offsets)
        return [self.polygons_data[start[size == k, None] + np.arange(k)] for k in np.unique(size)]

    def scale_at_points(self) -> NDArray[np.float64] | None:
        """(n,) the factor of the piece of each point; None where each cell has that of its region."""
        return super().scale_at_points() if self.region is None else None

    def divided(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles (m, 3), with the polygons in fans, and which of their sides, (m, 3), are no diagonals of these."""
        fans, _, outline = Polygons(self.polygons_offsets, self.polygons_data).fans()
        return np.concatenate([self.triangles, fans]), np.concatenate([np.ones(self.triangles.shape, bool), outline])

    def triangulated(self) -> PlanarMesh:
        """The same with polygons in fans of triangles."""
        none = Polygons.none()
        whole = self.divided()[0]
        return replace(self, triangles=whole, polygons_offsets=none.offsets, polygons_data=none.vertices)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ConformingMesh(PlanarMesh):
    """A planar mesh of other elements than linear triangles, or of these beside quadrilaterals."""

    look: ClassVar[Look] = Look()

    #: (m, 4) quadrilaterals, counter-clockwise. Of quadratic and cubic cells, as in `triangles`, these are the corners.
    quads: NDArray[np.int64] = field(default_factory=none_of(4))
    #: (m, k) the nodes that each cell of a higher order has besides its corners, in meshio's order; else empty.
    mid_nodes: NDArray[np.int64] = field(default_factory=none_of(0))
    quadrature: str  #: The rule that integrated the elements, where their shape shows it.
    straight: bool  #: Whether nodes other than corners lie on straight sides at equal distances.

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names."""
        return with_mid_nodes(occurring(triangle=self.triangles, quad=self.quads), self.mid_nodes)

    @property
    def cells_to_assemble(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind, which are elements as they are."""
        return self.cells

    def facts(self) -> list[tuple[str, str]]:
        """The element and its quadrature besides."""
        curved = "" if self.straight else ", with curved sides"
        return [("element", f"{self.element}{curved}"), ("quadrature", self.quadrature), *super().facts()]

    def entries_of_report(self) -> dict[str, Any]:
        """The quadrature besides."""
        return super().entries_of_report() | {"quadrature": self.quadrature}

    @property
    def rules(self) -> dict[str, str]:
        """The quadrature that integrates each kind, as far as `quadrature` tells."""
        names = self.quadrature.split(", ")
        return {kind: next(one for one in names if ("Gauss" in one) == kind.startswith("quad")) for kind in self.cells}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Surface(Recovery):
    """A triangulated surface, known by its edge lengths.

    `points` are NaN unless coordinates in space were asked for; `node_status` says for which vertices the entries tell
    lengths. Triangles of a piece run the same way round where it is orientable. `boundary` holds the edges with one
    triangle, loop by loop, in no order and direction.
    """

    look: ClassVar[Look] = Look(
        solid=False, two_sided=True, cells="triangles, one shape of possibly many with their sides"
    )

    edges: NDArray[np.int64]  #: (e, 2) sides of the triangles, rows i < j.
    edge_lengths: NDArray[np.float64]  #: (e,) mean 1 in each piece.
    #: (n,) what the angles about a vertex lack of 2 pi, or of pi on the boundary; added up where several sheets touch
    #: in a vertex, NaN where there is none. Over a piece it adds up to 2 pi times the Euler characteristic.
    curvature: NDArray[np.float64]
    #: (number of pieces,) Euler characteristic; sheets that only touch in a vertex count as apart there.
    euler: NDArray[np.int64]
    orientable: NDArray[np.bool_]  #: (number of pieces,)
    loops: NDArray[np.int64]  #: (number of pieces,) boundary loops.
    #: Of coordinates in space ``misfit``, the root mean square difference of edge lengths relative to their mean,
    #: ``largest``, the largest such difference, and ``misfits``, those of all starts.
    realisation: Mapping[str, Any] | None = None
    chi_square: Mapping[str, float] | None = None  #: With noise, the test that rows sum to zero, as in `PlanarMesh`.
    length_deviations: NDArray[np.float64] | None = None  #: (e,) with noise, on request, one standard deviation.

    @property
    def shapeless(self) -> str:
        """That lengths alone are known, unless coordinates were asked for."""
        if np.isfinite(self.points).any():
            return ""
        return "the matrix of a surface tells edge lengths only"

    @property
    def drawable(self) -> bool:
        """Yes: in coordinates that come near its lengths where it has no others."""
        return True

    @property
    def instead(self) -> str:
        """By asking for coordinates that have the lengths."""
        return ", or ask for coordinates with `realise=True`"

    @property
    def title(self) -> str:
        """The status, which is that of the edge lengths where coordinates are one shape of many."""
        return f"edge lengths {self.status}" if self.dim == 3 else self.status

    def details(self) -> list[str]:
        """How far off edge lengths are where coordinates are one shape of many, and the factor."""
        rows = []
        if self.realisation is not None and self.dim == 3:
            rows.append(f"edge lengths off by {self.realisation['misfit']:.1e}")
        return rows + super().details()

    def facts(self) -> list[tuple[str, str]]:
        """What kind of surface each piece is, its curvature, and how well coordinates have its lengths."""
        pieces = zip(self.euler, self.orientable, self.loops, strict=True)
        rows = [("surface", kind_text(*piece)) for piece in list(pieces)[:SHOWN]]
        low, high = np.nanmin(self.curvature), np.nanmax(self.curvature)
        rows.append(("curvature", f"{low:.3g} to {high:.3g} at a vertex"))
        if self.realisation is not None:
            off = f"edge lengths off by {self.realisation['misfit']:.1e} (root mean square)"
            rows.append(("coordinates", f"{off}, one shape of possibly many"))
        return [*rows, ("scale c", self.scale_text())]

    def entries_of_report(self) -> dict[str, Any]:
        """The kind of surface, its curvature, error bars, and how well coordinates have its lengths."""
        deviations = self.length_deviations
        return {
            "n_edges": len(self.edges),
            "euler_characteristic": self.euler,
            "orientable": self.orientable,
            "genus": self.genus,
            "n_boundary_loops": self.loops,
            "largest_curvature": np.nanmax(np.abs(self.curvature)),
            "chi_square": self.chi_square,
            "largest_standard_deviation": None if deviations is None else np.nanmax(deviations),
            "realisation": self.realisation,
        }

    def point_data(self) -> dict[str, NDArray]:
        """The curvature of each vertex."""
        return {"curvature": self.curvature}

    @property
    def flat(self) -> bool:
        """Whether the angles about every vertex inside add up to a full turn, up to rounding."""
        inside = np.isfinite(self.curvature)
        inside[self.boundary] = False
        return bool(np.abs(self.curvature[inside]).max(initial=0.0) < PLACED)

    @property
    def fits_no_plane(self) -> bool:
        """Whether a piece is closed, one-sided or has a handle, so that no mesh in the plane has these triangles."""
        return bool(((self.loops == 0) | ~self.orientable | (self.genus > 0)).any())

    @property
    def genus(self) -> NDArray[np.int64]:
        """(number of pieces,) handles, or cross-caps of pieces that are not orientable."""
        total = 2 - self.loops - self.euler
        return np.asarray(np.where(self.orientable, total // 2, total))
