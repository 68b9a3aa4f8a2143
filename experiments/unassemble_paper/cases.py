"""What the experiments start from: a mesh, its matrix, what recognition makes of it, and the truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from unassemble.paper import (
    AngleSystem,
    Corners,
    NewtonOptions,
    NewtonResult,
    Unknowns,
    angles_of,
    corners_of,
    solve,
    start_angles,
)
from unassemble.topology import Piece, surfaces

from . import meshes


class DirectAnswer(Protocol):
    """What a direct method has to say: positions (n,) complex, c, and what it cost."""

    @property
    def z(self) -> NDArray[np.complex128]:
        """Positions."""

    @property
    def scale(self) -> float:
        """The factor c of A = cL + D."""

    @property
    def factorisations(self) -> int:
        """Sparse factorisations."""

    @property
    def solves(self) -> int:
        """Triangular solves with them."""


Direct = Callable[[Piece, NDArray], DirectAnswer]
"""A method that finds positions and c of a piece from its weights. It is passed in: this room knows no other."""


@dataclass(frozen=True, eq=False)
class Case:
    """One mesh of the paper.

    Attributes
    ----------
    name : str
    figure : int
    piece : Piece
    corners : Corners
    weights : (e,) float64
    truth : (n,) complex128
        The mesh's own points, turned over where the piece is oriented clockwise.
    angles : (3m,) float64
        The exact angles.
    """

    name: str
    figure: int
    piece: Piece
    corners: Corners
    weights: NDArray[np.float64]
    truth: NDArray[np.complex128]
    angles: NDArray[np.float64]

    def system(self, *, scale_free: bool = True, sines: bool = False, unknowns: Unknowns = "cotangents") -> AngleSystem:
        """The angle equations; by default the paper's: cotangents, with c."""
        return AngleSystem(self.corners, self.weights, unknowns=unknowns, scale_free=scale_free, sines=sines)

    def run(
        self,
        forcing: str | float,
        *,
        start: str = "equal",
        tolerance: float = 1e-6,
        max_products: int = 60_000,
        scale_free: bool = True,
        sines: bool = False,
        unknowns: Unknowns = "cotangents",
        inner: str = "cgls",
        damped: bool = False,
    ) -> Run:
        """Solve the angle equations, from c = 1."""
        system = self.system(scale_free=scale_free, sines=sines, unknowns=unknowns)
        options = NewtonOptions(forcing, inner, tolerance=tolerance, max_products=max_products, damped=damped)  # type: ignore[arg-type]
        result = solve(system, system.pack(start_angles(self.piece, self.weights, start)), options)
        angles = system.angles(result.x)
        return Run(result, angles, float(np.abs(angles - self.angles).max()))


@dataclass(frozen=True, eq=False)
class Run:
    """A solved (or unsolved) angle system: `angle_error` is the largest error of an angle, in radians."""

    result: NewtonResult
    angles: NDArray[np.float64]
    angle_error: float

    @property
    def outer(self) -> int:
        """Outer steps taken."""
        return len(self.result.history.residuals) - 1

    @property
    def inner(self) -> int:
        """Inner steps taken."""
        return int(self.result.history.inner_steps[-1])

    @property
    def residual(self) -> float:
        """Least residual norm."""
        return float(np.nanmin(self.result.history.residuals))


def case(name: str) -> Case:
    """The mesh of Figure 4 ("square"), 5 ("ellipse") or 6 ("rocket")."""
    figure, mesh = {"square": (4, meshes.square), "ellipse": (5, meshes.ellipse), "rocket": (6, meshes.rocket)}[name]
    return case_of(mesh(), name, figure)


def case_of(mesh: meshes.Mesh, name: str, figure: int = 0) -> Case:
    """Any mesh of one piece."""
    edges, weights = meshes.stiffness(mesh)
    (piece,) = surfaces(len(mesh.points), edges).pieces
    z: NDArray[np.complex128] = (mesh.points @ np.array([1, 1j]))[piece.vertices]
    p = z[piece.triangles]
    if ((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag.sum() < 0:
        z = z.conj()
    angles = angles_of(z, piece.triangles).ravel()
    return Case(name, figure, piece, corners_of(piece), weights[piece.edge_rows], z, angles)


def cases() -> tuple[Case, ...]:
    """All three, in the paper's order."""
    return tuple(case(name) for name in ("square", "ellipse", "rocket"))
