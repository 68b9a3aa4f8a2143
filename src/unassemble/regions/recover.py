"""Meshes whose coefficient is constant on regions, from entries to result."""

import logging
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..boundaries.fit import Fit, FitOptions, WholeEntries
from ..boundaries.judge import determined
from ..certify import Certificate, certify
from ..clock import Clock
from ..errors import GeometryError, SolverError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.conformal import conformal_map
from ..planar.cotangent import edge_weights
from ..recovery import PlanarMesh
from ..scalar.joined import JoinedMesh
from ..scalar.notes import piece_notes, topology_notes
from ..scalar.placement import Placement
from ..tolerances import CERTIFIED
from ..topology import Piece, Topology, local_numbering, surfaces
from .exchange import exchanges
from .guess import guessed_regions
from .start import started

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RegionOptions:
    """Settings of the search.

    Attributes
    ----------
    first, next : FitOptions
        Of the fit from the start, and of those after exchanges.
    rounds : int
        Exchanges, one after the other.
    better : float
        Part of a misfit that an exchange leaves, at most.
    exact, near : float
        Root mean square misfit that is none, in units of typical entries; and that of a mesh without regions whose
        entries have errors.
    """

    first: FitOptions = field(default_factory=lambda: FitOptions(last_steps=40, damping=1e-3))
    next: FitOptions = field(default_factory=lambda: FitOptions(last_steps=15, damping=1e-6))
    rounds: int = 30
    better: float = 0.98
    exact: float = 1e-12
    near: float = 1e-3


@dataclass(frozen=True, eq=False)
class _Regions:
    """One piece: positions, and factors of regions.

    Attributes
    ----------
    z : (n,) complex128
    region : (m,) int64
    scale : (k,) float64
    known : (n,) bool
        Vertices that entries determine.
    """

    z: NDArray[np.complex128]
    region: NDArray[np.int64]
    scale: NDArray[np.float64]
    known: NDArray[np.bool_]


