"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..planar.piece import PieceMesh
from ..topology.embedding import face_complexes
from .candidates import Candidates
from .evidence import label_changes
from .mending import mended
from .proposals import proposals
from .reading import Reading

_log = logging.getLogger(__name__)

_STARTS = 2  # readings to begin with that are worth repairing
_WORK = 1.2e5  # vertices times solves that repairs may take altogether
_FEW = 100  # vertices below which all is tried before the entries are blamed
_SUSPECT = 0.3  # change of the label of a lone triangular hole: it was 0.4 or more in all that were tried
_PATIENCE = 6  # leaps without an improvement; fewer where they are long
_SOLVES = 180
_FIRST = 0.7  # part of them for the likeliest reading
_MENDED = 20_000  # vertices up to which labels are relaxed and exchanged
_WIDE = 20  # vertices of the largest piece below which trying labels one by one is as good
_MENDING = 20  # solves that this is worth
_MANY = 20  # pieces that cost as much as another solve


@dataclass
class Effort:
    """Solves that are left; all drawings and starts share them, so that input without a mesh is soon given up."""

    solves: int
    known: dict[bytes, PieceMesh | None] = field(default_factory=dict)

    @classmethod
    def for_graph(cls, n: int) -> Effort:
        """As much as a graph of n vertices is worth."""
        return cls(int(np.clip(_WORK / n, 12, _SOLVES)))

    def reading(self, candidates: Candidates, labels: NDArray[np.bool_]) -> Reading:
        """A reading, counted."""
        reading = Reading.of(candidates, labels, self.known)
        self.solves -= 1 + len(reading.pieces) // _MANY
        return reading

    def share(self, part: float) -> Effort:
        """A part of what is left."""
        solves = int(self.solves * part)
        self.solves -= solves
        return Effort(solves, self.known)

    @property
    def spent(self) -> bool:
        """Whether it is time to give up."""
        return self.solves <= 0


def read_cells(n: int, edges: NDArray, weights: NDArray, scale: float | None = None) -> Reading | None:
    """The reading of a connected planar graph that fits its weights, or else the one that fits best.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order; at least one.
    weights : (e,) float64
        -A_ij of each edge.
    scale : float, optional
        c, where it is known.

    Returns
    -------
    Reading or None
        None if no reading makes a planar surface.
    """
    best: Reading | None = None
    effort = Effort.for_graph(n)
    for drawing in face_complexes(n, edges):
        candidates = Candidates.of(drawing, weights, scale)
        starts = []
        for labels in candidates.starts():
            starts.append(effort.reading(candidates, labels))
            if starts[-1].fits:
                return starts[-1]
        if starts and _entries_are_to_blame(starts[0]):
            return _better(best, starts[0])
        likeliest = next((start for start in starts if start.pieces), None)
        starts = sorted(starts, key=lambda reading: reading.size)[:_STARTS]
        for k, start in enumerate(starts):
            starts[k] = _turned_over(start, effort)
            if starts[k].fits:
                return starts[k]
        if likeliest and not starts[0].like_noise:
            triangles = 2 * (candidates.first & (candidates.size == 3)).sum() > candidates.first.sum()
            place = 0 if n >= _FEW and triangles else len(starts)
            starts[place:place] = _mended(likeliest, effort)
        for number, start in enumerate(starts):
            share = effort.share(_FIRST if number == 0 and len(starts) > 1 else 1 / (len(starts) - number))
            best = _better(best, start if start.like_noise else _repaired(start, share))
            if best.fits or best.like_noise:
                return best
            effort.solves += max(share.solves, 0)
    return best if best is not None and best.pieces else None


def first_reading(n: int, edges: NDArray, weights: NDArray) -> Reading | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for drawing in face_complexes(n, edges):
        candidates = Candidates.of(drawing, weights)
        for labels in candidates.starts():
            reading = Reading.unsolved(candidates, labels)
            if reading.pieces:
                return reading
    return None


def _better(one: Reading | None, other: Reading) -> Reading:
    return other if one is None or other.size < one.size else one


def _entries_are_to_blame(reading: Reading) -> bool:
    """Whether triangles alone do not fit, and none of them is suspected of being a hole: no choice of cells helps."""
    candidates, labels = reading.candidates, reading.labels
    if (
        not reading.pieces
        or candidates.n_vertices < _FEW
        or (labels & ((candidates.size > 3) | candidates.corner)).any()
    ):
        return False
    return float(np.nan_to_num(np.abs(label_changes(reading))).max(initial=0.0)) < _SUSPECT


def _mended(reading: Reading, effort: Effort) -> list[Reading]:
    """A better reading to begin with, or none."""
    n = reading.candidates.n_vertices
    if not reading.pieces or n > _MENDED or max(piece.n_vertices for piece in reading.pieces) < _WIDE:
        return []
    effort.solves -= _MENDING
    labels = mended(reading)
    return [] if labels is None else [effort.reading(reading.candidates, labels)]


def _turned_over(reading: Reading, effort: Effort) -> Reading:
    """Parts of the drawing turned over, each because that lowers the misfit; at no more than a third of the effort."""
    least = 2 * effort.solves // 3
    trials = reading.candidates.turned(reading.labels)
    while reading.pieces and not reading.fits and effort.solves > least and (labels := next(trials, None)) is not None:
        trial = effort.reading(reading.candidates, labels)
        if trial.size < 0.999 * reading.size:
            reading, trials = trial, trial.candidates.turned(trial.labels)
    return reading


def _repaired(reading: Reading, effort: Effort) -> Reading:
    """Turn labels over as the misfit asks for it."""
    best = _leaps(reading, effort)
    return best if best.fits else _descent(best, effort)


def _leaps(reading: Reading, effort: Effort) -> Reading:
    """All clear changes at once, uphill too: with many wrong cells the misfit of the way is no guide."""
    best, since_best = reading, 0
    patience = np.clip(3e4 / reading.candidates.n_vertices, 2, _PATIENCE)
    seen = {reading.labels.tobytes()}
    while reading.pieces and not reading.fits and since_best < patience and not effort.spent:
        changes = np.nan_to_num(label_changes(reading))
        labels = next((x for x in proposals(reading, changes) if x.tobytes() not in seen), None)
        if labels is None:
            break
        seen.add(labels.tobytes())
        reading = effort.reading(reading.candidates, labels)
        since_best = 0 if reading.size < best.size else since_best + 1
        best = _better(best, reading)
        _log.debug("leap: misfit %.1e", reading.size)
    return best


def _descent(reading: Reading, effort: Effort) -> Reading:
    """Small changes, each of which lowers the misfit."""
    while reading.pieces and not reading.fits and not effort.spent:
        changes = np.nan_to_num(label_changes(reading))
        for labels in proposals(reading, changes):
            trial = effort.reading(reading.candidates, labels)
            if trial.size < reading.size or effort.spent:
                break
        else:
            return reading
        reading = _better(reading, trial)
        _log.debug("descent: misfit %.1e", reading.size)
    return reading
