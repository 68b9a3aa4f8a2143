"""One piece from its entries to positions and scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg import Factorisation, UpperTriangle
from ..topology import Piece
from .conformal import conformal_map
from .polish import polish


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


def positions(
    piece: Piece,
    weights: NDArray,
    *,
    scale: float | None,
    sharp: bool,
    analyse: Callable[[UpperTriangle], Factorisation],
) -> PieceMesh:
    """Conformal solve; `sharp` where no polish follows."""
    found = conformal_map(piece, weights, scale=scale, sharp=sharp, analyse=analyse)
    notes = () if found.converged else ("the conformal solve did not converge",)
    return PieceMesh(found.z, found.scale, notes)


def refined(piece: Piece, weights: NDArray, mesh: PieceMesh, *, scale: float | None, rounding: bool) -> PieceMesh:
    """Gauss-Newton polish; where it cannot be done the mesh stays as it is, with a note."""
    try:
        found = polish(piece, weights, mesh.z, scale=scale, rounding=rounding)
    except SolverError as error:
        return PieceMesh(mesh.z, mesh.scale, (*mesh.notes, f"no polish: {error}"))
    if not (np.isfinite(found.z).all() and np.isfinite(found.scale)):
        return PieceMesh(mesh.z, mesh.scale, (*mesh.notes, "the polish did not stay finite and was left out"))
    notes = () if found.converged else ("the polish did not converge",)
    return PieceMesh(found.z, found.scale, (*mesh.notes, *notes))
