"""Cells that no embedding at hand has for faces: 3-cycles and corners about the places where a labelling does not fit.

Where parts of a graph hang together by two vertices or one it has many embeddings, and cells that are faces of one are
none of another. That matters near the last wrong labels only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...tolerances import LITTLE
from ...topology import Polygons
from ...topology.cycles import three_cycles
from ...topology.faces import joined
from ...topology.numbering import adjacency
from .candidates import Candidates

_MOST_NEIGHBOURS = 12
"""Of a vertex all of whose pairs of neighbours may make a corner."""


def widened(candidates: Candidates, edges: NDArray[np.int64], misfit: NDArray[np.float64]) -> Candidates:
    """With further candidates, in both orientations, which claim no half-edges.

    `edges` (e, 2); `misfit` (e,): what a labelling leaves on these edges.
    """
    n = candidates.n_vertices
    at = np.zeros(n)
    np.maximum.at(at, edges.ravel(), np.repeat(misfit, 2))
    near = at > LITTLE * at.max(initial=0.0)
    triangles, _ = three_cycles(n, candidates.edges)
    found = np.concatenate([triangles[near[triangles].any(axis=1)], _wedges(candidates, near)])
    names = {frozenset(cell.tolist()) for cell in np.split(candidates.cells.vertices, candidates.cells.offsets[1:-1])}
    new = found[[frozenset(cell) not in names for cell in found.tolist()]]
    return with_more(candidates, np.concatenate([new, new[:, ::-1]]).tolist())


def _wedges(candidates: Candidates, near: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(k, 3) two neighbours of a vertex that are not joined, with the vertex between them."""
    graph = adjacency(candidates.n_vertices, candidates.edges)
    found = []
    for h in np.flatnonzero(near).tolist():
        ends = graph.indices[graph.indptr[h] : graph.indptr[h + 1]].astype(np.int64)
        if len(ends) <= _MOST_NEIGHBOURS:
            one, other = np.triu_indices(len(ends), 1)
            apart = ~joined(candidates.n_vertices, candidates.edges, ends[one], ends[other])
            found.append(np.column_stack([ends[one], np.full(len(one), h), ends[other]])[apart])
    return np.concatenate([np.empty((0, 3), np.int64), *found])


def with_more(candidates: Candidates, cells: list[tuple[int, ...]]) -> Candidates:
    """With further cells, which claim no half-edges."""
    more = np.zeros(len(cells), dtype=bool)
    return replace(
        candidates,
        cells=Polygons.joined([candidates.cells, Polygons.of(cells)]) if cells else candidates.cells,
        corner=np.append(candidates.corner, more),
        belief=np.append(candidates.belief, np.zeros(len(cells))),
        first=np.append(candidates.first, more),
        outer=np.append(candidates.outer, more),
    )
