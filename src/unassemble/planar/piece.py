"""One piece from its entries to positions and scale."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..tolerances import LAST_DIGITS
from ..topology import Piece
from ..topology.surface import Together
from .conformal import conformal_map
from .cotangent import corner_sides, cotangent, edge_weights
from .polish import (
    CAREFUL,
    MOST_CAREFUL,
    Model,
    PolishedMesh,
    count_flipped,
    errors_of_one_size,
    model_of,
    polish,
)


@dataclass(frozen=True, eq=False)
class PieceMesh:
    """Positions of a piece in the frame in which they were found."""

    z: NDArray[np.complex128]  # (n,)
    scale: float
    notes: tuple[str, ...] = ()  # stages that did not converge
    # (e,) standard deviations of the entries' errors, up to a common factor, for which z is the least-squares solution;
    # all equal by default
    spread: NDArray[np.float64] | None = None
    # about the error of z relative to its extent, where a polish came to no end for reasons of conditioning
    doubt: float = 0.0

    @property
    def nodes(self) -> NDArray[np.complex128]:
        """Positions of all nodes."""
        return self.z


def positions(piece: Piece, weights: NDArray, *, scale: float | None, sharp: bool) -> PieceMesh:
    """Conformal solve; `sharp` where no polish follows."""
    found = conformal_map(piece, weights, scale=scale, sharp=sharp)
    return PieceMesh(found.z, found.scale, () if found.converged else ("the conformal solve did not converge",))


def left_by_all(
    placed: Sequence[tuple[Piece, PieceMesh]], weights: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Rows of the edges of several pieces, one after the other, and what these leave of their weights.

    Not finite at flat triangles. `weights` (edges of the whole graph,): -A_ij of each.
    """
    union = Together([piece for piece, _ in placed])
    cotangents = cotangent(*corner_sides(union.triangles, np.concatenate([mesh.z for _, mesh in placed])))
    w = np.bincount(union.opposite.ravel(), cotangents.ravel(), len(union.edge_rows)) / 2
    scales = np.repeat([mesh.scale for _, mesh in placed], [len(piece.edges) for piece, _ in placed])
    with np.errstate(all="ignore"):
        return union.edge_rows, np.asarray(weights[union.edge_rows] - scales * w)


def left_by_map(piece: Piece, weights: NDArray, scale: float | None = None) -> tuple[float, NDArray[np.float64]] | None:
    """c, and what the conformal map leaves of weights over c, (e,); None where there is no map."""
    try:
        mesh = positions(piece, weights, scale=scale, sharp=False)
    except (GeometryError, SolverError):
        return None
    with np.errstate(all="ignore"):  # flat triangles
        return mesh.scale, weights / mesh.scale - edge_weights(piece, mesh.z)


Placed = TypeVar("Placed", bound=PieceMesh)


def refined(
    drawn: Piece | Model,
    weights: NDArray,
    mesh: Placed,
    *,
    scale: float | None,
    rounding: bool,
    noise: NDArray[np.float64] | None = None,
) -> Placed:
    """Gauss-Newton polish; where it cannot be done the mesh stays as it is, with a note.

    `noise`, (e,), are standard deviations of the entries' errors, up to a common factor, all equal by default. With
    `rounding`, errors are taken to be those of assembly in floating-point arithmetic, unless the misfit is beyond that
    and more likely to be such noise. Without it the noise is known, and tested.
    """
    model = model_of(drawn)
    noise = None if noise is None or (noise == 1).all() else noise
    spread = model.roundings(mesh.z) if rounding else noise
    try:
        found = _polished(model, weights, mesh.z, scale, spread)
        misfit = weights / found.scale - model.weights(found.z)
        if rounding and spread is not None and errors_of_one_size(misfit, spread):
            spread = noise
            found = _polished(model, weights, found.z, scale, spread)
    except SolverError as error:
        return replace(mesh, notes=(*mesh.notes, f"no polish: {error}"))
    notes, doubt = mesh.notes, 0.0
    if not found.converged:
        doubt = found.last_step
        notes += (f"the polish did not converge: its last step moved points by {doubt:.0e} of the size",)
    return replace(mesh, z=found.z, scale=found.scale, notes=notes, spread=spread, doubt=doubt)


def _polished(
    model: Model, weights: NDArray, start: NDArray, scale: float | None, spread: NDArray | None
) -> PolishedMesh:
    """By the chord iteration; where it comes to no end, by small steps from the better of start and result.

    Rounding in the normal equations of long thin pieces is one reason for that.
    """
    found = polish(model, weights, start, scale=scale, spread=spread)
    finite = np.isfinite(found.z).all() and np.isfinite(found.scale)
    flipped = count_flipped(model, found.z) if finite else np.inf
    if (found.converged and not flipped) or model.n > MOST_CAREFUL:
        return found
    nearest = found.z if flipped <= count_flipped(model, start) else start
    again = polish(model, weights, nearest, scale=scale, spread=spread, options=CAREFUL)
    return again if again.residual < found.residual or not finite else found


def collapsed(piece: Piece, z: NDArray) -> str:
    """Why positions are no mesh at all: not finite, points that coincide, all in line; empty where they are one."""
    if not np.isfinite(z).all():
        return "positions are not finite"
    d = z - z.mean()
    shortest = np.abs(z[piece.edges[:, 0]] - z[piece.edges[:, 1]]).min()
    if not shortest > LAST_DIGITS * np.abs(d).max():
        return "points coincide"
    across = (np.exp(-0.5j * np.angle((d * d).sum())) * d).imag
    return "all points lie in a line" if np.abs(across).max() <= LAST_DIGITS * np.abs(d).max() else ""