def recover_regions(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh | None:
    """The mesh of the 3-cycles of a matrix, with a factor for each region.

    Parameters
    ----------
    matrix : OperatorMatrix
    placement : Placement
    clock : Clock
    options : ScalarOptions

    Returns
    -------
    PlanarMesh or None
        None where entries show one region only, or do not fit.
    """
    if options.method != "conformal" or options.noise is not None or options.scale is not None:
        return None
    with clock("topology"):
        topology = surfaces(matrix.n, matrix.edges, local_numbering(matrix.n, matrix.edges))
    with clock("regions"), np.errstate(all="ignore"):  # flat triangles, which no fit takes
        weights = [-matrix.entries[piece.edge_rows] for piece in topology.pieces]
        guesses = [guessed_regions(piece, own) for piece, own in zip(topology.pieces, weights, strict=True)]
        told = zip(topology.pieces, weights, guesses, strict=True)
        if all(len(scale) == 1 or _uniform(piece, own) for piece, own, (_, scale) in told):
            return None
        found: list[_Regions] = []
        for piece, own, guess in zip(topology.pieces, weights, guesses, strict=True):
            regions = _fitted(piece, own, *guess)
            if regions is None:
                return None
            found.append(regions)
    scale, place = _distinct(np.concatenate([one.scale for one in found]))
    if len(scale) == 1:
        return None
    starts = np.cumsum([0, *(len(one.scale) for one in found)])
    region = place[np.concatenate([one.region + start for one, start in zip(found, starts, strict=False)])]
    with clock("place"):
        placed = [placement.apply(piece, one.z) for piece, one in zip(topology.pieces, found, strict=True)]
        stretch = placement.tensor.root_determinant if placement.tensor else 1.0
        mesh = JoinedMesh.of(topology, [z for z, _ in placed], scale / stretch)
    with clock("certify"):
        factor = mesh.scale[region]
        held = certify(
            matrix.edges, matrix.entries, np.nan_to_num(mesh.points), mesh.triangles, factor, placement.coefficients
        )
    if not held.backward_error <= CERTIFIED or len(held.flipped):
        return None
    known = np.ones(matrix.n, dtype=bool)
    for piece, one in zip(topology.pieces, found, strict=True):
        known[piece.vertices] &= one.known
    if not known[topology.multiplicity > 0].any():
        return None
    notes = [*matrix.warnings, *piece_notes([some for _, some in placed]), *placement.unused(topology)]
    return _report(mesh, region, known, held, topology, [*notes, *topology_notes(topology)], placement, clock)


def _uniform(piece: Piece, weights: NDArray) -> bool:
    """Whether one factor comes near all entries, at the conformal map."""
    try:
        found = conformal_map(piece, weights, scale=None, sharp=False)
    except (GeometryError, SolverError):
        return False
    with np.errstate(all="ignore"):
        misfit = weights / found.scale - edge_weights(piece, found.z)
    return bool(np.sqrt(np.mean(misfit**2)) < RegionOptions.near)


def _fitted(
    piece: Piece, weights: NDArray, region: NDArray, scale: NDArray, options: RegionOptions | None = None
) -> _Regions | None:
    """All entries of a piece fitted, triangles exchanged where they do not fit; None where that comes to no end."""
    options = options or RegionOptions()
    unit = float(np.median(scale))
    weights = weights / unit
    z, scale = started(piece, weights, region, scale / unit)
    problem, fit = _fit(piece, weights, region, z, scale, options.first)
    for _ in range(options.rounds):
        _log.debug("%d regions: misfit %.1e", len(scale), fit.misfit)
        if fit.misfit <= options.exact:
            break
        for other in exchanges(problem, fit.z, fit.scale):
            trial, found = _fit(piece, weights, other, fit.z, fit.scale, options.next)
            if found.misfit > options.exact:  # from where wrong regions have bent the mesh, or from a start of its own
                again, anew = _fit(piece, weights, other, *started(piece, weights, other, fit.scale), options.first)
                if anew.misfit < found.misfit:
                    trial, again, found = again, trial, anew
                again.release()
            if found.misfit < options.better * fit.misfit:
                problem.release()
                problem, fit = trial, found
                break
            trial.release()
        else:
            break
    try:
        if not fit.misfit <= options.exact:
            return None
        used, place = np.unique(problem.region, return_inverse=True)
        scale, same = _distinct(fit.scale[used])
        problem.region = same[place.ravel()]
        known, _ = determined(problem, fit.z, scale, np.ones(len(weights), dtype=bool))
        return _Regions(fit.z, problem.region, scale * unit, known)
    finally:
        problem.release()


def _fit(
    piece: Piece, weights: NDArray, region: NDArray, z: NDArray, scale: NDArray, options: FitOptions
) -> tuple[WholeEntries, Fit]:
    whole = np.ones(len(weights), dtype=bool)
    problem = WholeEntries(piece, weights, ~whole, region=region)
    return problem, problem.fit(z, scale, whole, 0.0, options)


def _distinct(scale: NDArray) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Factors that are not the same but for rounding, in ascending order, and which of them each one is."""
    order = np.argsort(scale)
    ends = scale[order]
    new = np.append(True, np.diff(ends) > CERTIFIED * np.abs(ends[1:]))
    label = np.empty(len(scale), dtype=np.int64)
    label[order] = np.cumsum(new) - 1
    return ends[new], label


def _report(
    mesh: JoinedMesh, region: NDArray, known: NDArray[np.bool_], held: Certificate, topology: Topology,
    notes: list[str], placement: Placement, clock: Clock,
) -> PlanarMesh:  # fmt: skip
    status = np.where(topology.multiplicity == 0, 1, np.where(known, 0, 2)).astype(np.int8)
    return PlanarMesh(
        **mesh.fields(triangulate=True),
        points=mesh.points,
        region=region,
        hinges=topology.hinges,
        node_status=status,
        status="certified",
        uniqueness="searched",
        reason=(
            f"the operator re-assembled on the mesh, with a factor for each of {len(mesh.scale)} regions, gives the "
            f"entries back to {held.backward_error:.1e} (relative)"
        ),
        operator=placement.operator,
        backward_error=held.backward_error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=tuple(notes),
        n_entries=len(held.misfits),
        n_fitting=int(np.count_nonzero(held.misfits <= CERTIFIED)),
    )
