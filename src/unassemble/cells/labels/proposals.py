"""Which labels to turn over next.

Three things speak for a change: the linear explanation of the misfit (see :mod:`unassemble.cells.labels.evidence`),
which is right from afar; what the entries of a cell's sides say by themselves
(:mod:`unassemble.cells.labels.left_out`); and the misfit itself, which gathers around the last wrong cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..reading import Reading
from .left_out import left_out

_CLEAR = 0.35  # a label that is to change by so much is turned over
_HOPELESS = -0.3  # belief in a corner at a vertex that does not look like an inner one
_SINGLES = 8
_EXCHANGES = 24
_LIKELY = 100  # cells that take part in exchanges


def proposals(reading: Reading, changes: NDArray) -> Iterator[NDArray[np.bool_]]:
    """Labels to try: all clear changes together, single ones, exchanges of a cell and an empty candidate; each once.

    Parameters
    ----------
    reading : Reading
    changes : (cells,) float64
        Of the labels, from the linear explanation; 0 where nothing is known.
    """
    gain = np.where(reading.labels, -changes, changes)
    top = float(gain.max(initial=0.0))
    nearby = _misfit_nearby(reading)
    clear = np.empty(0, np.int64)
    if top > 0:
        clear = np.flatnonzero(gain >= (max(_CLEAR, 0.6 * top) if top > _CLEAR else 0.7 * top))
    seen = {reading.labels.tobytes()}
    for turned in chain(
        [clear],
        left_out(reading),
        _moved_corners(reading, nearby),
        _singles(reading, gain, nearby),
        _exchanges(reading, gain, nearby),
    ):
        labels = _turned(reading, changes, turned)
        if labels.tobytes() not in seen:
            seen.add(labels.tobytes())
            yield labels


def _misfit_nearby(reading: Reading) -> NDArray[np.float64]:
    """(cells,) mean over the vertices of the squared misfits on edges that meet there."""
    cells = reading.candidates.cells
    at_vertex = np.zeros(reading.candidates.n_vertices)
    np.add.at(at_vertex, reading.edges.ravel(), np.repeat(reading.misfit**2, 2))
    owner = np.repeat(np.arange(cells.count), cells.size)
    return np.bincount(owner, at_vertex[cells.vertices], cells.count) / cells.size


def _moved_corners(reading: Reading, nearby: NDArray) -> Iterator[NDArray[np.int64]]:
    """A right angle that is to move to the other side of an edge which ends there: both candidates fit that one."""
    candidates = reading.candidates
    corner = np.flatnonzero(candidates.corner)
    a, apex, b = (candidates.cells.vertices[candidates.cells.offsets[corner] + k] for k in range(3))
    last = np.bincount(candidates.edges.ravel(), minlength=candidates.n_vertices) == 1
    loose, far = np.concatenate([np.column_stack([last[a], a]), np.column_stack([last[b], b])]).T
    corner, apex = np.tile(corner, 2)[loose > 0], np.tile(apex, 2)[loose > 0]
    end = far[loose > 0]
    full = reading.labels[corner]
    pairs = np.array(
        [
            (one, other)
            for one, tip in zip(corner[full], end[full], strict=True)
            for other in corner[~full & (end == tip)]
        ],
        dtype=np.int64,
    ).reshape(-1, 2)
    yield from pairs[np.argsort(-nearby[pairs].sum(axis=1), kind="stable")[:_SINGLES]]


def _singles(reading: Reading, gain: NDArray, nearby: NDArray) -> Iterator[NDArray[np.int64]]:
    """Those with the clearest changes; faces, corners that are cells, and others, amid the largest misfits."""
    corner, labels = reading.candidates.corner, reading.labels
    faces = ~corner & ~reading.candidates.outer
    scores = (gain, *(np.where(which, nearby, 0.0) for which in (faces, corner & labels, corner & ~labels)))
    for some in zip(*(np.argsort(-score, kind="stable")[:_SINGLES] for score in scores), strict=True):
        yield from (np.array([one]) for one in some)


def _exchanges(reading: Reading, gain: NDArray, nearby: NDArray) -> Iterator[NDArray[np.int64]]:
    """A cell and an empty candidate that share a vertex: a hole that is to move."""
    cells, labels = reading.candidates.cells, reading.labels
    owner = np.repeat(np.arange(cells.count), cells.size)
    incidence = sp.csr_array(
        (np.ones(len(owner)), (owner, cells.vertices)), shape=(cells.count, reading.candidates.n_vertices)
    )
    for score in (nearby, gain):
        order = np.argsort(-score, kind="stable")
        full, empty = (order[which[order]][:_LIKELY] for which in (labels, ~labels & ~reading.candidates.corner))
        touching = (incidence[full] @ incidence[empty].T).tocoo()
        pairs = np.column_stack([full[touching.row], empty[touching.col]])
        yield from pairs[np.argsort(-score[pairs].sum(axis=1), kind="stable")[:_EXCHANGES]]


def _turned(reading: Reading, changes: NDArray, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The labels with some turned over; what stands in the way of a new cell goes, bare edges get a cell again."""
    candidates, labels = reading.candidates, reading.labels
    turned = np.zeros(len(labels), dtype=bool)
    turned[rows] = True
    value = np.where(labels, 1.0, -np.inf)
    value[turned] = np.where(labels[turned], -np.inf, 2.0 + changes[turned])
    chosen = candidates.compatible(value)
    fallback = np.where(changes != 0, labels + changes, candidates.belief) - 10.0 * (turned & labels)
    # A cell is rather kept than replaced by a corner that can be none.
    fallback[candidates.corner & (candidates.belief < _HOPELESS)] -= 20.0
    return candidates.covering(chosen, fallback)
