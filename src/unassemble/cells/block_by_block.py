"""What hangs on the rest by single vertices, read by itself where only there a reading does not fit.

A chain of right triangles with no entry to spare is nearly explained by other cells, with a c that is a little off;
many labels at once would have to change. Where another piece tells c such a part is a smaller matrix of its own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..topology import Polygons, components
from ..topology.blocks import blocks
from ..topology.keys import contains, pair_keys
from .candidates.cell_set import CellSet
from .reading import FITS, Reading, add_differing_factors, misfits, sound_pieces

Read = Callable[[int, NDArray, NDArray, float, NDArray | None], Reading | None]


def read_block_by_block(reading: Reading, read: Read, most: float = 1.0) -> Reading[CellSet] | None:
    """A reading with the blocks that do not fit read anew; None where that does not make the whole fit.

    Parameters
    ----------
    reading : Reading
        With positions. Of the pieces that fit by themselves, and have entries to spare, the largest tells c.
    read : callable
        As :func:`unassemble.cells.search.read_cells`, from vertices, edges, weights, c and errors.
    most : float
        Share of the edges that these blocks may have.
    """
    whole = reading.candidates
    n, edges = whole.n_vertices, whole.edges
    solved = [(piece, mesh) for piece, mesh in zip(reading.pieces, reading.meshes, strict=True) if mesh]
    misfit = misfits(n, reading.edges, reading.weights, solved)
    sound = [(piece.n_vertices, mesh.scale) for piece, mesh in sound_pieces(solved, misfit)]
    if not sound:
        return None
    scale = whole.scale or max(sound)[1]
    add_differing_factors(solved, misfit, scale)
    stored = contains(pair_keys(n, *edges.T), pair_keys(n, *reading.edges.T))
    label = blocks(n, edges)
    apart = np.isin(label, label[misfit[stored] > FITS])
    if apart.all() or not 0 < apart.mean() <= most:
        return None
    rows_apart = np.flatnonzero(apart)
    sides = pair_keys(n, whole.cells.vertices, whole.cells.following)
    touched = np.logical_or.reduceat(contains(pair_keys(n, *edges[apart].T), sides), whole.cells.offsets[:-1])
    kept = reading.labels & ~touched
    parts = [(whole.cells.chosen(kept, np.arange(n)), whole.corner[kept])]
    for part in components(n, edges[rows_apart]):
        rows = rows_apart[part.edge_rows]
        errors = None if whole.errors is None else whole.errors[rows]
        own = read(len(part.vertices), part.edges, whole.weights[rows], scale, errors)
        if own is None or not own.fits:
            return None
        parts.append((own.candidates.cells.chosen(own.labels, part.vertices), own.candidates.corner[own.labels]))
    every = Polygons.joined([some for some, _ in parts])
    corner = np.concatenate([some for _, some in parts])
    together = CellSet(n, edges, whole.weights, whole.scale, every, corner, errors=whole.errors)
    found = Reading.of(together, np.ones(every.count, dtype=bool))
    return found if found.fits else None
