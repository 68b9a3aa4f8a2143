"""Boundary-Fixed-Point (paper, section 6)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import TopologyError
from ..topology import Piece
from .alignment import aligned
from .bfs import bfs_embedding
from .corners import Corners, corners_of
from .equations import AngleSystem
from .harmonic import HarmonicReduction, tube_triangles
from .layout import least_squares_layout
from .newton import NewtonOptions, solve
from .parts import MeshPart, part
from .starts import angles_of


@dataclass(frozen=True)
class FixedPointOptions:
    """Settings of :func:`boundary_fixed_point`.

    Attributes
    ----------
    tolerance : float
        Stop when no boundary vertex moves farther than this, relative to the mesh's diameter.
    max_steps : int
    loops : bool
        Add the loop equations to the tube's angle system. The tube has a hole, so that the paper's equations leave
        its shape free by one parameter at least.
    embedding : {"modified-bfs", "layout"}
        The paper's, or the least-squares layout.
    newton : NewtonOptions
        For the tube.
    """

    tolerance: float = 1e-8
    max_steps: int = 50
    loops: bool = False
    embedding: str = "modified-bfs"
    newton: NewtonOptions = field(default_factory=lambda: NewtonOptions(tolerance=1e-9, max_products=2_000))


@dataclass(frozen=True, eq=False)
class FixedPointResult:
    """Result of :func:`boundary_fixed_point`.

    Attributes
    ----------
    z : (n,) complex128
    boundaries : (k + 1, n_B) complex128
        The boundary at the start and after each step.
    moves : (k,) float64
        Largest movement of a boundary vertex in each step, relative to the diameter.
    residuals : (k,) float64
        What was left of the tube's angle equations in each step. They seldom have a solution: the tube is a ring, its
        square Jacobian is singular at the solution, and inner cotangents that are a little off lie outside its range.
    converged : bool
    status : str
    products : int
        With the tube's Jacobians and their transposes.
    """

    z: NDArray[np.complex128]
    boundaries: NDArray[np.complex128]
    moves: NDArray[np.float64]
    residuals: NDArray[np.float64]
    converged: bool
    status: str
    products: int


def boundary_fixed_point(
    piece: Piece, weights: NDArray, boundary_values: NDArray, options: FixedPointOptions | None = None
) -> FixedPointResult:
    """Alternate between interior (6) and tube (1)-(4) until the boundary rests.

    Parameters
    ----------
    piece : Piece
        Without holes, and with elements inside the tube.
    weights : (e,) float64
        w_ij; the scale must be known.
    boundary_values : (n_B,) complex128
        First guess at the boundary vertices, in increasing order of vertices.

    Raises
    ------
    TopologyError
        If the piece has a hole, or is all tube, or its tube is no ring.
    """
    options = options or FixedPointOptions()
    tube = ring(piece)
    harmonic, corners = HarmonicReduction(piece, weights), corners_of(tube.piece)
    place = np.searchsorted(tube.piece.vertices, harmonic.boundary)
    trace, moves, residuals, products = [np.asarray(boundary_values, np.complex128)], [], [], 0
    z, status = harmonic.extend(trace[0]), None
    angles = angles_of(z, piece.triangles).ravel()[tube.corners]
    while status is None:
        system = _tube_system(piece, tube, corners, weights, z, options)
        solved = solve(system, system.pack(np.clip(angles, 1e-3, np.pi - 1e-3)), options.newton)
        products += solved.products
        residuals.append(float(solved.history.residuals.min()))
        angles = system.angles(solved.x)
        trace.append(aligned(_embed(tube, angles, options)[place], trace[-1]))
        moves.append(float(np.abs(trace[-1] - trace[-2]).max() / abs(complex(np.ptp(z.real), np.ptp(z.imag)))))
        z = harmonic.extend(trace[-1])
        status = _verdict(moves, solved.converged, options)
    converged = status.startswith("converged")
    return FixedPointResult(z, np.array(trace), np.array(moves), np.array(residuals), converged, status, products)


def ring(piece: Piece) -> MeshPart:
    """The tube of a piece without holes, which has to be a ring around other elements."""
    if piece.n_loops != 1:
        raise TopologyError(
            f"the piece has {piece.n_loops - 1} holes: where their tubes stand in relation to each other is not known; "
            "take the whole angle system"
        )
    mask = tube_triangles(piece)
    tube = part(piece, mask)
    if mask.all() or tube.piece.n_loops != 2:
        raise TopologyError("the tube is no ring around other elements: the mesh is too small for the boundary method")
    return tube


def _tube_system(
    piece: Piece, tube: MeshPart, corners: Corners, weights: NDArray, z: NDArray, options: FixedPointOptions
) -> AngleSystem:
    """Steps 2 and 3: the tube's own matrix, with cotangents from inside taken off its inner edges."""
    cotangents = 1 / np.tan(np.clip(angles_of(z, piece.triangles).ravel(), 1e-9, np.pi - 1e-9))
    cotangents[tube.corners] = 0
    from_inside = np.bincount(piece.opposite.ravel(), cotangents, len(piece.edges))
    own = (weights - from_inside / 2)[tube.piece.edge_rows]
    outer = None
    if options.loops:
        first = tube.piece.vertices[tube.piece.boundary[tube.piece.loop_offsets[:-1], 0]]
        outer = int(np.flatnonzero(np.isin(first, piece.boundary))[0])
    return AngleSystem(corners, own, outer=outer)


def _embed(tube: MeshPart, angles: NDArray, options: FixedPointOptions) -> NDArray:
    if options.embedding == "layout":
        return least_squares_layout(tube.piece, angles)
    return bfs_embedding(tube.piece, angles, averaging=True)


def _verdict(moves: list[float], tube_solved: bool, options: FixedPointOptions) -> str | None:
    if not np.isfinite(moves[-1]):
        return f"diverged in step {len(moves)}; try a better first guess, or the whole angle system"
    if moves[-1] <= options.tolerance and tube_solved:
        return f"converged: the boundary moved by {moves[-1]:.1e} in step {len(moves)}"
    if moves[-1] <= options.tolerance:
        return f"stalled in step {len(moves)}: the tube's angle equations have no solution near; try a better guess"
    if len(moves) >= options.max_steps:
        return f"stopped: the boundary still moved by {moves[-1]:.1e} in step {len(moves)}, the last one allowed"
    return None
