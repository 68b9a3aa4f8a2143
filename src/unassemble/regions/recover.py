"""Meshes whose coefficient is constant on regions, from entries to result."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from ..boundaries.fit import EXACT, Fit, FitOptions, WholeEntries
from ..boundaries.judge import determined
from ..budget import SAMPLE
from ..certify import certify
from ..clock import Clock
from ..errors import GeometryError, SolverError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.conformal import conformal_map
from ..planar.cotangent import edge_weights
from ..recovery import PlanarMesh
from ..scalar.held import Held
from ..scalar.joined import JoinedMesh
from ..scalar.placement import Placement
from ..tolerances import CERTIFIED
from ..topology import Piece, local_numbering, surfaces
from .exchange import exchanges
from .guess import guessed_regions
from .start import started

_log = logging.getLogger(__name__)


_FIRST = FitOptions(last_steps=40, damping=1e-3)  # of the fit from a start
_NEXT = FitOptions(last_steps=15, damping=1e-6)  # and of those after exchanges


@dataclass(frozen=True, eq=False)
class _Regions:
    """One piece: positions, and factors of regions."""

    z: NDArray[np.complex128]  # (n,)
    region: NDArray[np.int64]  # (m,)
    scale: NDArray[np.float64]  # (k,)
    known: NDArray[np.bool_]  # (n,) vertices that entries determine


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
        placed, origins, notes = placement.placed(topology, [one.z for one in found], [()] * len(found))
        stretch = placement.tensor.root_determinant if placement.tensor else 1.0
        mesh = JoinedMesh.of(topology, placed, scale / stretch)
        points = mesh.shifted(origins)
    with clock("certify"):
        factor = mesh.scale[region]
        certificate = certify(
            matrix.edges, matrix.entries, np.nan_to_num(points), mesh.triangles, factor, placement.coefficients
        )
    if not certificate.backward_error <= CERTIFIED or len(certificate.flipped):
        return None
    known = np.ones(matrix.n, dtype=bool)
    for piece, one in zip(topology.pieces, found, strict=True):
        known[piece.vertices] &= one.known
    if not known[topology.multiplicity > 0].any():
        return None
    return PlanarMesh(
        **mesh.fields(triangulate=True),
        **Held(certificate, None, None).fields(0),
        points=points,
        region=region,
        hinges=topology.hinges,
        node_status=np.where(topology.multiplicity == 0, 1, np.where(known, 0, 2)).astype(np.int8),
        status="certified",
        uniqueness="searched",
        reason=(
            f"the operator re-assembled on the mesh, with a factor for each of {len(scale)} regions, gives the entries "
            f"back to {certificate.backward_error:.1e} (relative)"
        ),
        operator=placement.operator,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes),
    )


def _uniform(piece: Piece, weights: NDArray) -> bool:
    """Whether one factor comes near all entries, at the conformal map."""
    try:
        found = conformal_map(piece, weights, scale=None, sharp=False)
    except (GeometryError, SolverError):
        return False
    misfit = weights / found.scale - edge_weights(piece, found.z)
    return bool(np.sqrt(np.mean(misfit**2)) < 1e-3)  # entries may have errors


def _fitted(piece: Piece, weights: NDArray, region: NDArray[np.int64], scale: NDArray) -> _Regions | None:
    """All entries of a piece fitted, triangles exchanged where they do not fit; None where that comes to no end.

    With several triangles wrong, one that is put right may well leave more of a misfit than before: the least misfit of
    all so far is where exchanges go on from, until it has none left, and in small pieces the next one after it.
    """
    unit = float(np.median(scale))
    weights = weights / unit
    whole = np.ones(len(weights), dtype=bool)
    problem = WholeEntries(piece, weights, ~whole, region=region)

    def fit(region: NDArray, z: NDArray, scale: NDArray, options: FitOptions) -> Fit:
        problem.region = region
        return problem.fit(z, scale, whole, 0.0, options)

    try:
        best = fit(region, *started(piece, weights, region, scale / unit), _FIRST)
        seen, failed = {region.tobytes()}, 0
        reached: list[tuple[float, int, NDArray[np.int64], Fit, Iterator[NDArray[np.int64]]]] = [
            (best.misfit, 0, region, best, exchanges(problem, best.z, best.scale))
        ]
        while best.misfit > EXACT and reached and failed < 40:
            _, _, problem.region, here, others = reached[0]
            other = next(others, None)
            if other is None:
                if piece.n_vertices > SAMPLE:
                    break
                heappop(reached)
            elif other.tobytes() not in seen:
                found = fit(other, here.z, here.scale, _NEXT)
                if found.misfit > EXACT:  # from where wrong regions have bent the mesh, or from a start of its own
                    anew = fit(other, *started(piece, weights, other, here.scale), _FIRST)
                    found = anew if anew.misfit < found.misfit else found
                failed = 0 if found.misfit < 0.98 * best.misfit else failed + 1
                if found.misfit < best.misfit:
                    best, region = found, other
                    _log.debug("%d exchanges: misfit %.1e", len(seen), best.misfit)
                heappush(reached, (found.misfit, len(seen), other, found, exchanges(problem, found.z, found.scale)))
                seen.add(other.tobytes())
        if not best.misfit <= EXACT:
            return None
        used, place = np.unique(region, return_inverse=True)
        scale, same = _distinct(best.scale[used])
        problem.region = same[place.ravel()]
        known, _ = determined(problem, best.z, scale, whole)
        return _Regions(best.z, problem.region, scale * unit, known)
    finally:
        problem.release()


def _distinct(scale: NDArray) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Factors that are not the same but for rounding, in ascending order, and which of them each one is."""
    order = np.argsort(scale)
    ends = scale[order]
    new = np.append(True, np.diff(ends) > CERTIFIED * np.abs(ends[1:]))
    label = np.empty(len(scale), dtype=np.int64)
    label[order] = np.cumsum(new) - 1
    return ends[new], label
