"""Readings of entries with errors of known size: what of a misfit these do not explain."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from ...errors import SolverError
from ...matrix.operator import row_sizes
from ...planar.cotangent import left_by_all
from ...planar.piece import PieceMesh
from ...planar.polish import SHORT, polish
from ...tolerances import CHANCE, LITTLE, MAGNIFIED, SIGMAS
from ...topology import Piece

Placed = list[tuple[Piece, PieceMesh]]


def left_of(placed: Placed, weights: NDArray) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Rows of the edges of some pieces, one after the other, and what these leave of their weights."""
    pieces, meshes = zip(*placed, strict=True)
    scales = np.array([mesh.scale for mesh in meshes])
    left = left_by_all(pieces, weights, [mesh.z for mesh in meshes], scales)
    return np.concatenate([piece.edge_rows for piece in pieces]), left


def misfits(
    n: int, edges: NDArray, weights: NDArray, placed: Placed, errors: NDArray | None = None
) -> NDArray[np.float64]:
    """(e,) |c w - a| relative to the smaller of both rows' largest entries, at most 1; 1 on edges of no piece.

    Less what `errors` (e,) explain, if they are given.
    """
    misfit = np.where(weights != 0, 1.0, 0.0)
    if not placed:
        return misfit
    rows, left = left_of(placed, weights)
    explained = 0.0 if errors is None else SIGMAS * errors[rows]
    with np.errstate(all="ignore"):  # flat triangles fit nothing
        left = np.maximum(np.abs(left) - explained, 0.0) / row_sizes(n, edges, np.abs(weights))[edges[rows]].min(axis=1)
    misfit[rows] = np.where(left < 1, left, 1.0)
    return misfit


def polished(placed: Placed, weights: NDArray, errors: NDArray, misfit: NDArray, scale: float | None) -> Placed | None:
    """Pieces as the entries ask for in the mean, with one c; None where their misfit is more than errors explain.

    The piece with the most entries to spare tells c, where `scale` is not given; `weights`, `errors`, `misfit`: (e,).
    """
    allowed = MAGNIFIED * errors.max(initial=0.0) / np.median(np.abs(weights[weights != 0]))
    if not placed or not misfit.max() <= min(allowed, LITTLE):
        return None
    found: dict[Piece, PieceMesh] = {}
    for piece, mesh in sorted(placed, key=lambda both: -both[0].redundancy):
        rows = piece.edge_rows
        try:
            with np.errstate(all="ignore"):
                better = polish(piece, weights[rows], mesh.z, scale=scale, spread=errors[rows], options=SHORT)
        except SolverError:
            return None
        if not (np.isfinite(better.z).all() and np.isfinite(better.scale)):
            return None
        found[piece], scale = PieceMesh(better.z, better.scale), better.scale
    again = [(piece, found[piece]) for piece, _ in placed]
    rows, left = left_of(again, weights)
    freedom = max(sum(piece.redundancy + 1 for piece in found) - 1, 1)  # c is fitted once
    with np.errstate(all="ignore"):  # flat triangles
        squares = float(np.sum((left / errors[rows]) ** 2))
    return again if chdtrc(freedom, squares) >= CHANCE else None
