"""Every piece from its entries to positions; pieces that fail do not stop the others."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace

from numpy.typing import NDArray

from .errors import GeometryError, SolverError
from .linalg import Factorisation, UpperTriangle, factorisation
from .matrix import OperatorMatrix
from .planar.piece import PieceMesh, positions, refined
from .topology import Piece, Topology

Clock = Callable[[str], AbstractContextManager[None]]


def solve(
    topology: Topology,
    matrix: OperatorMatrix,
    clock: Clock,
    *,
    method: str,
    scale: float | None,
    refine: bool,
    rounding: bool,
    analyse: Callable[[UpperTriangle], Factorisation] = factorisation,
) -> tuple[Topology, list[PieceMesh]]:
    """Positions and scale of each piece, in no particular frame; `analyse` as for the conformal map.

    Returns
    -------
    topology : Topology
        Without the pieces that have no positions; these are listed in its ``failures``.
    meshes : list of PieceMesh

    Raises
    ------
    GeometryError, SolverError
        If no piece has positions.
    """
    solved: list[tuple[Piece, PieceMesh]] = []
    failures: list[GeometryError | SolverError] = []
    with clock(method):
        for piece in topology.pieces:
            try:
                weights = -matrix.entries[piece.edge_rows]
                solved.append((piece, _start(piece, weights, method, scale, sharp=not refine, analyse=analyse)))
            except (GeometryError, SolverError) as error:
                failures.append(type(error)(f"in the piece of row {piece.vertices.min()}: {error}"))
    if not solved:
        raise failures[0]
    if failures:
        topology = replace(
            topology,
            pieces=tuple(piece for piece, _ in solved),
            failures=(*topology.failures, *map(str, failures)),
        )
    meshes = [mesh for _, mesh in solved]
    if refine:
        with clock("polish"):
            meshes = [
                refined(piece, -matrix.entries[piece.edge_rows], mesh, scale=scale, rounding=rounding)
                for piece, mesh in solved
            ]
    return topology, meshes


def _start(
    piece: Piece,
    weights: NDArray,
    method: str,
    scale: float | None,
    *,
    sharp: bool,
    analyse: Callable[[UpperTriangle], Factorisation],
) -> PieceMesh:
    if method == "angles":
        return _by_angles(piece, weights, scale)
    return positions(piece, weights, scale=scale, sharp=sharp, analyse=analyse)


def _by_angles(piece: Piece, weights: NDArray, scale: float | None) -> PieceMesh:
    """The method of the 2002 paper."""
    from .paper import recover_angles

    found = recover_angles(piece, weights, scale=scale)
    return PieceMesh(found.z, found.scale, () if found.converged else (f"angle iteration {found.status}",))
