"""Meshes that fit but for a few entries, which no other choice of cells explains.

A cell too many or too few changes the weights of two of its sides at least, which are near each other. Near the
boundary others may do instead, as few entries hold a vertex there; but where each of the entries that do not fit
(:mod:`unassemble.planar.robust`) lies by itself, it is the entries that are wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells.doubt import Attempt, Outcome, misfits_of, unexplained, with_pieces
from ..cells.judge.labelling import even
from ..matrix import OperatorMatrix
from ..planar.cautious import CautiousOptions, count_flipped
from ..planar.cotangent import edge_weights
from ..planar.piece import PieceMesh
from ..planar.robust import RobustFit, robust_fit
from ..tolerances import ALIKE, CHANCE, SMALL
from ..topology import Numbering, Piece, Topology


def wrong_entries(
    matrix: OperatorMatrix, topology: Topology, attempt: Attempt, doubtful: NDArray[np.bool_], scale: float | None
) -> tuple[dict[Piece, PieceMesh], NDArray[np.bool_]]:
    """Look for a few wrong entries in components whose edges all lie on triangles.

    Parameters
    ----------
    matrix, topology, attempt, doubtful, scale
        As for :func:`unassemble.cells.completed`.

    Returns
    -------
    meshes : dict
        Of the pieces that have wrong entries.
    doubtful : (n,) bool
        Without the components that these settle.
    """
    own = doubtful & ~unexplained(matrix, topology)
    pieces = [piece for piece in topology.pieces if own[piece.vertices[0]]]
    meshes = {piece: attempt(piece) for piece in pieces}
    misfit = misfits_of(matrix, list(meshes.items()))
    found: dict[Piece, PieceMesh] = {}
    doubtful = doubtful.copy()
    for part, inside in with_pieces(matrix.n, matrix.edges, pieces) if pieces else ():
        other = _in_component(matrix, part, {piece: meshes[piece] for piece in inside}, misfit, scale)
        if other:
            found |= other
            doubtful[part.vertices] = False
    return found, doubtful


def _in_component(
    matrix: OperatorMatrix, part: Numbering, meshes: dict[Piece, Outcome], misfit: NDArray, scale: float | None
) -> dict[Piece, PieceMesh] | None:
    """Meshes of the pieces that do not fit, or None."""
    wrong = sorted(
        (piece for piece in meshes if (misfit[piece.edge_rows] > ALIKE).any()), key=lambda piece: piece.n_vertices
    )
    found: dict[Piece, PieceMesh] = {}
    aside = [np.empty(0, dtype=np.int64)]
    for piece in wrong:
        start = meshes[piece]
        z = start.z if isinstance(start, PieceMesh) else None
        mesh = _without_few(piece, -matrix.entries[piece.edge_rows], z, scale)
        if mesh is None:
            return None
        found[piece] = mesh
        aside += [] if mesh.aside is None else [piece.edge_rows[mesh.aside]]
        # Of all pieces together: the sides of a cell that is missing where two of them meet belong to both.
        rows = np.searchsorted(part.edge_rows, np.concatenate(aside))
        if not _apart(len(part.vertices), part.edges, part.edges[rows]):
            return None
    scales = np.array([mesh.scale for mesh in (meshes | found).values() if isinstance(mesh, PieceMesh)])
    return found if len(scales) and np.abs(scales / scales[0] - 1).max() < ALIKE else None


def _without_few(piece: Piece, weights: NDArray, z: NDArray | None, scale: float | None) -> PieceMesh | None:
    """The mesh of a piece that fits all entries but a few, or all; None where there is none."""
    if piece.n_vertices > CautiousOptions().most_vertices or not _provable(piece, 1, scale):
        return None

    fit = robust_fit(piece, weights, z, settled, scale=scale)
    if fit is None or not _provable(piece, len(fit.aside), scale, _left(piece, weights, fit)):
        return None
    if count_flipped(piece, fit.z):  # in a mesh whose other entries are right none is
        return None
    return PieceMesh(fit.z, fit.scale, aside=fit.aside if len(fit.aside) else None)


def settled(misfit: NDArray) -> bool:
    """Whether a misfit, relative to the entry and a typical one, is that of rounding, or of noise."""
    return bool((misfit <= ALIKE).all()) or (even(misfit) and float(np.sqrt(np.mean(misfit**2))) < SMALL)


def _left(piece: Piece, weights: NDArray, fit: RobustFit) -> float:
    """Root mean square of the misfit of the others, relative to the entry and a typical one."""
    size = np.abs(weights) + np.median(np.abs(weights))
    misfit = np.delete((weights - fit.scale * edge_weights(piece, fit.z)) / size, fit.aside)
    return float(np.sqrt(np.mean(misfit**2)))


def _provable(piece: Piece, aside: int, scale: float | None, left: float = ALIKE) -> bool:
    """Whether that the others fit is no coincidence, whichever of them so many entries set aside are.

    Each equation beyond the unknowns that holds to within `left` does so by chance about that often.
    """
    equations = len(piece.edges) - 2 * piece.n_vertices + 4 - (scale is None) - aside
    return bool(equations * np.log(max(left, ALIKE)) + aside * np.log(len(piece.edges)) < np.log(CHANCE))


def _apart(n: int, edges: NDArray[np.int64], some: NDArray[np.int64]) -> bool:
    """Whether no two of some edges (k, 2) share a vertex or are joined by one of all `edges`."""
    owner = np.full(n, -1)
    owner[some] = np.arange(len(some))[:, None]
    one, two = owner[edges.T]
    joined = (one >= 0) & (two >= 0) & (one != two)
    return len(np.unique(some)) == some.size and not joined.any()
