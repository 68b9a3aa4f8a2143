"""Holes without area: readings that have one are no meshes, though their entries fit."""

from __future__ import annotations

import numpy as np

from ..reading import Reading

_FLAT = 1e-9  # area over the square of the length of its boundary


def cracked(reading: Reading) -> bool:
    """Whether a hole has no area: a vertex lies on the side of the cell beyond, and it is a crack without width."""
    for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
        if mesh is None:
            continue
        begin = piece.loop_offsets[:-1]
        tail, head = mesh.z[piece.boundary.T]
        first = np.repeat(tail[begin], np.diff(piece.loop_offsets))
        area = np.add.reduceat((np.conj(tail - first) * (head - first)).imag / 2, begin)
        length = np.add.reduceat(np.abs(head - tail), begin)
        flat = np.abs(area) <= _FLAT * length**2
        flat[np.argmax(np.abs(area))] = False  # the outer boundary
        if flat.any():
            return True
    return False
