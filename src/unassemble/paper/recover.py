"""The paper's method from end to end: angles by the inner-outer iteration, positions from the angles."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, InputError
from ..topology import Piece
from .bfs import bfs_embedding
from .corners import corners_of
from .equations import AngleSystem, Unknowns
from .layout import least_squares_layout
from .newton import History, NewtonOptions, NewtonResult, solve
from .smoothing import coordinate_smoothing
from .starts import start_angles
from .validity import signed_angles

Embedding = Literal["layout", "bfs", "modified-bfs", "smoothing"]
EMBEDDINGS = ("layout", "bfs", "modified-bfs", "smoothing")

_ROUGH = 1e-3  # of the first residual: what the iteration reaches within a hundred inner steps


@dataclass(frozen=True)
class AngleOptions:
    """The paper's choices, and later ones.

    Attributes
    ----------
    unknowns : {"cotangents", "angles"}
    start : {"equal", "barycentric", "weighted"}
    sines : bool
        Products of sines about interior vertices (paper's references [5, 10]). Without them the Jacobian is singular
        at the solution of many meshes, all three of the paper's among them, and the angles keep few digits; and with c
        unknown there are solutions that are no meshes.
    outer : int or "auto" or None
        Add the loop equations, with this loop as the outer one; a wrong choice has no solution. "auto" adds them where
        there is a hole, and asks a rough solution without them which loop is the outer one. None is the paper's choice:
        with c unknown it leaves a family of solutions of as many dimensions as there are holes.
    embedding : {"layout", "bfs", "modified-bfs", "smoothing"}
        "smoothing" is Coordinate-Smoothing after Modified BFS-Embedding.
    newton : NewtonOptions
        Damped by default: whole steps, the paper's choice, go astray on meshes with thin triangles.
    """

    unknowns: Unknowns = "cotangents"
    start: Literal["equal", "barycentric", "weighted"] = "equal"
    sines: bool = True
    outer: int | Literal["auto"] | None = "auto"
    embedding: Embedding = "layout"
    newton: NewtonOptions = field(default_factory=lambda: NewtonOptions(tolerance=1e-10, damped=True))

    def __post_init__(self) -> None:
        if self.unknowns not in ("cotangents", "angles"):
            raise InputError(f"there are no unknowns {self.unknowns!r}; the choices are cotangents, angles")
        if self.embedding not in EMBEDDINGS:
            raise InputError(f"there is no embedding {self.embedding!r}; the choices are {', '.join(EMBEDDINGS)}")


@dataclass(frozen=True, eq=False)
class AngleRecovery:
    """Result of :func:`recover_angles`.

    Attributes
    ----------
    z : (n,) complex128
        Positions x + iy, in no particular gauge, counter-clockwise triangles as in the piece.
    angles : (m, 3) float64
        Of the corners of ``piece.triangles``, radians.
    scale : float
        c of A = cL + D; negative allowed.
    history : History
        Residual norms, inner steps and the *paper's* c (in units of its start) over the outer steps.
    converged : bool
    status : str
        One sentence.
    products : int
        With the Jacobian and with its transpose.
    warnings : tuple of str
        What a converged iteration does not show.
    """

    z: NDArray[np.complex128]
    angles: NDArray[np.float64]
    scale: float
    history: History
    converged: bool
    status: str
    products: int
    warnings: tuple[str, ...] = ()


def recover_angles(
    piece: Piece, weights: NDArray, *, scale: float | None = None, options: AngleOptions | None = None
) -> AngleRecovery:
    """Positions, angles and scale of one piece by the method of the paper.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij = c w_ij of each edge.
    scale : float, optional
        c, where it is known; otherwise it is one more unknown (section 7).
    options : AngleOptions, optional

    Raises
    ------
    GeometryError
        If all weights are zero, or the starting guess does not exist.
    InputError
        If the scale is zero or not finite.
    """
    options = options or AngleOptions()
    weights = np.asarray(weights, dtype=np.float64)
    if scale is not None and (not np.isfinite(scale) or scale == 0):
        raise InputError(f"the scale is {scale}; it must be a finite number other than zero")
    start = start_angles(piece, weights, options.start)
    unit = scale if scale is not None else starting_scale(piece, weights, start)
    system = AngleSystem(
        corners_of(piece),
        weights / unit,
        unknowns=options.unknowns,
        scale_free=scale is None,
        outer=options.outer if isinstance(options.outer, int) else None,
        sines=options.sines,
    )
    if options.outer == "auto" and piece.n_loops > 1:
        system, result = _with_loops(system, system.pack(start), options.newton)
    else:
        result = solve(system, system.pack(start), options.newton)
    angles = system.angles(result.x).reshape(-1, 3)
    factor = system.factor(result.x)
    z = embed(piece, angles, options.embedding)
    return AngleRecovery(
        z=z,
        angles=angles,
        scale=unit / factor if factor else np.inf,
        history=result.history,
        converged=result.converged,
        status=result.status,
        products=result.products,
        warnings=() if options.sines or scale is not None else (_may_be_none(piece, angles, z),),
    )


def _with_loops(system: AngleSystem, start: NDArray, options: NewtonOptions) -> tuple[AngleSystem, NewtonResult]:
    """The system with loop equations, and its solution.

    The angle sums of an outer loop and of a hole differ by 4 pi, so that angles of a digit or two tell which is which.
    """
    first = float(np.linalg.norm(system.residual(start)))
    rough = solve(system, start, replace(options, tolerance=max(options.tolerance, _ROUGH * first)))
    if not rough.converged:
        return system, rough
    sums = system.sum_over_loops(system.angles(rough.x)) / np.pi - system.corners.loop_lengths
    system = replace(system, outer=int(np.argmin(sums)))
    result = solve(system, rough.x, options)
    return system, replace(
        result, history=rough.history.continued(result.history), products=rough.products + result.products
    )


def _may_be_none(piece: Piece, angles: NDArray, z: NDArray) -> str:
    """The warning that a solution need not be a mesh, and how far it is from one."""
    apart = float(np.abs(signed_angles(z, piece.triangles) - angles).max())
    return (
        "with c unknown and without the products of sines the equations have solutions that are no meshes; the angles "
        f"of these positions differ from those found by up to {apart:.1e}"
    )


def starting_scale(piece: Piece, weights: NDArray, angles: NDArray) -> float:
    """c of A = cL + D that fits (1)-(2) best, in least squares, at given angles (3m,).

    Raises
    ------
    GeometryError
        If no scale fits better than zero.
    """
    sums = np.bincount(piece.opposite.ravel(), 1 / np.tan(angles), len(piece.edges)) / 2
    overlap = float(sums @ weights)
    if overlap == 0 or not np.isfinite(overlap):
        raise GeometryError("no scale can be guessed for this matrix: its entries do not go with the starting angles")
    return float(weights @ weights) / overlap


def embed(piece: Piece, angles: NDArray, method: str) -> NDArray[np.complex128]:
    """Positions (n,) from angles (m, 3) by one of the embeddings of section 5, or the least-squares layout."""
    if method == "layout":
        return least_squares_layout(piece, angles)
    z = bfs_embedding(piece, angles, averaging=method != "bfs")
    return coordinate_smoothing(piece, angles, z) if method == "smoothing" else z
