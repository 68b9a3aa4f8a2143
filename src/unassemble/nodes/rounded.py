"""Matrices written with few digits: their rows annihilate translations up to rounding only, and are set right.

What belongs to translations is known beforehand: away from supports the entries of a row and a direction add up to
zero. Where they do up to the rounding of each, the sum is taken off the largest of them. Then a
row that a support touched stands out as clearly as in a matrix of full precision.

How far positions may be off is seen by what other rounding does to them: entries as far off as rounding may have left
them are drawn anew, and positions are found from these as from those given (a parametric bootstrap; Efron and
Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6). So errors that cancel do, and those that a weak equation
magnifies are seen where it does. That holds if rounding is all that entries are off by: the misfits that they leave
then are as large as the changes that drawing anew brings to them.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from ..budget import REDRAWN
from ..errors import GeometryError
from ..matrix.digits import Digits
from ..tolerances import ALIKE, CANCELLED, CERTIFIED, CONFIDENCE, HARDLY_ANY, LAST_DIGITS, NOISY, SIGMAS
from ..words import Reason
from .nodal import determined
from .orders import ORDERS, regular
from .searching import directions_in_order, live_part

_LAYOUTS = {3: (3, 2, 1), 2: (2,), 6: (3,), 4: (2,)}  # unknowns of a node, and how many of these may be displacements


@dataclass(frozen=True, eq=False)
class Rounding:
    """What the entries of a matrix were rounded to."""

    name: str  # digits, decimals or single precision
    level: float  # how far entries may be off, relative to their size, as half of the rows have it
    exact: sp.csr_array  # the matrix, with exact sums
    unit: sp.csr_array  # of the last place of each entry, with the entry's sign
    number: NDArray[np.int64]  # (nnz,) entries that are the same number, but for the sign: these were rounded alike
    direction: NDArray[np.int64]  # of each row; -1 where not known
    zero: NDArray[np.bool_]  # (N, b) rows and directions that add up to zero, but for rounding

    @property
    def spread(self) -> float:
        """What an identity, or a sum of forces, may be off by, relative to what makes it up."""
        return SIGMAS * self.level

    @property
    def needed(self) -> float:
        """How far off positions may be, relative to the size, to be certified: half of the digits of the entries."""
        return max(ALIKE, float(np.sqrt(self.level)))

    def redrawn(self, seed: int) -> sp.csr_array:
        """The matrix off by what rounding may have done to each number, with exact sums again."""
        off = self.unit.copy()
        off.data *= np.random.default_rng(seed).uniform(-0.5, 0.5, int(self.number.max()) + 1)[self.number]
        return _without_sums(sp.csr_array(self.exact + off), self.direction, self.zero)


def with_exact_sums(
    matrix: sp.csr_array,
    candidates: Iterable[tuple[NDArray[np.int64], int]] = (),
    *,
    known: tuple[NDArray[np.int64], int] | None = None,
) -> tuple[sp.csr_array, Rounding | None]:
    """Take the rounding out of rows that annihilate translations, if unknowns stand in one of the usual orders.

    `candidates` are further directions of rows to try, (N,) with -1 where not known, and how many there are; `known`
    ones are taken in place of all that could be tried: with others few rows add up to zero. The given matrix (N, N) and
    None where there is nothing to do.
    """
    digits = Digits.of(matrix.data)
    if digits is None:
        return matrix, None
    _, number = np.unique(np.abs(matrix.data), return_inverse=True)
    unit = sp.csr_array((digits.unit * np.sign(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
    size, error = abs(matrix), abs(unit) / 2
    total, of_row = (np.asarray(part.sum(axis=1)).ravel() for part in (size, error))
    off = of_row / np.where(total > 0, total, np.inf)
    best, most, excess = None, HARDLY_ANY, 0.0
    readings = [known] if known else chain(_readings(matrix, np.maximum(off, CANCELLED)), candidates)
    for direction, b in readings:
        labels = (direction[:, None] == np.arange(b)).astype(float)
        sums, sizes = matrix @ labels, size @ labels
        zero = (np.abs(sums) <= error @ labels + LAST_DIGITS * total[:, None]) & (sizes > LAST_DIGITS * total[:, None])
        share = max(float(zero[:, :moves].all(axis=1).mean()) for moves in _LAYOUTS[b])
        if share > most:
            best, most = (direction, zero), share
            excess = float((np.abs(np.where(zero, sums, 0.0)) / np.where(total > 0, total, 1)[:, None]).max())
    if best is None or excess <= LAST_DIGITS:  # dyadic numbers are exact, few digits or not
        return matrix, None
    exact = _without_sums(matrix, *best)
    return exact, Rounding(digits.name, float(np.median(off)), exact, unit, number, *best)


def _readings(matrix: sp.csr_array, off: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.int64], int]]:
    """Directions of rows in one of the usual orders, and how many; with gaps where supports took some rows.

    `off` (N,) is what rows may add up to that make up zero, relative to their size.
    """
    order = matrix.shape[0]
    for b in _LAYOUTS:
        for kind in ORDERS:
            if order % b == 0:
                yield regular(order, b, kind)[1], b
    live, inner = live_part(matrix)
    for d in (3, 2):
        for found in directions_in_order(inner, d, off[live]):
            direction = np.full(order, -1)
            direction[live] = found
            yield direction, d


def _without_sums(matrix: sp.csr_array, direction: NDArray[np.int64], zero: NDArray[np.bool_]) -> sp.csr_array:
    """The matrix after sums that make up zero were taken off the largest entry of each row and direction."""
    entry = matrix.tocoo(copy=True)
    b = zero.shape[1]
    excess = np.where(zero, matrix @ (direction[:, None] == np.arange(b)).astype(float), 0.0)
    key = entry.row * (b + 1) + direction[entry.col]
    order = np.lexsort((np.abs(entry.data), key))
    last = order[np.append(np.diff(key[order]) > 0, True)]
    last = last[direction[entry.col[last]] >= 0]
    entry.data[last] -= excess[entry.row[last], direction[entry.col[last]]]
    return sp.csr_array(entry)


def misfits_allowed(rounding: Rounding | None) -> float:
    """The largest misfit, relative to what makes it up, that entries of this rounding, or of none, explain."""
    return max(CERTIFIED, rounding.spread) if rounding else CERTIFIED


@dataclass(frozen=True)
class Known:
    """How well positions are known."""

    error: float  # largest of a node, relative to the diameter of its piece; infinite where one may get lost
    explained: bool = True  # whether rounding explains the misfits, so that the error is all that there is

    def objections(self, misfit: float, rounding: Rounding | None, said: str) -> Iterator[Reason]:
        """Why positions are not certified that leave some largest misfit, which is `said`."""
        needed = rounding.needed if rounding else ALIKE
        fits = misfit <= misfits_allowed(rounding) and self.explained
        if not fits:
            yield Reason(f"{said}, more than entries rounded to {rounding.name} leave" if rounding else said)
        if not self.error <= needed:
            far = f"{self.error:.0e} of the size" if np.isfinite(self.error) else "any distance"
            yield Reason(f"{said}, and positions may be off by {far}" if fits else f"positions may be off by {far}")

    def within(self, rounding: Rounding | None) -> str:
        """How far positions are known, in words; empty for entries of full precision."""
        if rounding is None:
            return ""
        far = f"as far as entries rounded to {rounding.name} tell"
        return f", {far}: positions are known to {self.error:.0e} of the size"


def known_to(
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    misfits: NDArray[np.float64],
    rounding: Rounding,
    place: Callable[[sp.csr_array], tuple[NDArray[np.float64], NDArray[np.float64]]],
    *,
    sized: bool,
) -> Known:
    """Find positions anew, with other rounding.

    `place` finds points and their misfits (m,) from a matrix that may have been rounded to the given one; `sized` says
    whether the matrix tells size and sign.
    """
    pieces = [np.flatnonzero(component == one) for one in np.unique(component[component >= 0])]
    pieces = [piece for piece in pieces if len(piece) > 1]  # a single node has no place relative to others
    moved, changes = np.zeros(len(points)), np.zeros((REDRAWN, len(misfits)))
    try:
        for seed in range(REDRAWN):
            other, left = place(rounding.redrawn(seed))
            if not determined(other)[component >= 0].all() or len(left) != len(misfits):
                return Known(float("inf"))
            for piece in pieces:  # in the same place, relative to the diameter
                x, y = (one[piece] - one[piece].mean(axis=0) for one in (points, other))
                factor = 1.0 if sized else (x * y).sum() / (y * y).sum()
                moved[piece] += np.square(x - factor * y).sum(axis=1) / np.square(np.ptp(x, axis=0)).sum()
            mirrored = not sized and np.nansum(points * other) < 0
            changes[seed] = (-left if mirrored else left) - misfits
    except GeometryError:
        return Known(float("inf"))
    # A weak equation moves nodes in one way only, so that few draws say little about its scale: its upper bound counts,
    # and which numbers happen to be drawn does not decide.
    variance = moved.max(initial=0.0) / chdtri(REDRAWN, 1 - CONFIDENCE)
    return Known(SIGMAS * float(np.sqrt(variance)), _explained(misfits, changes))


def _explained(misfits: NDArray[np.float64], changes: NDArray[np.float64]) -> bool:
    """Whether misfits (m,) are no larger than changes (k, m) of them, by an F test, or as arithmetic leaves them.

    Misfits depend on each other: that of few degrees of freedom shows by changes that are alike or opposite.
    """
    if (np.abs(misfits) <= LAST_DIGITS).all():  # as in regular meshes, whatever the numbers are
        return True
    products, draws = changes @ changes.T, len(changes)
    size = np.trace(products) / draws
    if not size > 0:
        return False
    alike = (np.square(products).sum() - np.square(products.diagonal()).sum()) / (draws * (draws - 1))
    freedom = max(1.0, size**2 / alike)
    bound = fdtri(freedom, draws * freedom, 1 - CONFIDENCE)
    return bool(misfits @ misfits <= size * max(NOISY**2, bound))
