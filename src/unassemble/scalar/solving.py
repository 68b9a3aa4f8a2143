"""Every piece from its entries to positions; pieces that fail do not stop the others."""

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import Outcome, completed, in_doubt
from ..clock import Clock
from ..errors import GeometryError, RecoveryError, SolverError
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..planar.hinges import groups
from ..planar.piece import PieceMesh, collapsed, left_by_all, positions, refined
from ..planar.polish import Model, PolishOptions, model_of
from ..tolerances import NOISY
from ..topology import Piece, Topology
from ..words import sentences
from .noise import Noise, with_vanished
from .placement import Placement


@dataclass(frozen=True)
class Task:
    """What is asked of a scalar matrix, and known of it."""

    options: ScalarOptions
    placement: Placement
    noise: Noise | None  # errors of the entries, where they are not those of assembly

    @property
    def scale(self) -> float | None:
        """The factor of the Laplacian, where c is known."""
        return None if self.options.scale is None else self.options.scale * self.placement.stretch

    @property
    def free_scale(self) -> bool:
        """Whether c is fitted."""
        return self.options.scale is None


@dataclass(frozen=True, eq=False)
class Solved:
    """Positions and scale of each piece, in no particular frame."""

    stored: OperatorMatrix  # as given
    matrix: OperatorMatrix  # with entries that had vanished as zeros
    # of that matrix, without the pieces that have no positions; these are listed in its ``failures``
    topology: Topology
    meshes: Sequence[PieceMesh]
    models: Sequence[Model]  # their weights as functions of positions
    spare: NDArray[np.int64]  # (pieces,) entries of each less unknowns, c among these
    task: Task
    noise: Noise | None  # without that of rounding, if the misfit is far beyond it

    @property
    def linear(self) -> bool:
        """Whether the cells are linear triangles; those of other elements are sets of rows."""
        return self.topology.method != "cliques"

    @property
    def fits(self) -> Iterator[tuple[NDArray, Model, PieceMesh]]:
        """Of each piece its weights, -A_ij, as given, and as functions of positions, and the mesh."""
        weights = [-self.matrix.entries[piece.edge_rows] for piece in self.topology.pieces]
        return zip(weights, self.models, self.meshes, strict=True)

    @property
    def scales(self) -> NDArray[np.float64]:
        """(pieces,) c of each, the factor of the Laplacian."""
        return np.array([mesh.scale for mesh in self.meshes])

    @property
    def freedom(self) -> int:
        """Entries less unknowns: coordinates of each piece, and each c that was fitted."""
        lead = leaders(self.topology, self.spare)
        fitted = int(np.sum((lead == np.arange(len(lead))) | (self.scales != self.scales[lead])))
        return int(self.spare.sum()) + len(lead) - (fitted if self.task.free_scale else 0)


def leaders(topology: Topology, spare: NDArray[np.int64]) -> NDArray[np.int64]:
    """(pieces,) of those that hang together by vertices the one that tells c best, with the most entries to spare."""
    n = len(topology.pieces)
    if not len(topology.hinges):
        return np.arange(n)
    group = groups(topology)
    order = np.lexsort((-np.arange(n), spare, group))
    return np.asarray(order[np.searchsorted(group[order], group, side="right") - 1])


