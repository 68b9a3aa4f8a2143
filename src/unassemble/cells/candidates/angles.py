"""A first guess from angles alone.

In a cell, the corners of a circle, all others see an edge e under the same angle theta_e, with w_e = (cot theta_e
+ cot theta'_e) / 2 over the cells on its two sides. The angles of one cell add up to pi, and its corner between
edges d and e measures pi - theta_d - theta_e. With each weight shared equally between both sides the angles of a cell
still add up to about pi; those of a hole are too large, since its weights are those of one side only. Likewise
the corners at an interior vertex add up to about 2 pi.
"""

import numpy as np
from numpy.typing import NDArray

from ...budget import SAMPLE
from ...topology.faces import FaceComplex

SHORT = 4
"""Edges of faces that are cells unless the numbers say otherwise."""


def facing_angles(cotangents: NDArray) -> NDArray[np.float64]:
    """Angles between 0 and pi of given cotangents."""
    return np.asarray(np.pi / 2 - np.arctan(cotangents))


def face_sums(complex_: FaceComplex, angles: NDArray) -> NDArray[np.float64]:
    """(faces,) sum of the angles of half-edges around each face, about pi for a cell."""
    return np.asarray(np.bincount(complex_.face, angles), dtype=np.float64)


def vertex_excess(complex_: FaceComplex, angles: NDArray) -> NDArray[np.float64]:
    """(n,) sum of the corners about each vertex less 2 pi: about 0 at interior vertices, negative on the boundary."""
    corners = np.bincount(complex_.tail, minlength=complex_.n_vertices) * np.pi
    turned = np.bincount(complex_.tail, angles, complex_.n_vertices)
    return np.asarray(corners - 2 * turned - 2 * np.pi, dtype=np.float64)


def likeliest_scale(complex_: FaceComplex, weights: NDArray) -> float:
    """The c for which half of the short faces, or the shortest, have angle sums below pi, weights being shared equally.

    `weights` (e,): -A_ij = c w_ij.
    """
    unit = float(np.median(np.abs(weights[weights != 0]))) * np.sign(weights.sum())
    if not unit:
        return 1.0
    length = complex_.size[complex_.simple]
    if not len(length):
        return unit
    short = np.flatnonzero(complex_.simple & (complex_.size <= max(SHORT, length.min())))
    faces = short[np.linspace(0, len(short) - 1, min(len(short), SAMPLE)).astype(int)]
    size = complex_.size[faces]
    first = np.cumsum(size) - size
    face = np.repeat(np.arange(len(faces)), size)
    share = (weights / unit)[complex_.order[np.arange(len(face)) + (complex_.offsets[faces] - first)[face]] >> 1]
    low, high = np.full(len(faces), -8.0), np.full(len(faces), 8.0)  # of log c of each face
    for _ in range(40):
        middle = (low + high) / 2
        above = np.add.reduceat(facing_angles(share / np.exp(middle)[face]), first) > np.pi  # angles grow with c
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return float(unit * np.exp(np.median((low + high) / 2)))


def outer_faces(blocks: FaceComplex, sums: NDArray) -> NDArray[np.bool_]:
    """The face that bounds each block from outside: its longest, among equals that of the largest angle sum.

    `sums` (faces,): of angles.
    """
    block = blocks.block[blocks.order[blocks.offsets[:-1]]]
    order = np.lexsort((sums, blocks.size, block))
    last = order[np.append(np.flatnonzero(np.diff(block[order])), len(order) - 1)]
    longest = np.zeros(len(sums), dtype=bool)
    longest[last] = True
    return longest
