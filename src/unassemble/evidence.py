"""What a misfit looks like: noise of some size, numbers of few digits, or a few wrong entries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .certify import Certificate
from .errors import SolverError
from .matrix import OperatorMatrix
from .planar.cotangent import edge_weights, weight_roundings
from .planar.piece import PieceMesh
from .planar.suspects import find_suspects
from .topology import Topology

_SUSPECT_LIMIT = 200_000
"""Most vertices of a piece that is searched for wrong entries: that takes a factorisation of its own."""
_CERTAIN = np.log(1e-6)
_ROUNDING = 1e-11
"""Misfits up to this, where errors are as large as rounding makes them, prove nothing."""
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
        Entries without which the mesh would fit the others far better.
    certain : bool
        Whether the suspects cannot be chance.
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
    rounding: bool,
) -> Evidence:
    """Evidence on a finished mesh; wrong entries are looked for if `search`.

    With `rounding`, errors of the size that rounding has where there are slivers do not stand out.
    """
    noise = _norm(certificate.differences) / float(np.sqrt(freedom)) if freedom > 0 else None
    suspects, certain = NONE, False
    if search and freedom > 1:
        suspects, certain = _suspects(topology, matrix, meshes, free_scale=free_scale, rounding=rounding)
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
    topology: Topology, matrix: OperatorMatrix, meshes: list[PieceMesh], *, free_scale: bool, rounding: bool
) -> tuple[NDArray[np.int64], bool]:
    pairs, certain = [], False
    for piece, mesh in zip(topology.pieces, meshes, strict=True):
        if mesh.aside is not None:  # and all others fit
            pairs.append(matrix.edges[piece.edge_rows[mesh.aside]])
            certain = True
            continue
        if piece.n_vertices > _SUSPECT_LIMIT:
            continue
        weights = -matrix.entries[piece.edge_rows]
        spread = weight_roundings(piece, mesh.z) if rounding else mesh.spread
        try:
            found = find_suspects(piece, weights, mesh.z, mesh.scale, spread, free_scale=free_scale)
        except SolverError:  # flat triangles: nothing can be told apart there
            continue
        if found.log_p < _CERTAIN:
            pairs.append(matrix.edges[piece.edge_rows[found.edges]])
            certain = certain or (found.left < 0.01 and found.size > _ROUNDING)
    return (np.concatenate(pairs) if pairs else NONE), certain


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
