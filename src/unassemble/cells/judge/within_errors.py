"""Readings of entries with errors of known size: what of a misfit these do not explain."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from ...errors import SolverError
from ...matrix.operator import row_sizes
from ...planar.piece import PieceMesh, left_by_all
from ...planar.polish import SHORT, polish
from ...tolerances import CHANCE, LITTLE, MAGNIFIED, SIGMAS
from ...topology import Piece

Placed = list[tuple[Piece, PieceMesh]]


def misfits(
    n: int, edges: NDArray, weights: NDArray, solved: Sequence[tuple[Piece, object]], errors: NDArray | None = None
) -> NDArray[np.float64]:
    """(e,) |c w - a| relative to the smaller of both rows' largest entries, at most 1; 1 on edges of no placed piece.

    Less what `errors` (e,) explain, if they are given.
    """
    misfit = np.where(weights != 0, 1.0, 0.0)
    placed = [(piece, mesh) for piece, mesh in solved if isinstance(mesh, PieceMesh)]
    if not placed:
        return misfit
    rows, left = left_by_all(placed, weights)
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
        found[piece], scale = PieceMesh(better.z, better.scale), better.scale
    again = [(piece, found[piece]) for piece, _ in placed]
    rows, left = left_by_all(again, weights)
    freedom = max(sum(piece.redundancy + 1 for piece in found) - 1, 1)  # c is fitted once
    with np.errstate(all="ignore"):  # flat triangles
        squares = float(np.sum((left / errors[rows]) ** 2))
    return again if chdtrc(freedom, squares) >= CHANCE else None
