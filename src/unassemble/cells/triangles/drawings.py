"""Short faces in many drawings.

Which 3-cycles are faces depends on the drawing where parts of the graph hang on two vertices: ears, chords, bridges.
The right drawing is often one that none of the usual rules gives. So they are gone through, from each to those that
have one more 3-cycle for a face, beginning with cycles about the largest misfit, and first from the drawing that left
the least. All short faces are taken for cells; labels are turned over after that, where nothing need have vanished.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import islice
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from ...topology.cycles import three_cycles
from ...topology.embedding import face_complexes, fingerprint
from ...topology.faces import FaceComplex
from ...topology.redrawing import redrawn
from ..candidates.candidates import Candidates
from ..labels.descent import Descent
from ..labels.effort import SMALL_GRAPH, Effort
from ..reading import Reading

_DRAWINGS = 100  # that are read at most
_NEXT = 8  # that follow from one at a time
_SEARCHES = 6  # for small changes, from the readings of least misfit
_SOLVES = 60  # for each


def read_in_drawings(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Reading | None:
    """Triangles, and maybe quadrilaterals, that fit in some drawing; None where none are found.

    Parameters are those of :func:`unassemble.cells.search.read_cells`.
    """
    count = np.bincount(three_cycles(n, edges)[1].ravel(), minlength=len(edges))
    if n > SMALL_GRAPH or not count.any():
        return None
    effort, found = Effort.for_graph(n), []
    for reading in _readings(n, edges, weights, scale, errors, effort):
        if reading.fits:
            return reading
        found += [reading] if reading.pieces else []
    if weights[count == 0].any():
        return None
    for reading in sorted(found, key=attrgetter("mean_misfit"))[:_SEARCHES]:
        nearest = Descent(reading, free=_faces(reading.candidates, 3)).run(Effort(_SOLVES, effort.known))
        if nearest.fits:
            return nearest
    return None


def _readings(
    n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None, effort: Effort
) -> Iterator[Reading]:
    """With all triangles of a drawing for cells, then its quadrilaterals, too; then those of drawings next to it."""
    first = list(face_complexes(n, edges))
    seen = {fingerprint(drawing) for drawing in first}
    # Mean misfit of the drawing that it was made from, a number that settles ties, and the drawing.
    waiting: list[tuple[float, int, FaceComplex]] = [(0.0, k, drawing) for k, drawing in enumerate(first)]
    for _ in range(_DRAWINGS):
        if not waiting or effort.spent:
            return
        drawing = heapq.heappop(waiting)[2]
        candidates = Candidates.of(drawing, weights, scale, errors=errors)
        labels = {chosen.tobytes(): chosen for chosen in (_faces(candidates, 3), _faces(candidates, 4))}
        readings = [effort.reading(candidates, chosen) for chosen in labels.values()]
        yield from readings
        best = min(readings, key=attrgetter("mean_misfit"))
        at_vertex = np.bincount(best.edges.ravel(), np.repeat(best.misfit, 2), n)
        for _, other in islice(redrawn(drawing, at_vertex), _NEXT):
            name = fingerprint(other)
            if name not in seen:
                seen.add(name)
                heapq.heappush(waiting, (best.mean_misfit, len(seen), other))


def _faces(candidates: Candidates, longest: int) -> NDArray[np.bool_]:
    """(cells,) faces of at most so many edges, but for outer ones."""
    return candidates.first & (candidates.size <= longest)
