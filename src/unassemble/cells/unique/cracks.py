"""Holes without area between cells that do not match: labellings that have one are no meshes, though they fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...tolerances import ALIKE, CANCELLED
from ..judge.labelling import Labelling


def cracked(labelling: Labelling) -> bool:
    """Whether a hole has no area, and a vertex lies on the side of the cell beyond.

    A slit whose vertices lie in the same places on both sides is none of these: such meshes are made on purpose.
    """
    for piece, mesh in zip(labelling.pieces, labelling.meshes, strict=True):
        if mesh is None:
            continue
        begin = piece.loop_offsets[:-1]
        tail, head = mesh.z[piece.boundary.T]
        first = np.repeat(tail[begin], np.diff(piece.loop_offsets))
        area = np.add.reduceat((np.conj(tail - first) * (head - first)).imag / 2, begin)
        length = np.add.reduceat(np.abs(head - tail), begin)
        flat = np.abs(area) <= CANCELLED * length**2
        flat[np.argmax(np.abs(area))] = False  # the outer boundary
        for k in np.flatnonzero(flat).tolist():
            if not _is_slit(tail[begin[k] : piece.loop_offsets[k + 1]] / length[k]):
                return True
    return False


def _is_slit(z: NDArray[np.complex128]) -> bool:
    """Whether a loop (k,) of length 1 runs along a tree and back: all k / 2 edges of the tree have both their sides."""
    places = np.unique(np.round(z / ALIKE))
    return 2 * (len(places) - 1) == len(z)
