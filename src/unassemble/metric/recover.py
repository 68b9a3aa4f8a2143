"""A curved surface on one page: triangles, lengths, certificate."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..certificate import Certificate, MetricCertificate, certify_metric
from ..clock import Clock
from ..errors import GeometryError, RecoveryError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import Examined, Placed, Surface, finish
from ..topology.cycles import three_cycles
from ..topology.keys import pair_keys
from ..topology.manifold import Cycles, in_four_cliques, surface_readings
from ..topology.numbering import connected
from ..words import Reason, count_of
from .mesh import SurfaceMesh
from .program import Metric, solve_metric
from .verdict import READINGS, VARYING, Found, findings, length_deviations, row_sum_test


def recover_surface(
    matrix: OperatorMatrix, clock: Clock, options: ScalarOptions, triangles: NDArray[np.int64] | None = None
) -> Surface:
    """The triangles and edge lengths of a surface from its Laplacian, A = c L + D; on given triangles if there are any.

    Vertices of which one alone was taken out in a place count for lengths, and are not among its points.

    Raises
    ------
    TopologyError
        If the graph is not that of a surface.
    GeometryError
        If no piece has edge lengths with these entries.
    """
    if triangles is None and options.noise is None and (whole := with_vertices_back(matrix)) is not None:
        with suppress(RecoveryError):
            found = _recovered(whole, clock, options, None, whole.n - matrix.n)
            if found.status != "uncertified":
                return found
    return _recovered(matrix, clock, options, triangles)


def _recovered(
    matrix: OperatorMatrix, clock: Clock, options: ScalarOptions, triangles: NDArray[np.int64] | None, back: int = 0
) -> Surface:
    """The same, the last `back` rows being those of vertices that were put back."""
    with clock("topology"):
        if len(matrix.edges) > 4 * matrix.n:
            # Before 3-cycles are listed: dense graphs have most of all. By Euler's formula a closed surface of n
            # vertices and g handles has 3 n - 6 + 6 g edges, and one with holes fewer.
            raise TopologyError(
                f"{count_of(len(matrix.edges), 'edge')} on {count_of(matrix.n, 'row')} are those of no surface, unless "
                "it has more handles than a sixth of its rows"
            )
        cycles, notes = Cycles.of(matrix.n, matrix.edges), list(matrix.warnings)
        spare = (cycles.at_edges() == 0) & (matrix.entries == 0)
        if spare.any():
            notes.append(f"{count_of(int(spare.sum()), 'stored zero')} on no cycle of three edges left out")
            matrix = matrix.without(spare)
            cycles = Cycles.of(matrix.n, matrix.edges)
        if not len(matrix.edges):
            raise TopologyError("the matrix is diagonal: no edges, and no surface")
        if triangles is None:
            readings = list(islice(surface_readings(cycles), READINGS + 1))
        else:
            readings = [cycles.among(triangles)]
        solid = in_four_cliques(cycles)
    found = [_solved(matrix, SurfaceMesh.of(cycles, chosen), clock, options) for chosen in readings[:READINGS]]
    fitting = [one for one in found if one.fits]
    best = (fitting or found)[0]
    if not np.isfinite(best.scale).any():
        raise GeometryError(best.failures[0])
    found_out = findings(best, len(fitting), len(readings), solid, options, len(cycles.triangles))
    deviations = None
    if options.noise is not None and options.standard_deviations:
        with clock("deviations"):
            deviations = np.full(len(best.squared), np.nan)
            for scale, (rows, opposite) in zip(best.scale, best.mesh.pieces(), strict=True):
                if np.isfinite(scale):
                    deviations[rows] = options.noise / abs(scale) * length_deviations(best.squared[rows], opposite)
    whole = best
    if back:
        best = best.without_last(back)
        notes.append(f"{count_of(back, 'vertex was', 'vertices were')} put back, with the entries that rows lack")
        if options.scale is None and found_out.another is None:
            several = Reason(
                "with one vertex put back into each hole where rows lack entries, lengths give all entries and row "
                "sums back, but so may several vertices in a hole"
            )
            found_out = replace(found_out, another=several)
    fits = not found_out.objections and found_out.another is None
    if fits and options.scale is None and not best.constant:
        notes.append(VARYING)

    def compare(surface: Surface) -> Certificate:
        """Of the surface as it is written, with the vertices that were put back where there are any."""
        if back:
            return _compared_with_back(matrix, whole, surface, best.mesh.piece_of_edge).entries
        return _compared(matrix, surface).entries

    return finish(
        clock,
        lambda: Placed(_drawn(best, deviations), notes),
        compare,
        lambda _, held: Examined(replace(found_out, error=held.backward_error)),
    )


def _compared(matrix: OperatorMatrix, surface: Surface) -> MetricCertificate:
    """A surface against the matrix."""
    factor = surface.scale[surface.component[surface.triangles].max(axis=1)]  # hinges have the lowest
    lengths = surface.edge_lengths
    return certify_metric(surface.edges, matrix.entries, matrix.diagonal, lengths, surface.triangles, factor)


def _compared_with_back(
    matrix: OperatorMatrix, whole: Found, surface: Surface, piece: NDArray[np.int64]
) -> MetricCertificate:
    """A surface as it is written, and beside it the vertices that were put back, against the matrix with their rows.

    `piece`, (e,), is that of each edge of the surface. What is written has a unit of length in each of them, in which
    the mean is one. The lengths at vertices that were put back are nowhere written: those found with the `whole` are
    taken, and tell that unit.
    """
    mesh, lengths = whole.mesh, np.sqrt(whole.squared)
    kept = (mesh.edges < surface.n_points).all(axis=1)
    unit = np.bincount(piece, lengths[kept]) / np.bincount(piece, surface.edge_lengths)
    lengths[kept] = surface.edge_lengths * unit[piece]
    factor = whole.scale[mesh.piece]
    return certify_metric(mesh.edges, matrix.entries, matrix.diagonal, lengths, mesh.triangles, factor)


def _solved(matrix: OperatorMatrix, mesh: SurfaceMesh, clock: Clock, options: ScalarOptions) -> Found:
    """Lengths of every piece, and what the certificate says of them."""
    squared = np.full(len(mesh.edges), np.nan)
    scale = np.full(mesh.n_pieces, np.nan)
    failures = []
    for label, (order, opposite) in enumerate(mesh.pieces()):
        with clock("metric"):
            entries = matrix.entries[order]
            sign = -1.0 if entries.sum() > 0 else 1.0
            try:
                metric: Metric = solve_metric(-sign * entries, opposite, polish=options.refine)
            except GeometryError as error:
                failures.append(f"{error} (piece of row {mesh.triangles[mesh.piece == label].min()})")
                continue
        squared[order] = metric.squared / np.sqrt(metric.squared).mean() ** 2
        scale[label] = sign * metric.scale
    with clock("certify"):
        # Entries with errors tell a scale with an error, which is tested by itself.
        told = options.scale if options.noise is None else None
        factor = scale if told is None else np.where(np.isfinite(scale), told, np.nan)
        certificate = certify_metric(
            mesh.edges, matrix.entries, matrix.diagonal, np.sqrt(squared), mesh.triangles, factor[mesh.piece]
        )
    sums = None if options.noise is None else row_sum_test(matrix, options.noise)
    return Found(mesh, squared, factor, certificate, tuple(failures), sums)


def _drawn(found: Found, deviations: NDArray | None) -> Surface:
    """The surface, not judged yet."""
    mesh = found.mesh
    curvature = mesh.curvature(found.squared)
    loop = mesh.loop_of_boundary
    return Surface(
        points=np.full((mesh.n, 3), np.nan),
        triangles=mesh.triangles,
        component=mesh.component,
        hinges=mesh.hinges,
        scale=found.scale,
        boundary=mesh.edges[mesh.boundary[np.argsort(loop, kind="stable")]],
        boundary_offsets=np.append(0, np.cumsum(np.bincount(loop))),
        node_status=(~np.isfinite(curvature)).astype(np.int8),
        operator="surface laplacian",
        edges=mesh.edges,
        edge_lengths=np.sqrt(found.squared),
        curvature=curvature,
        euler=mesh.euler,
        orientable=mesh.orientable,
        loops=mesh.loops,
        chi_square=found.sums,
        length_deviations=deviations,
    )


def with_vertices_back(matrix: OperatorMatrix) -> OperatorMatrix | None:
    """The matrix with a last row for each hole that one vertex may have left; None where there is no such hole.

    Rows of a Laplacian add up to zero. If all of a boundary loop do not, and others do, they lack entries; and where a
    single vertex is gone these are its own. A loop with more rows than any other row has neighbours is not closed so.
    """
    n, edges, lacking = matrix.n, matrix.edges, matrix.incomplete_rows
    _, opposite = three_cycles(n, edges)
    rim = edges[lacking[edges].all(axis=1) & (np.bincount(opposite.ravel(), minlength=len(edges)) == 1)]
    loop = connected(n, *rim.T)[1]
    twice = np.bincount(rim.ravel(), minlength=n) == 2
    degree = np.bincount(edges.ravel(), minlength=n)
    closed = (np.bincount(loop, ~twice) == 0) & (np.bincount(loop) <= degree[~lacking].max(initial=0))
    rows = np.flatnonzero(closed[loop])
    if not len(rows):
        return None
    _, gone = np.unique(loop[rows], return_inverse=True)
    sums = matrix.row_sums[rows]
    more = np.column_stack([rows, n + gone])
    total = n + int(gone.max()) + 1
    order = np.argsort(pair_keys(total, *np.vstack([edges, more]).T))
    return replace(
        matrix,
        n=total,
        edges=np.vstack([edges, more])[order],
        entries=np.append(matrix.entries, -sums)[order],
        diagonal=np.append(matrix.diagonal, np.bincount(gone, sums)),
    )
