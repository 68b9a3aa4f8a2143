"""One piece from its entries to positions and scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverError
from ..topology import Piece
from .cautious import cautious_polish, count_flipped
from .conformal import conformal_map
from .cotangent import weight_roundings
from .polish import PolishedMesh, polish

_CAUTIOUS_LIMIT = 200_000
"""Most vertices for which a polish that fails is tried again with a factorisation in every step."""


@dataclass(frozen=True, eq=False)
class PieceMesh:
    """Positions of a piece in the frame in which they were found.

    Attributes
    ----------
    z : (n,) complex128
    scale : float
    notes : tuple of str
        Stages that did not converge.
    """

    z: NDArray[np.complex128]
    scale: float
    notes: tuple[str, ...] = ()


def positions(piece: Piece, weights: NDArray, *, scale: float | None, sharp: bool) -> PieceMesh:
    """Conformal solve; `sharp` where no polish follows."""
    found = conformal_map(piece, weights, scale=scale, sharp=sharp)
    notes = () if found.converged else ("the conformal solve did not converge",)
    return PieceMesh(found.z, found.scale, notes)


def refined(piece: Piece, weights: NDArray, mesh: PieceMesh, *, scale: float | None, rounding: bool) -> PieceMesh:
    """Gauss-Newton polish; where it cannot be done the mesh stays as it is, with a note."""
    try:
        found = _polished(piece, weights, mesh, scale=scale, rounding=rounding)
    except SolverError as error:
        return PieceMesh(mesh.z, mesh.scale, (*mesh.notes, f"no polish: {error}"))
    if not (np.isfinite(found.z).all() and np.isfinite(found.scale)):
        return PieceMesh(mesh.z, mesh.scale, (*mesh.notes, "the polish did not stay finite and was left out"))
    notes = () if found.converged else ("the polish did not converge",)
    return PieceMesh(found.z, found.scale, (*mesh.notes, *notes))


def _polished(piece: Piece, weights: NDArray, mesh: PieceMesh, *, scale: float | None, rounding: bool) -> PolishedMesh:
    """By the chord iteration; where it fails, by small steps from the better of start and result."""
    found = polish(piece, weights, mesh.z, scale=scale, rounding=rounding)
    finite = np.isfinite(found.z).all() and np.isfinite(found.scale)
    if (finite and found.converged and not count_flipped(piece, found.z)) or piece.n_vertices > _CAUTIOUS_LIMIT:
        return found
    spread = weight_roundings(piece, mesh.z) if rounding else np.ones(len(weights))
    start = found.z if finite and count_flipped(piece, found.z) <= count_flipped(piece, mesh.z) else mesh.z
    again = cautious_polish(piece, weights, start, spread, scale=scale)
    return again if again.residual < found.residual or not finite else found
