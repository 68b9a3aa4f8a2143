"""What a misfit looks like: noise of some size, numbers of few digits, or a few wrong entries."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import settled
from ..certify import Certificate
from ..errors import SolverError
from ..matrix import OperatorMatrix
from ..planar.cotangent import edge_weights, weight_roundings
from ..planar.piece import PieceMesh
from ..planar.robust import differences_without
from ..planar.suspects import find_suspects
from ..topology import Topology

_SUSPECT_LIMIT = 200_000
"""Most vertices of a piece that is searched for wrong entries: that takes a factorisation of its own."""
_CERTAIN = np.log(1e-6)
_ROUNDING = 1e-11
"""Misfits up to this, where errors are as large as rounding makes them, prove nothing."""
_NEARLY_ALL = 0.01  # of the squared misfit
_LESS = 0.1  # of the squared misfit that entries may leave which are blamed; derivatives promised less
_NOISY = 2.0  # root mean square of a misfit, over the noise, that noise explains
_SAMPLE = 2000


@dataclass(frozen=True, eq=False)
class Evidence:
    """What can be said about a misfit beyond its size.

    Attributes
    ----------
    noise : float or None
        Standard deviation of independent errors of one size in the entries that would leave this misfit; None where
        there are no more entries than unknowns.
    digits : str or None
        The precision that entries are stored with, if it explains the misfit.
    rounding : float
        Standard deviation of the rounding errors of the largest entries at that precision.
    suspects : (k, 2) int64
        Entries without which a mesh fits all others, as well as right entries are fitted.
    certain : bool
        Whether that few entries explain nearly all of the misfit cannot be chance.
    """

    noise: float | None
    digits: str | None
    rounding: float
    suspects: NDArray[np.int64]
    certain: bool


NONE = np.empty((0, 2), dtype=np.int64)


def weigh(
    topology: Topology,
    matrix: OperatorMatrix,
    meshes: list[PieceMesh],
    certificate: Certificate,
    freedom: int,
    *,
    free_scale: bool,
    search: bool,
    known_noise: float | None,
) -> Evidence:
    """Evidence on a finished mesh; wrong entries are looked for if `search`.

    Unless there is `known_noise`, errors of the size that rounding has where there are slivers do not stand out.
    """
    noise = _norm(certificate.differences) / float(np.sqrt(freedom)) if freedom > 0 else None
    suspects, certain = NONE, False
    if search and freedom > 1:
        suspects, certain = _suspects(topology, matrix, meshes, free_scale=free_scale, noise=known_noise)
    digits, size = _digits(matrix, certificate) if search else (None, 0.0)
    return Evidence(noise, digits, size, suspects, certain)


def pooled_noise(topology: Topology, matrix: OperatorMatrix, meshes: list[PieceMesh], freedom: int) -> float:
    """Common factor of the standard deviations of the entries' errors, in the norms that the pieces were fitted in."""
    norms = []
    for piece, mesh in zip(topology.pieces, meshes, strict=True):
        misfit = matrix.entries[piece.edge_rows] + mesh.scale * edge_weights(piece, mesh.z)
        norms.append(_norm(misfit if mesh.spread is None else misfit / mesh.spread))
    return _norm(np.array(norms)) / float(np.sqrt(max(freedom, 1)))


def _norm(values: NDArray) -> float:
    """Root of the sum of squares, none of which may overflow."""
    largest = float(np.abs(values).max(initial=0.0))
    return largest * float(np.linalg.norm(values / largest)) if 0 < largest < np.inf else largest


def _suspects(
    topology: Topology, matrix: OperatorMatrix, meshes: list[PieceMesh], *, free_scale: bool, noise: float | None
) -> tuple[NDArray[np.int64], bool]:
    """Entries to blame: those without which all others fit, in all pieces; and whether few explain the misfit."""
    pairs, certain, explained = [], False, True
    for piece, mesh in zip(topology.pieces, meshes, strict=True):
        if mesh.aside is not None:  # and all others fit
            pairs.append(matrix.edges[piece.edge_rows[mesh.aside]])
            certain = True
            continue
        weights = -matrix.entries[piece.edge_rows]
        before = np.nan_to_num(weights - mesh.scale * edge_weights(piece, mesh.z), nan=np.inf)
        found = None
        if piece.n_vertices <= _SUSPECT_LIMIT:
            spread = weight_roundings(piece, mesh.z) if noise is None else mesh.spread
            with suppress(SolverError):  # flat triangles: nothing can be told apart there
                found = find_suspects(piece, weights, mesh.z, mesh.scale, spread, free_scale=free_scale)
        if found is None or found.log_p >= _CERTAIN:
            explained = explained and _fitted(weights, before, noise)
            continue
        certain = certain or (found.left < _NEARLY_ALL and found.size > _ROUNDING)
        explained = explained and not np.isin(piece.edge_rows[found.edges], topology.vanished).any()  # these are exact
        left = differences_without(piece, weights, mesh.z, mesh.scale, found.edges, free_scale=free_scale)
        explained = explained and _fitted(weights, left, noise) and bool(_norm(left) ** 2 < _LESS * _norm(before) ** 2)
        pairs.append(matrix.edges[piece.edge_rows[found.edges]])
    return (np.concatenate(pairs) if pairs and explained else NONE), certain


def _fitted(weights: NDArray, differences: NDArray, noise: float | None) -> bool:
    """Whether differences are those of right cells: below what any wrong one leaves, or noise, known or not."""
    if noise is not None:
        return bool(_norm(differences) <= _NOISY * noise * np.sqrt(len(differences)))
    with np.errstate(over="ignore"):  # triangles that are nearly flat
        return settled(np.abs(differences) / (np.abs(weights) + np.median(np.abs(weights))))


def _digits(matrix: OperatorMatrix, certificate: Certificate) -> tuple[str | None, float]:
    """Entries of single precision or of few decimal digits, if no misfit is beyond that."""
    entries = matrix.entries
    if len(certificate.pairs) != len(entries):
        return None, 0.0
    size = np.abs(entries)
    difference = np.abs(certificate.differences)
    sample = entries[:: max(1, len(entries) // _SAMPLE)]
    with np.errstate(over="ignore", under="ignore"):
        single = np.array_equal(sample, sample.astype(np.float32))
    if single:
        name, unit = "numbers of single precision", size * 2.0**-24
    else:
        count = next((d for d in range(3, 13) if _has_digits(sample, d)), None)
        if count is None:
            return None, 0.0
        with np.errstate(divide="ignore"):
            leading = np.floor(np.log10(np.where(size > 0, size, 1.0)))
        name, unit = f"numbers of {count} digits", 0.5 * 10.0 ** (leading - count + 1)
    # Least squares spread a misfit, so that single ones may exceed their own bound: the largest of the row counts.
    near = np.zeros(matrix.n)
    for end in matrix.edges.T:
        np.maximum.at(near, end, unit)
    bound = np.maximum(near[matrix.edges[:, 0]], near[matrix.edges[:, 1]])
    # An error between -u and u, evenly distributed, has the standard deviation u / sqrt(3).
    return (name, float(unit.max() / np.sqrt(3))) if np.all(difference <= 2 * bound) else (None, 0.0)


def _has_digits(values: NDArray, count: int) -> bool:
    return all(float(f"{value:.{count - 1}e}") == value for value in values.tolist())
