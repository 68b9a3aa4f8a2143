"""A curved surface on one page: triangles, lengths, certificate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..certify_metric import MetricCertificate, certify_metric
from ..clock import Clock
from ..errors import GeometryError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import Surface
from ..tolerances import CERTIFIED
from ..topology import local_numbering
from ..topology.manifold import Cycles, in_four_cliques, surface_readings
from ..words import count_of, words_of
from .curvature import curvatures
from .mesh import SurfaceMesh
from .program import Metric, solve_metric

_READINGS = 16  # as many choices of triangles as are tried one by one


@dataclass(frozen=True, eq=False)
class _Found:
    """A surface with lengths, in the numbering of the matrix."""

    mesh: SurfaceMesh
    squared: NDArray[np.float64]
    scale: NDArray[np.float64]
    certificate: MetricCertificate
    failures: tuple[str, ...]

    @property
    def fits(self) -> bool:
        held = self.certificate.entries
        return not self.failures and held.backward_error <= CERTIFIED and not len(held.flipped)


def recover_surface(matrix: OperatorMatrix, clock: Clock, options: ScalarOptions) -> Surface:
    """The triangles and edge lengths of a surface from its Laplacian, A = c L + D.

    Raises
    ------
    TopologyError
        If the graph is not that of a surface.
    GeometryError
        If no piece has edge lengths with these entries.
    """
    with clock("topology"):
        used, notes = _used(matrix)
        cycles = Cycles.of(used.n, used.edges)
        readings = list(islice(surface_readings(cycles), _READINGS + 1))
        solid = in_four_cliques(cycles)
    found = [_solved(used, SurfaceMesh.of(cycles, chosen), clock, options) for chosen in readings[:_READINGS]]
    fitting = [one for one in found if one.fits]
    best = (fitting or found)[0]
    if not np.isfinite(best.scale).any():
        raise GeometryError(best.failures[0])
    verdict = _verdict(best, len(fitting), len(readings), solid, options, len(cycles.triangles))
    return _report(used, best, verdict, notes, clock)


def _used(matrix: OperatorMatrix) -> tuple[OperatorMatrix, list[str]]:
    """The matrix without zeros that belong to no triangle."""
    cycles = Cycles.of(matrix.n, matrix.edges)
    spare = (cycles.at_edges() == 0) & (matrix.entries == 0)
    notes = [f"{count_of(int(spare.sum()), 'stored zero')} on no cycle of three edges left out"] if spare.any() else []
    used = matrix.without(spare) if spare.any() else matrix
    if not len(used.edges):
        raise TopologyError("the matrix is diagonal: no edges, and no surface")
    return used, [*matrix.warnings, *notes]


def _solved(matrix: OperatorMatrix, mesh: SurfaceMesh, clock: Clock, options: ScalarOptions) -> _Found:
    """Lengths of every piece, and what the certificate says of them."""
    squared = np.full(len(mesh.edges), np.nan)
    scale = np.full(mesh.n_pieces, np.nan)
    failures = []
    of_edges = mesh.piece_of_edge
    for label in range(mesh.n_pieces):
        rows = np.flatnonzero(of_edges == label)
        own = np.flatnonzero(mesh.piece == label)
        with clock("metric"):
            order, opposite = _near_each_other(mesh, rows, own)
            entries = matrix.entries[order]
            sign = -1.0 if entries.sum() > 0 else 1.0
            try:
                metric: Metric = solve_metric(-sign * entries, opposite, polish=options.refine)
            except GeometryError as error:
                vertex = mesh.triangles[own].min()
                failures.append(f"{error} (piece of row {vertex})")
                continue
        lengths = np.sqrt(metric.squared)
        squared[order] = metric.squared / lengths.mean() ** 2
        scale[label] = sign * metric.scale
    with clock("certify"):
        factor = scale if options.scale is None else np.where(np.isfinite(scale), options.scale, np.nan)
        certificate = certify_metric(
            mesh.edges, matrix.entries, matrix.diagonal, np.sqrt(squared), mesh.triangles, factor[mesh.piece]
        )
    return _Found(mesh, squared, factor, certificate, tuple(failures))


def _near_each_other(mesh: SurfaceMesh, rows: NDArray, own: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Edges of a piece in an order in which neighbours are near each other, and the edges facing corners in it."""
    numbering = local_numbering(mesh.n, mesh.edges[rows])
    order = rows[numbering.edge_rows]
    place = np.empty(len(mesh.edges), np.int64)
    place[order] = np.arange(len(order))
    opposite = place[mesh.opposite[own]]
    return order, opposite[np.argsort(opposite.min(axis=1), kind="stable")]


