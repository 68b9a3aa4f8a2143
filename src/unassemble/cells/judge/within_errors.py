"""Readings of entries with errors of known size: what of a misfit these do not explain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from ...errors import SolverError
from ...matrix.operator import row_sizes
from ...planar.cotangent import left_by_all
from ...planar.piece import PieceMesh
from ...planar.polish import SHORT, polish
from ...tolerances import CHANCE, LITTLE, MAGNIFIED, SIGMAS, SMALL
from ...topology import Piece

GAP = 30.0
"""What errors may leave open in rings of pieces, in units of their size and of the errors over c."""


Solved = list[tuple[Piece, PieceMesh]]


def polished(solved: Solved, weights: NDArray, errors: NDArray, misfit: NDArray, scale: float | None) -> Solved | None:
    """Pieces as the entries ask for in the mean, with one c; None where their misfit is more than errors explain.

    The piece with the most entries to spare tells c, where `scale` is not given.

    `solved` list of (Piece, PieceMesh); `weights` and `errors` (e,): of all edges; errors of those that have vanished
    are 0; `misfit` (e,): as in :class:`unassemble.cells.judge.Labelling`.
    """
    if not solved:
        return None
    allowed = MAGNIFIED * errors.max(initial=0.0) / np.median(np.abs(weights[weights != 0]))
    if not misfit.max() <= min(allowed, LITTLE):
        return None
    spread = np.maximum(errors, SMALL * np.median(errors[errors > 0]))
    found: dict[Piece, PieceMesh] = {}
    for piece, mesh in sorted(solved, key=lambda both: -both[0].redundancy):
        rows = piece.edge_rows
        try:
            with np.errstate(all="ignore"):
                better = polish(piece, weights[rows], mesh.z, scale=scale, spread=spread[rows], options=SHORT)
        except SolverError:
            return None
        if not (np.isfinite(better.z).all() and np.isfinite(better.scale)):
            return None
        found[piece], scale = PieceMesh(better.z, better.scale), better.scale
    again = [(piece, found[piece]) for piece, _ in solved]
    return again if _likely(again, weights, spread) else None


def _likely(solved: Solved, weights: NDArray, errors: NDArray) -> bool:
    """Whether the sum of squares of the misfit is not improbably large; c is fitted once."""
    pieces, meshes = zip(*solved, strict=True)
    left = left_by_all(pieces, weights, [mesh.z for mesh in meshes], np.array([mesh.scale for mesh in meshes]))
    freedom = max(sum(piece.redundancy + 1 for piece in pieces) - 1, 1)
    with np.errstate(all="ignore"):  # flat triangles
        squares = float(np.sum((left / errors[np.concatenate([piece.edge_rows for piece in pieces])]) ** 2))
    return bool(chdtrc(freedom, squares) >= CHANCE)


def beyond(n: int, edges: NDArray, solved: Solved, weights: NDArray, errors: NDArray) -> NDArray[np.float64]:
    """(e,) the misfit less what errors explain, relative to the smaller of both rows' largest entries, at most 1."""
    misfit = np.where(weights != 0, 1.0, 0.0)
    pieces, meshes = zip(*solved, strict=True)
    rows = np.concatenate([piece.edge_rows for piece in pieces])
    smaller = row_sizes(n, edges, np.abs(weights))[edges[rows]].min(axis=1)
    left = left_by_all(pieces, weights, [mesh.z for mesh in meshes], np.array([mesh.scale for mesh in meshes]))
    error = np.maximum(errors, SMALL * np.median(errors[errors > 0]))[rows]
    with np.errstate(all="ignore"):
        excess = np.maximum(np.abs(left) - SIGMAS * error, 0.0) / smaller
    misfit[rows] = np.where(excess < 1, excess, 1.0)
    return misfit
