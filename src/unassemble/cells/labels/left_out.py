"""Which cells would explain a misfit, whatever their shape: leave out the entries of their sides and see.

The linear explanation of :mod:`unassemble.cells.labels.evidence` takes the cotangents of a candidate from the mesh at
hand, where a missing triangle at the boundary may well be folded over, and it shares the misfit among all candidates
that look alike. Here the entries S of the sides of one or two candidates are left out of the fit. With P the
projection off all displacements, that takes r_S' P_SS^-1 r_S off the squared misfit (r projected, too), and what the
entries contain besides the other cells is known:

    d_S = P_SS^-1 r_S.

If the candidate is what is missing, these are halves of the cotangents of its angles, which add up to pi.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import SolverError
from ...linalg import factorisation
from ...linalg.upper import UpperTriangle
from ..reading import Reading
from .evidence import Linear, explanations

_ASKED = 200  # candidates of a piece, those of whose sides one alone takes most off the misfit
_PROBES = 32  # random vectors that estimate the diagonal of P to a quarter or so
_PAIRED = 16  # of which pairs are made
_KEPT = 8  # candidates, and pairs, to be tried
_ANGLES = 0.3  # what the sum of angles may differ from pi, in units of pi: displacements are not small
_DETERMINED = 1e-8  # least eigenvalue of P_SS


def left_out(reading: Reading) -> Iterator[NDArray[np.int64]]:
    """Candidates to turn over, then pairs of them; first those whose sides carry most of the misfit."""
    for linear in explanations(reading):
        sides = _Sides.of(reading, linear)
        if sides is not None:
            yield from sides.explaining()


@dataclass(frozen=True, eq=False)
class _Sides:
    """What leaving out the sides of candidates tells.

    Attributes
    ----------
    candidate : (k,) int64
    rows : list of (s,) int64
        Of the sides of each, in `left`.
    add : (k,) bool
        Whether it is no cell yet.
    angle : (k,) float64
        What the angles over these sides add up to.
    left : (m,) float64
        The misfit off all displacements; m sides of these candidates.
    projection : (m, m) float64
        P.
    spread : (m,) float64
        What each misfit was divided by.
    """

    candidate: NDArray[np.int64]
    rows: list[NDArray[np.int64]]
    add: NDArray[np.bool_]
    angle: NDArray[np.float64]
    left: NDArray[np.float64]
    projection: NDArray[np.float64]
    spread: NDArray[np.float64]

    @classmethod
    def of(cls, reading: Reading, linear: Linear) -> _Sides | None:
        """Of the candidates around the largest misfits; None where displacements are not determined."""
        normal = UpperTriangle.of((linear.motion.T @ linear.motion).tocsr())
        solver = factorisation(normal)
        try:
            solver.factorise(normal)

            def off(vectors: NDArray) -> NDArray:
                return np.asarray(vectors - linear.motion @ solver.solve(linear.motion.T @ vectors))

            left = off(linear.misfit)
            # P is a projection: its diagonal is the mean square of what it makes of normal random numbers.
            probes = off(np.random.default_rng(0).standard_normal((len(left), _PROBES)))
            taken = left**2 / np.maximum((probes**2).mean(axis=1), _DETERMINED)
            candidate, rows, angle = _asked(reading, linear, taken)
            if not len(candidate):
                return None
            used, place = np.unique(np.concatenate(rows), return_inverse=True)
            shown = linear.motion[used]
            projection = np.eye(len(used)) - shown @ solver.solve(shown.T.toarray())
        except SolverError:
            return None
        finally:
            solver.release()
        if not np.isfinite(projection).all():
            return None
        ends = np.cumsum([len(one) for one in rows])[:-1]
        return cls(
            candidate, np.split(place, ends), ~reading.labels[candidate], angle, left[used], projection,
            linear.spread[used],
        )  # fmt: skip

    def explaining(self) -> Iterator[NDArray[np.int64]]:
        """Numbers of candidates, then of pairs."""
        gain, fits = zip(*(self._without([k]) for k in range(len(self.candidate))), strict=True)
        order = np.argsort(-np.array(gain), kind="stable")
        for k in order[np.array(fits)[order]][:_KEPT]:
            yield self.candidate[[k]]
        pairs = []
        for pair in combinations(order[:_PAIRED].tolist(), 2):
            gain_of_both, both_fit = self._without(list(pair))
            if both_fit:
                pairs.append((-gain_of_both, pair))
        for _, pair in sorted(pairs)[:_KEPT]:
            yield self.candidate[list(pair)]

    def _without(self, some: list[int]) -> tuple[float, bool]:
        """How much the squared misfit falls, and whether the angles of each of some candidates add up."""
        rows = np.concatenate([self.rows[k] for k in some])
        if len(np.unique(rows)) < len(rows):
            return 0.0, False
        values, vectors = np.linalg.eigh(self.projection[np.ix_(rows, rows)])
        if values[0] < _DETERMINED:
            return 0.0, False
        left = self.left[rows]
        half = vectors @ ((vectors.T @ left) / values)
        cotangents = np.split(2 * half * self.spread[rows], np.cumsum([len(self.rows[k]) for k in some])[:-1])
        fits = all(
            abs(np.arctan2(1, c if self.add[k] else -c).sum() - self.angle[k]) < _ANGLES * np.pi
            for k, c in zip(some, cotangents, strict=True)
        )
        return float(half @ left), fits


def _asked(reading: Reading, linear: Linear, taken: NDArray) -> tuple[NDArray, list[NDArray], NDArray]:
    """Candidates, the rows of their sides, and what their angles add up to.

    First come those with sides that take most off the squared misfit, (m,), when they are left out alone.

    The side of a cell that has vanished from the boundary faces a right angle: it has an entry, zero, if the cell is
    there, and none otherwise.
    """
    n = reading.candidates.n_vertices
    row_of = sp.csr_array(
        (np.arange(1, len(linear.pairs) + 1), (linear.pairs.min(axis=1), linear.pairs.max(axis=1))), shape=(n, n)
    )
    cells = reading.candidates.cells
    chosen = np.flatnonzero(linear.chosen)
    size = cells.size[chosen]
    owner = np.repeat(np.arange(len(chosen)), size)
    at = np.repeat(cells.offsets[chosen], size) + np.arange(len(owner)) - np.repeat(np.cumsum(size) - size, size)
    last = np.cumsum(size) - 1
    following = at + 1
    following[last] = cells.offsets[chosen]
    ends = cells.vertices[at], cells.vertices[following]
    row = np.asarray(row_of[np.minimum(*ends), np.maximum(*ends)]).ravel() - 1
    share = np.bincount(owner, np.where(row >= 0, taken[row], 0), len(chosen)) / size
    kept = np.sort(np.argsort(-share, kind="stable")[:_ASKED])
    missing = np.bincount(owner, row < 0, len(chosen))
    kept = kept[(missing[kept] <= 1) & (share[kept] > 0)]
    rows = [row[last[k] + 1 - size[k] : last[k] + 1] for k in kept]
    angle = np.where(missing[kept] > 0, np.pi / 2, np.pi)
    return chosen[kept], [one[one >= 0] for one in rows], angle
