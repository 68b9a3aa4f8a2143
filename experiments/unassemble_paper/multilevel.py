"""A multilevel embedding, which section 8 of the paper calls promising: patches of triangles, joined two by two.

Every triangle is a patch with the shape that its angles say. On each level neighbouring patches are matched, and of
each pair one is moved onto the other by the similarity that fits their common vertices best. Between any two triangles
lie as many joints as there are levels, and not as many as there are triangles on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unassemble.topology import Piece


@dataclass(frozen=True, eq=False)
class _Patch:
    """Vertices (k,) in order, where they are (k,) complex, and how many triangles have put each there (k,)."""

    vertices: NDArray[np.int64]
    z: NDArray[np.complex128]
    weight: NDArray[np.float64]


def multilevel_embedding(piece: Piece, angles: NDArray) -> tuple[NDArray[np.complex128], int]:
    """(n,) positions from angles (3m,), and the number of levels."""
    patches = _triangles(piece, angles)
    one, two = piece.facing[piece.facing[:, 1] >= 0].T // 3
    label, levels = np.arange(len(patches)), 0
    while len(patches) > 1:
        matched = _matching(np.column_stack([label[one], label[two]]), [len(p.vertices) for p in patches])
        partner = np.arange(len(patches))
        partner[matched[:, 1]] = matched[:, 0]
        kept, new = np.unique(partner, return_inverse=True)
        joined = {int(a): _joined(patches[a], patches[b]) for a, b in matched}
        patches = [joined.get(int(k), patches[k]) for k in kept]
        label, levels = new[label], levels + 1
    return patches[0].z, levels


def _triangles(piece: Piece, angles: NDArray) -> list[_Patch]:
    phi = np.asarray(angles).reshape(-1, 3)
    apex = np.sin(phi[:, 1]) / np.sin(phi[:, 2]) * np.exp(1j * phi[:, 0])
    z = np.column_stack([np.zeros(len(phi)), np.ones(len(phi)), apex])
    order = np.argsort(piece.triangles, axis=1)
    return [_Patch(t[o], y[o], np.ones(3)) for t, y, o in zip(piece.triangles, z, order, strict=True)]


def _matching(neighbours: NDArray, sizes: list[int]) -> NDArray[np.int64]:
    """Pairs of patches with an edge in common, each patch in one pair at most: small ones first, then long seams."""
    apart = neighbours[neighbours[:, 0] != neighbours[:, 1]]
    pairs, seams = np.unique(np.sort(apart, axis=1), axis=0, return_counts=True)
    total = np.asarray(sizes)[pairs].sum(axis=1)
    free, chosen = np.ones(len(sizes), dtype=bool), []
    for a, b in pairs[np.lexsort((-seams, total))]:
        if free[a] and free[b]:
            free[[a, b]] = False
            chosen.append((a, b))
    return np.array(chosen, dtype=np.int64)


def _joined(fixed: _Patch, moved: _Patch) -> _Patch:
    """Both in one frame; common vertices at the mean of their places, by weight."""
    _, i, j = np.intersect1d(fixed.vertices, moved.vertices, return_indices=True)
    target, source = fixed.z[i] - fixed.z[i].mean(), moved.z[j] - moved.z[j].mean()
    turn = np.vdot(source, target) / np.vdot(source, source)
    placed = fixed.z[i].mean() + turn * (moved.z - moved.z[j].mean())
    vertices, place = np.unique(np.r_[fixed.vertices, moved.vertices], return_inverse=True)
    weight = np.bincount(place, np.r_[fixed.weight, moved.weight]).astype(np.float64)
    weighted = np.r_[fixed.z * fixed.weight, placed * moved.weight]
    z = np.bincount(place, weighted.real) + 1j * np.bincount(place, weighted.imag)
    return _Patch(vertices, np.asarray(z / weight, dtype=np.complex128), weight)
