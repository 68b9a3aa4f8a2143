"""Right angles left open in the mesh at hand: where the cells about a vertex leave one, a corner is missing there.

That is seen from near only: while few labels are wrong, angles are nearly those of the mesh that is sought. Entries
need not say so, where nothing else fixes what hangs on the sides of the corner.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..reading import Reading

_RIGHT = np.deg2rad(30)  # what an open angle may differ from a right one
_CLEAR = np.deg2rad(10)  # corners that are taken together: they hardly touch the shape of each other
_MOST = 8


def right_gaps(reading: Reading) -> Iterator[NDArray[np.int64]]:
    """Corners that fill right angles: the clear ones together, then each by itself, the clearest first."""
    candidates = reading.candidates
    used = np.zeros(2 * len(candidates.edges), dtype=bool)
    cell, half = candidates.sides.T
    used[half[reading.labels[cell]]] = True
    blocked = np.bincount(cell, used[half], candidates.count) > 0
    corner = np.flatnonzero(candidates.corner & ~reading.labels & ~blocked)
    lacking = np.full(len(corner), np.inf)
    vertices = candidates.cells.vertices[candidates.cells.offsets[corner][:, None] + np.arange(3)]
    z = np.full(candidates.n_vertices, np.nan, dtype=np.complex128)
    for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
        if mesh is not None:
            z[:] = np.nan
            z[piece.vertices] = mesh.z
            a, b, c = z[vertices].T
            with np.errstate(all="ignore"):
                lacking = np.fmin(lacking, np.abs(np.angle((a - b) / (c - b) / 1j)))
    order = np.argsort(lacking, kind="stable")
    clear = corner[lacking < _CLEAR]
    if len(clear) > 1:
        yield clear
    yield from corner[order[lacking[order] < _RIGHT]][:_MOST, None]
