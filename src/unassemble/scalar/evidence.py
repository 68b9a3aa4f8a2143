"""What a misfit looks like: noise of some size, or a few wrong entries."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells.judge.labelling import even
from ..certify import Certificate
from ..errors import SolverError
from ..planar.cautious import CautiousOptions
from ..planar.cotangent import edge_weights, weight_roundings
from ..planar.piece import PieceMesh
from ..planar.suspects import differences_without, find_suspects
from ..planar.terms import Term, lacking_term
from ..tolerances import ALIKE, CERTIFIED, CHANCE, LARGEST_NOISE, LITTLE, NOISY, SMALL, SUMMED
from ..topology import Piece
from .solving import Solved


@dataclass(frozen=True, eq=False)
class Evidence:
    """What can be said about a misfit beyond its size."""

    # standard deviation of independent errors of one size in the entries that would leave this misfit; None where there
    # are no more entries than unknowns, and where the misfit is no noise
    noise: float | None
    # (k, 2) entries without which a mesh fits all others, as well as right entries are fitted
    suspects: NDArray[np.int64]
    certain: bool  # whether that few entries explain nearly all of the misfit cannot be chance
    # a term that the model lacks, where it cannot be chance that it explains so much of the misfit
    term: Term | None = None


NONE = np.empty((0, 2), dtype=np.int64)


def weigh(solved: Solved, certificate: Certificate, *, free_scale: bool, search: bool) -> Evidence:
    """Evidence on a finished mesh; wrong entries are looked for if `search`.

    Unless their noise is known, errors of the size that rounding has where there are slivers do not stand out.
    """
    freedom = solved.freedom(free_scale=free_scale)
    noise = _norm(certificate.differences) / float(np.sqrt(freedom)) if freedom > 0 else None
    suspects, certain = NONE, False
    if search and freedom > 1:
        suspects, certain = _suspects(solved, free_scale=free_scale)
    term = None
    if noise and certificate.backward_error > CERTIFIED and not len(certificate.flipped):
        term = _term(solved, noise, free_scale=free_scale)
    return Evidence(None if term else noise, suspects, certain, term)


def _term(solved: Solved, noise: float, *, free_scale: bool) -> Term | None:
    """What the model lacks, as the piece tells in which chance is least likely; no entry is blamed for that."""
    if not noise <= LARGEST_NOISE * np.abs(solved.scales).min() or (solved.noise and solved.noise.digits):
        return None
    found = []
    for piece, mesh in zip(solved.topology.pieces, solved.meshes, strict=True):
        weights = -solved.matrix.entries[piece.edge_rows]
        term = lacking_term(piece, weights, mesh.z, mesh.scale, mesh.spread, free_scale=free_scale)
        found += [] if term is None else [term]
    least = min(found, key=lambda term: term.probability, default=None)
    return least if least and least.probability * len(found) < CHANCE else None


def pooled_noise(solved: Solved, freedom: int) -> float:
    """Common factor of the standard deviations of the entries' errors, in the norms that the pieces were fitted in."""
    norms = []
    for piece, mesh in zip(solved.topology.pieces, solved.meshes, strict=True):
        misfit = solved.matrix.entries[piece.edge_rows] + mesh.scale * edge_weights(piece, mesh.z)
        norms.append(_norm(misfit if mesh.spread is None else misfit / mesh.spread))
    return _norm(np.array(norms)) / float(np.sqrt(max(freedom, 1)))


def _norm(values: NDArray) -> float:
    """Root of the sum of squares, none of which may overflow."""
    largest = float(np.abs(values).max(initial=0.0))
    return largest * float(np.linalg.norm(values / largest)) if 0 < largest < np.inf else largest


def _suspects(solved: Solved, *, free_scale: bool) -> tuple[NDArray[np.int64], bool]:
    """Entries to blame: those without which all others fit, in all pieces; and whether few explain the misfit."""
    matrix, topology, noise = solved.matrix, solved.topology, solved.noise
    pairs, certain, explained = [], False, True
    errors = None if noise is None else noise.sigma * noise.on(topology)
    for piece, mesh in zip(topology.pieces, solved.meshes, strict=True):
        weights = -matrix.entries[piece.edge_rows]
        before = np.nan_to_num(weights - mesh.scale * edge_weights(piece, mesh.z), nan=np.inf)
        if noise is None and _rounded(piece, mesh, before):
            continue
        found, own = None, None if errors is None else errors[piece.edge_rows]
        if piece.n_vertices <= CautiousOptions().most_vertices:
            spread = weight_roundings(piece, mesh.z) if noise is None else mesh.spread
            with suppress(SolverError):  # flat triangles: nothing can be told apart there
                found = find_suspects(piece, weights, mesh.z, mesh.scale, spread, free_scale=free_scale)
        if found is None or found.log_p >= np.log(CHANCE):
            explained = explained and _fitted(weights, before, own)
            continue
        certain = certain or (found.left < LITTLE**2 and found.size > SUMMED)
        explained = explained and not np.isin(piece.edge_rows[found.edges], topology.vanished).any()  # these are exact
        left = differences_without(piece, weights, mesh.z, mesh.scale, found.edges, free_scale=free_scale)
        explained = explained and _fitted(weights, left, own) and bool(_norm(left) ** 2 < LITTLE * _norm(before) ** 2)
        pairs.append(matrix.edges[piece.edge_rows[found.edges]])
    return (np.concatenate(pairs) if pairs and explained else NONE), certain


def _rounded(piece: Piece, mesh: PieceMesh, left: NDArray) -> bool:
    """Whether a misfit is so small, where errors are as large as rounding makes them, that it proves nothing."""
    with np.errstate(all="ignore"):  # flat triangles
        return _norm(left / mesh.scale / weight_roundings(piece, mesh.z)) <= SUMMED


def _fitted(weights: NDArray, differences: NDArray, errors: NDArray | None) -> bool:
    """Whether differences are those of right cells: below what any wrong one leaves, or noise, known or not."""
    if errors is not None:
        return bool(_norm(differences / errors) <= NOISY * np.sqrt(len(differences)))
    with np.errstate(over="ignore"):  # triangles that are nearly flat
        left = np.abs(differences) / (np.abs(weights) + np.median(np.abs(weights)))
    return bool((left <= ALIKE).all()) or (even(left) and float(np.sqrt(np.mean(left**2))) < SMALL)