def solve(topology: Topology, matrix: OperatorMatrix, clock: Clock, task: Task) -> Solved:
    """Positions and scale of each piece; raises RecoveryError if no piece has any."""
    stored, method, refine, scale, noise = matrix, task.options.method, task.options.polished, task.scale, task.noise

    @cache
    def start(piece: Piece) -> Outcome:
        sharp = not refine or piece.n_vertices > PolishOptions().most_vertices
        try:
            return _start(piece, -matrix.entries[piece.edge_rows], method, scale, sharp=sharp)
        except (GeometryError, SolverError) as error:
            return error

    with clock(method):
        doubtful = in_doubt(matrix, topology, start, scale, noise.sigma if noise and not noise.digits else None)
    if doubtful.any():
        with clock("faces"), blas_threads(1):  # hundreds of small readings
            matrix, topology, outcomes = completed(matrix, topology, start, doubtful, scale)
            # The search leaves c free in its solves, stops early and knows one method, which is polished.
            if scale is not None or not refine:
                outcomes = [start(piece) for piece in topology.pieces]
    else:
        outcomes = [start(piece) for piece in topology.pieces]
    topology, meshes = _successes(topology, outcomes)
    with clock("polish") if refine else nullcontext():
        starts = meshes
        meshes = _polished(topology, matrix, starts, scale, noise) if refine else starts
        if noise and noise.digits:
            rows, left = left_by_all(list(zip(topology.pieces, meshes, strict=True)), -matrix.entries)
            with np.errstate(all="ignore"):  # flat triangles
                rounding = np.sqrt(np.mean((left / with_vanished(topology, noise)[rows] / noise.sigma) ** 2)) <= NOISY
            if not rounding:  # sizes that errors of rounding have are no guide to others
                noise = None
                meshes = _polished(topology, matrix, starts, scale, noise) if refine else starts
        whys = [collapsed(piece, mesh.z) for piece, mesh in zip(topology.pieces, meshes, strict=True)]
        sound: list[Outcome] = [
            GeometryError(sentences([f"no mesh fits, and {why} in the nearest one", *mesh.notes])) if why else mesh
            for why, mesh in zip(whys, meshes, strict=True)
        ]
        topology, meshes = _successes(topology, sound)
    return Solved(stored, matrix, topology, meshes, list(map(model_of, topology.pieces)), _spare(topology), task, noise)


def _spare(topology: Topology) -> NDArray[np.int64]:
    return np.array([piece.redundancy for piece in topology.pieces])


def _polished(
    topology: Topology, matrix: OperatorMatrix, meshes: list[PieceMesh], scale: float | None, noise: Noise | None
) -> list[PieceMesh]:
    """Each piece by itself; under known noise those that share vertices with the c of the one that tells it best."""
    errors = with_vanished(topology, noise)

    def polished(p: int, scale: float | None) -> PieceMesh:
        piece = topology.pieces[p]
        weights, own = -matrix.entries[piece.edge_rows], errors[piece.edge_rows]
        return refined(piece, weights, meshes[p], scale=scale, rounding=noise is None, noise=own)

    lead = leaders(topology, _spare(topology)) if noise else np.arange(len(meshes))
    first = {p: polished(p, scale) for p in np.unique(lead).tolist()}
    return [first.get(p) or polished(p, scale or first[int(lead[p])].scale) for p in range(len(meshes))]


def _successes(topology: Topology, outcomes: list[Outcome]) -> tuple[Topology, list[PieceMesh]]:
    """Pieces that have positions; an error where there are none."""
    meshes = [mesh for mesh in outcomes if isinstance(mesh, PieceMesh)]
    errors: list[RecoveryError] = [
        type(error)(f"in the piece of row {piece.vertices.min()}: {error}")
        for piece, error in zip(topology.pieces, outcomes, strict=True)
        if not isinstance(error, PieceMesh)
    ]
    if not meshes:
        raise errors[0] if errors else GeometryError("the cycles of three edges form no mesh")
    if errors:
        pieces = [p for p, mesh in zip(topology.pieces, outcomes, strict=True) if isinstance(mesh, PieceMesh)]
        topology = replace(topology, pieces=tuple(pieces), failures=(*topology.failures, *map(str, errors)))
    return topology, meshes


def _start(piece: Piece, weights: NDArray, method: str, scale: float | None, *, sharp: bool) -> PieceMesh:
    """By the conformal map, or by the method of the 2002 paper, with the constraint of its references [5, 10]."""
    if method != "angles":
        return positions(piece, weights, scale=scale, sharp=sharp)
    from ..paper import recover_angles

    found = recover_angles(piece, weights, scale=scale)
    return PieceMesh(found.z, found.scale, () if found.converged else (f"angle iteration {found.status}",))
