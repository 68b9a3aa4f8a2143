"""Numbers that were rounded: to decimal digits, to decimals, or to single precision.

Nearly all doubles have more digits than that, so that a matrix all of whose entries have few was rounded, and by how
much can be read off it. Whole numbers, halves and quarters have few digits by nature and say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..tolerances import LAST_DIGITS

_DIGITS = range(3, 13)  # decimal ones to look for; fewer do not tell what is rounded from what is exact
_SHORT, _NEARLY, _SINGLE = 12, 20, 24  # binary digits: of numbers exact by nature; of nearly all singles; of singles


@dataclass(frozen=True, eq=False)
class Digits:
    """The precision that numbers were rounded to."""

    name: str  # ``"6 digits"``, ``"6 decimals"`` or ``"single precision"``
    # (k,) of the last place of each number. That of zeros is 0, unless they were rounded to decimals as well.
    unit: NDArray[np.float64]

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Digits | None:
        """The precision of some numbers (k,); None where they have not been rounded, or not so that it shows."""
        size = np.abs(values)
        size = size[size > LAST_DIGITS * size.max(initial=0.0)]  # less is what cancelling leaves, in no few digits
        sample = size[:: max(1, len(size) // SAMPLE)]
        if not (_are_binary(sample, _SINGLE).all() or _have(sample, _DIGITS[-1]).all()):  # as in most matrices
            return None
        size = np.unique(size)
        told = size[~_are_binary(size, _SHORT)]
        if len(told) < 2:  # one may be a factor that somebody chose
            return None
        if _are_binary(size, _SINGLE).all() and _need_more(_are_binary(told, _NEARLY)):
            last_bit = np.ldexp(1.0, np.frexp(values)[1] - _SINGLE)
            return cls("single precision", np.where(values != 0, last_bit, 0.0))
        digits = next((d for d in _DIGITS if _have(sample, d).all() and _have(size, d).all()), None)
        return None if digits is None else cls._decimal(np.abs(values), size, told, digits)

    @classmethod
    def _decimal(cls, values: NDArray, size: NDArray, told: NDArray, digits: int) -> Digits | None:
        """Decimals if all numbers are multiples of one power of ten, the coarser of both, and otherwise digits."""
        exponent = _exponent(size.max()) - digits + 1
        if _are_multiples(size, exponent).all():
            rounded = exponent != 0 and _need_more(_are_multiples(told, exponent + 1))
            name = f"{-exponent:.0f} decimals" if exponent < 0 else f"{digits} digits"
            return cls(name, np.full(len(values), 10.0**exponent)) if rounded else None
        unit = np.where(values > 0, 10.0 ** (_exponent(values) - digits + 1), 0.0)
        whole = (size == np.rint(size)).all() and unit[values > 0].min() <= 1.0
        return cls(f"{digits} digits", unit) if not whole and _need_more(_have(told, digits - 1)) else None


def _need_more(coarse: NDArray[np.bool_]) -> bool:
    """Whether many of some numbers, and more than one, are not among those with a digit less.

    Of the numbers of regular meshes up to half have few digits by nature.
    """
    return bool(np.count_nonzero(~coarse) >= max(2, len(coarse) / 4))


def _exponent(size: NDArray) -> NDArray[np.float64]:
    """Of the leading digit; 0 for zeros."""
    return np.asarray(np.floor(np.log10(np.where(size > 0, size, 1.0))))


def _have(size: NDArray, digits: int) -> NDArray[np.bool_]:
    return _are_multiples(size, _exponent(size) - digits + 1)


def _are_multiples(size: NDArray, exponent: NDArray) -> NDArray[np.bool_]:
    """Whether numbers are the doubles next to whole multiples of powers of ten."""
    # Powers of ten are exact up to 10^22: dividing by one, or multiplying, errs by a last place.
    with np.errstate(over="ignore", under="ignore"):
        count = np.where(exponent < 0, size * 10.0 ** np.abs(exponent), size / 10.0 ** np.abs(exponent))
        return np.asarray(np.abs(count - np.rint(count)) <= 8 * np.finfo(float).eps * count)


def _are_binary(size: NDArray, digits: int) -> NDArray[np.bool_]:
    scaled = np.ldexp(np.frexp(size)[0], digits)
    return np.asarray(scaled == np.rint(scaled))