@dataclass(frozen=True)
class _Verdict:
    status: str
    uniqueness: str | None
    reason: str


def _verdict(
    found: _Found, fitting: int, readings: int, solid: NDArray, options: ScalarOptions, n_cycles: int
) -> _Verdict:
    """Certified is a surface whose matrix is the given one, diagonal or known scale included, and the only one.

    There are as many edges as unknown lengths and scale: nearly every matrix with such a graph belongs to some surface.
    That this one is a Laplacian has to show elsewhere: in rows that sum to zero, or as a multiple of the identity or of
    a lumped mass matrix makes them; or in a scale that was given. Rows next to others that were taken out do not.
    """
    held = found.certificate
    if found.failures:
        return _Verdict("uncertified", None, found.failures[0])
    if len(held.entries.flipped):
        triangle = found.mesh.triangles[held.entries.flipped[0]]
        return _Verdict("uncertified", None, f"the sides of the triangle of rows {words_of(triangle)} do not meet")
    if not found.fits:
        i, j = held.entries.pairs[np.argmax(held.entries.misfits)]
        known = "" if options.scale is None else f" with c = {options.scale:g}"
        error = held.entries.backward_error
        reason = f"lengths{known} give the entries back up to {error:.1e} only, worst in rows {i} and {j}"
        return _Verdict("uncertified", None, reason)
    bare = np.bincount(found.mesh.piece_of_edge, ~solid) == 0
    if bare.any():
        row = int(found.mesh.triangles[found.mesh.piece == np.argmax(bare)].min())
        reason = f"in the piece of row {row} every edge belongs to four rows that are all coupled, as in a solid"
        return _Verdict("ambiguous", "ambiguous", f"{reason}: tetrahedra fit as well")
    if fitting > 1 or readings > _READINGS:
        return _Verdict("ambiguous", "ambiguous", "other choices of triangles have lengths that fit as well")
    kept = "proved" if n_cycles == len(found.mesh.triangles) else "searched"
    fits = "the lengths give every entry back, and no others do on these triangles"
    if options.scale is not None:
        return _Verdict("certified", kept, f"{fits}; the scale is the given one")
    off = held.row_misfits > CERTIFIED
    inside = np.bincount(found.mesh.edges[found.mesh.boundary].ravel(), minlength=found.mesh.n) == 0
    if not off.any() and (held.diagonal == "zero" or inside.any()):
        return _Verdict("certified", kept, f"{fits}; {_SUMS[held.diagonal]}")
    row = int(np.argmax(off))
    reason = (
        f"{fits}, but there are as many unknowns as entries, and that this is a surface with all its rows does not "
        f"show: rows do not sum to zero, row {row} for one; a known scale would tell"
    )
    return _Verdict("uncertified", kept, reason)


_SUMS = {
    "zero": "rows sum to zero",
    "constant": "rows sum to one number",
    "areas": "rows sum to a multiple of the areas about their vertices",
}


def _report(matrix: OperatorMatrix, found: _Found, verdict: _Verdict, notes: list[str], clock: Clock) -> Surface:
    mesh = found.mesh
    worst, misfits = found.certificate.entries.worst(10 if verdict.uniqueness is None else 0)
    curvature = curvatures(mesh, found.squared)
    loop = mesh.loop_of_boundary
    order = np.argsort(loop, kind="stable")
    _, first = np.unique(loop[order], return_index=True)
    return Surface(
        points=np.full((mesh.n, 3), np.nan),
        triangles=mesh.triangles,
        component=mesh.component,
        hinges=mesh.hinges,
        scale=found.scale,
        boundary=mesh.edges[mesh.boundary[order]],
        boundary_offsets=np.append(first, len(loop)).astype(np.int64),
        node_status=(~np.isfinite(curvature)).astype(np.int8),
        status=verdict.status,
        uniqueness=verdict.uniqueness,
        reason=verdict.reason,
        operator="surface laplacian",
        backward_error=found.certificate.entries.backward_error,
        timings=clock.timings,
        warnings=tuple(notes),
        worst_entries=worst,
        worst_misfits=misfits,
        edges=mesh.edges,
        edge_lengths=np.sqrt(found.squared),
        curvature=curvature,
        euler=mesh.euler,
        orientable=mesh.orientable,
        loops=mesh.loops,
    )
