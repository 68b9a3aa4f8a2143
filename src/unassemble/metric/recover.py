"""A curved surface on one page: triangles, lengths, certificate."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from ..certify_metric import MetricCertificate, certify_metric
from ..clock import Clock
from ..errors import GeometryError, RecoveryError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import Surface
from ..tolerances import CERTIFIED, CONFIDENCE, LARGEST_NOISE
from ..topology.manifold import Cycles, in_four_cliques, surface_readings
from ..words import count_of, sentences, words_of
from .mesh import SurfaceMesh
from .noise import length_deviations, row_sum_test, scale_deviation
from .program import Metric, solve_metric
from .taken_out import with_vertices_back

_READINGS = 16  # as many choices of triangles as are tried one by one


@dataclass(frozen=True, eq=False)
class _Found:
    """A surface with lengths, in the numbering of the matrix."""

    mesh: SurfaceMesh
    squared: NDArray[np.float64]
    scale: NDArray[np.float64]
    certificate: MetricCertificate
    failures: tuple[str, ...]
    sums: dict[str, float] | None = None

    @property
    def fits(self) -> bool:
        held = self.certificate.entries
        return not self.failures and held.backward_error <= CERTIFIED and not len(held.flipped)

    def without_last(self, gone: int) -> _Found:
        """What is left without the last vertices, none of which are neighbours."""
        mesh, n = self.mesh, self.mesh.n - gone
        kept = (mesh.edges < n).all(axis=1)
        rows = (mesh.triangles < n).all(axis=1)
        place = np.cumsum(kept) - 1
        left = SurfaceMesh.of(Cycles(n, mesh.edges[kept], mesh.triangles[rows], place[mesh.opposite[rows]]))
        length = np.sqrt(self.squared[kept])
        piece = left.piece_of_edge
        mean = np.bincount(piece, length) / np.bincount(piece)
        return replace(self, mesh=left, squared=(length / mean[piece]) ** 2)


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
        used, notes = _used(matrix)
        cycles = Cycles.of(used.n, used.edges)
        if triangles is None:
            readings = list(islice(surface_readings(cycles), _READINGS + 1))
        else:
            readings = [cycles.among(triangles)]
        solid = in_four_cliques(cycles)
    found = [_solved(used, SurfaceMesh.of(cycles, chosen), clock, options) for chosen in readings[:_READINGS]]
    fitting = [one for one in found if one.fits]
    best = (fitting or found)[0]
    if not np.isfinite(best.scale).any():
        raise GeometryError(best.failures[0])
    verdict = _verdict(best, len(fitting), len(readings), solid, options, len(cycles.triangles))
    deviations = None
    if options.noise is not None and options.standard_deviations:
        with clock("deviations"):
            deviations = np.full(len(best.squared), np.nan)
            for scale, (rows, opposite) in zip(best.scale, best.mesh.pieces(), strict=True):
                if np.isfinite(scale):
                    own = length_deviations(best.squared[rows], opposite)
                    deviations[rows] = options.noise / abs(scale) * own
    if back:
        best = best.without_last(back)
        notes.append(f"{count_of(back, 'vertex was', 'vertices were')} put back, with the entries that rows lack")
        if verdict.status == "certified" and options.scale is None:
            verdict = _Verdict("ambiguous", "ambiguous", _SEVERAL)
    return _report(best, verdict, notes, clock, deviations)


_SEVERAL = (
    "with one vertex put back into each hole where rows lack entries, lengths give all entries and row sums back, but "
    "so may several vertices in a hole"
)


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
    for label, (order, opposite) in enumerate(mesh.pieces()):
        with clock("metric"):
            entries = matrix.entries[order]
            sign = -1.0 if entries.sum() > 0 else 1.0
            try:
                metric: Metric = solve_metric(-sign * entries, opposite, polish=options.refine)
            except GeometryError as error:
                vertex = mesh.triangles[mesh.piece == label].min()
                failures.append(f"{error} (piece of row {vertex})")
                continue
        lengths = np.sqrt(metric.squared)
        squared[order] = metric.squared / lengths.mean() ** 2
        scale[label] = sign * metric.scale
    with clock("certify"):
        # Entries with errors tell a scale with an error, which is tested by itself.
        told = options.scale if options.noise is None else None
        factor = scale if told is None else np.where(np.isfinite(scale), told, np.nan)
        certificate = certify_metric(
            mesh.edges, matrix.entries, matrix.diagonal, np.sqrt(squared), mesh.triangles, factor[mesh.piece]
        )
    sums = None if options.noise is None else row_sum_test(matrix, options.noise)
    return _Found(mesh, squared, factor, certificate, tuple(failures), sums)


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
        reason = f"lengths{known} give the entries back up to {error:.1e} (relative) only, worst in rows {i} and {j}"
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
    if options.noise is not None:
        return _with_noise(found, kept, fits, options.noise, options.scale)
    if options.scale is not None:
        return _Verdict("certified", kept, sentences((fits, "the scale is the given one")))
    off = held.row_misfits > CERTIFIED
    inside = np.bincount(found.mesh.edges[found.mesh.boundary].ravel(), minlength=found.mesh.n) == 0
    if not off.any() and (held.diagonal == "zero" or inside.any()):
        return _Verdict("certified", kept, sentences((fits, _SUMS[held.diagonal])))
    row = int(np.argmax(off))
    reason = (
        f"{fits}, but there are as many unknowns as entries, and that this is a surface with all its rows does not "
        f"show: rows do not sum to zero, row {row} for one"
    )
    return _Verdict("uncertified", kept, sentences((reason, "a known scale would tell")))


def _with_noise(found: _Found, kept: str, fits: str, sigma: float, scale: float | None) -> _Verdict:
    """Lengths fit noisy entries as well as exact ones: what is tested is the row sums, or the scale."""
    if sigma > LARGEST_NOISE * np.abs(found.scale).min():
        return _Verdict("uncertified", None, "the noise is too large: angles are known to no more than a few degrees")
    if scale is not None:
        error = [sigma * scale_deviation(found.squared[rows], place) for rows, place in found.mesh.pieces()]
        off = float((np.abs(found.scale - scale) / error).max())
        if 2 * ndtr(-off) >= CONFIDENCE:
            return _Verdict("certified", kept, sentences((fits, "the scale is the given one up to noise")))
        return _Verdict("uncertified", kept, f"the entries tell another scale, off by {off:.1f} standard deviations")
    test = found.sums or {}
    if min(test["p_value"], test["largest_p_value"]) >= CONFIDENCE:
        return _Verdict("certified", kept, sentences((fits, "rows sum to zero up to noise")))
    return _Verdict("uncertified", kept, "rows do not sum to zero, by more than noise, and no entries are to spare")


_SUMS = {
    "zero": "rows sum to zero",
    "constant": "rows sum to one number",
    "areas": "rows sum to a multiple of the areas about their vertices",
}


def _report(found: _Found, verdict: _Verdict, notes: list[str], clock: Clock, deviations: NDArray | None) -> Surface:
    mesh = found.mesh
    worst, misfits = found.certificate.entries.worst(10 if verdict.uniqueness is None else 0)
    curvature = mesh.curvature(found.squared)
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
        chi_square=found.sums,
        length_deviations=deviations,
    )
