"""Pieces that meet in single vertices: join them there."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, coo_array
from scipy.sparse.linalg import lsqr

from ..tolerances import ALIKE, ROUNDED
from ..topology import Topology
from ..topology.numbering import connected
from .cotangent import areas

_DENSE = 100  # pieces; above, sparse linear algebra is faster, and none is turned over by itself


def join(topology: Topology, positions: list[NDArray], known: NDArray | None = None) -> list[NDArray]:
    """Move pieces by similarities close to translations so that shared vertices coincide.

    With turn t_p and shift s_p of piece p, t_p z_p + s_p = t_q z_q + s_q at every shared vertex; of all
    solutions the one nearest to t = 1. Where the pieces form a tree that is t = 1 exactly, and each keeps its own
    frame; where they close rings the matrix itself fixes, or restricts, their relative turns and mirror images.

    `positions`: (n_p,) complex of each piece in its own frame; `known` (pieces,): known positions in each. Pieces with
    two or more stay where they are; of others joined to none of those the one with the most, or the first, does.
    """
    if not len(topology.hinges):
        return positions
    n = len(positions)
    known = np.zeros(n, dtype=np.int64) if known is None else known
    group = groups(topology)
    held = _held(group, known)
    stiff = rings(topology) <= 0 and np.count_nonzero(held) == group.max() + 1
    positions = _matching_images(topology, positions, held, ALIKE)
    joined, _ = _joined(topology, positions, held, stiff=stiff)
    # Once more from there: turns and shifts of small pieces in a large mesh differ in size by many digits.
    return _joined(topology, joined, held, stiff=stiff)[0]


def gap(topology: Topology, positions: list[NDArray], closed: float) -> float:
    """How far apart the pieces stay at shared vertices when they are joined, relative to the largest piece.

    Rings count as closed below `closed`, where no other images are tried.
    """
    if rings(topology) <= 0:
        return 0.0
    held = _held(groups(topology), np.zeros(len(positions), dtype=np.int64))
    return _joined(topology, _matching_images(topology, positions, held, closed), held)[1]


def _matching_images(
    topology: Topology, positions: list[NDArray], held: NDArray[np.bool_], closed: float
) -> list[NDArray]:
    """Mirror images of pieces in rings that let these close.

    Those of one embedding; else one piece after the other is turned over as long as that lowers the gap.
    """
    if rings(topology) <= 0:
        return positions
    best = _joined(topology, positions, held)[1]
    if best > closed:
        # Triangles of all pieces the same way round, as those of one embedding are; held pieces stay as they are.
        pairs = zip(topology.pieces, positions, strict=True)
        turned_over = np.array([float(areas(piece, z).sum()) < 0 for piece, z in pairs])
        group = groups(topology)
        away = np.isin(group, group[held & turned_over]) ^ turned_over
        drawn = [np.conj(z) if over else z for z, over in zip(positions, away, strict=True)]
        left = _joined(topology, drawn, held)[1]
        positions, best = (drawn, left) if left <= closed else (positions, best)
    if len(positions) > _DENSE:
        return positions
    while best > closed:
        trials = []
        for piece in np.flatnonzero(~held).tolist():
            turned = [np.conj(z) if p == piece else z for p, z in enumerate(positions)]
            trials.append((_joined(topology, turned, held)[1], turned))
        lowest, turned = min(trials, key=lambda trial: trial[0], default=(np.inf, positions))
        if not lowest < 0.999 * best:
            break
        best, positions = lowest, turned
    return positions


def rings(topology: Topology) -> int:
    """Independent rings of pieces."""
    shared = sum(np.count_nonzero(topology.multiplicity[piece.vertices] > 1) for piece in topology.pieces)
    return int(shared) - len(topology.hinges) - (len(topology.pieces) - len(np.unique(groups(topology))))


def _joined(
    topology: Topology, positions: list[NDArray], held: NDArray[np.bool_], *, stiff: bool = False
) -> tuple[list[NDArray], float]:
    """Least-squares similarities, or translations if `stiff`, and the largest distance left at a shared vertex.

    Pieces that shrink to points meet in any image: they leave as much as there is.
    """
    n = len(positions)
    rows, columns, values, rhs = _equations(topology, positions)
    # Unknowns are t - 1 and s; the least-norm solution keeps turns near 1. Shifts are scaled to matter little.
    size = np.array([np.abs(z).max() for z in positions])
    extent = float(size.max())
    weight = np.r_[np.where(held | stiff, 0.0, 1.0), np.where(held, 0.0, 1e3 * extent)]
    system = coo_array((values * weight[columns], (rows, columns)), shape=(len(rhs), 2 * n)).tocsr()
    if n <= _DENSE:
        solution = np.linalg.lstsq(system.toarray(), rhs, rcond=ROUNDED)[0]
    else:  # of all solutions that with the least norm, as well
        real = block_array([[system.real, -system.imag], [system.imag, system.real]], format="csr")
        exact = {"atol": 0.0, "btol": 0.0, "conlim": 0.0, "iter_lim": 50 * real.shape[1]}
        solution = lsqr(real, np.append(rhs.real, rhs.imag), **exact)[0].reshape(2, -1).T @ [1, 1j]
    turn, shift = 1 + (weight * solution)[:n], (weight * solution)[n:]
    left = float(np.abs(system @ solution - rhs).max(initial=0.0) / extent)
    if (np.abs(turn) * size <= ALIKE * extent).any():
        left = max(left, 1.0)
    return [turn[p] * z + shift[p] for p, z in enumerate(positions)], left


def _held(group: NDArray, known: NDArray) -> NDArray[np.bool_]:
    """Pieces that stay where they are."""
    held = known >= 2
    order = np.lexsort((np.arange(len(group)), -known, group))
    best = order[np.flatnonzero(np.diff(group[order], prepend=-1))]
    settled = np.bincount(group, held, len(group))[group] > 0
    held[best[~settled[best]]] = True
    return held


def groups(topology: Topology) -> NDArray[np.int64]:
    """(number of pieces,) label: pieces joined by hinges share one."""
    n = len(topology.pieces)
    piece = np.repeat(np.arange(n), [p.n_vertices for p in topology.pieces])
    vertex = np.concatenate([p.vertices for p in topology.pieces])
    return connected(n + topology.n_vertices, piece, n + vertex)[1][:n]


def _equations(topology: Topology, positions: list[NDArray]) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """One equation for each piece at a hinge after the first: (t_p - 1) z_p + s_p - ... = z_q - z_p."""
    n = len(positions)
    shared = [np.flatnonzero(topology.multiplicity[p.vertices] > 1) for p in topology.pieces]
    piece = np.repeat(np.arange(n), [len(s) for s in shared])
    vertex = np.concatenate([p.vertices[s] for p, s in zip(topology.pieces, shared, strict=True)])
    at = np.concatenate([z[s] for z, s in zip(positions, shared, strict=True)])
    order = np.lexsort((piece, vertex))
    piece, vertex, at = piece[order], vertex[order], at[order]
    p = np.flatnonzero(vertex[1:] == vertex[:-1])
    q = p + 1
    one = np.ones(len(p), dtype=np.complex128)
    columns = np.r_[piece[p], piece[q], n + piece[p], n + piece[q]]
    return np.tile(np.arange(len(p)), 4), columns, np.r_[at[p], -at[q], one, -one], at[q] - at[p]
