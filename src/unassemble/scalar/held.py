"""A mesh held against its matrix, and against the errors of the entries where these are known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..certificate import Certificate, chi_square_verdict
from ..tolerances import CERTIFIED, CHANCE, CONFIDENCE, LARGEST_NOISE, SUSPICIOUS
from .noise import Noise
from .solving import Solved


@dataclass(frozen=True, eq=False)
class PlanarComparison:
    """A certificate, and where noise is known the test of its misfit."""

    certificate: Certificate
    solved: Solved

    @property
    def limit(self) -> float:
        """Standard deviation of noise that drowns the cotangents."""
        return LARGEST_NOISE * float(np.abs(self.solved.scales).min())

    @cached_property
    def errors(self) -> NDArray[np.float64] | None:
        """(k,) standard deviations of the entries that the certificate compares."""
        return self.solved.noise.at(self.certificate.pairs, self.solved.stored) if self.solved.noise else None

    @cached_property
    def figures(self) -> dict[str, float]:
        """See :func:`unassemble.certificate.chi_square_verdict`; empty without noise."""
        if self.solved.noise is None:
            return {}
        misfit = self.certificate.differences / np.asarray(self.errors)
        return chi_square_verdict(
            misfit, self.solved.freedom, self.solved.noise.sigma, repeats=self.solved.noise.repeats
        )

    def __str__(self) -> str:
        figures = [self.figures[name] for name in ("statistic", "degrees_of_freedom", "p_value")]
        return "(chi-square {:.4g} with {:.4g} degrees of freedom, p = {:.3g})".format(*figures)

    @property
    def backward_error(self) -> float:
        """The largest misfit, relative to the largest off-diagonal entry of its row."""
        return self.certificate.backward_error

    def worst(self, count: int, first: NDArray | None = None) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, and their misfits; those of `first`, (k, 2), before others."""
        return self.certificate.worst(count, noise=self.errors, first=first)

    def fields(self) -> dict[str, Any]:
        """What every planar mesh says of it."""
        return {"chi_square": self.figures or None, **self.certificate.counts()}

    @property
    def drowned(self) -> bool:
        """Whether almost any mesh would pass."""
        return self.solved.noise is not None and self.solved.noise.sigma > self.limit

    @property
    def coincidence(self) -> bool:
        """Whether entries without a mesh may be fitted to within their rounding by chance; noise given is believed."""
        if self.solved.noise is None or self.solved.noise.digits is None:
            return False
        chance = (
            self.solved.freedom
            * self.solved.noise.different
            * np.log(self.solved.noise.sigma * LARGEST_NOISE / self.limit)
        )
        return bool(chance > np.log(CHANCE))

    @property
    def likely(self) -> bool:
        """Whether the misfit is not improbably large."""
        return min(self.figures.get("p_value", 0.0), self.figures.get("largest_p_value", 0.0)) >= CONFIDENCE

    @property
    def by_noise(self) -> Noise | None:
        """The noise, if it decides: there is something to test, and no exact fit makes too large a noise harmless.

        Entries of few digits that a mesh has exactly may be no rounded ones.
        """
        error = self.certificate.backward_error
        if self.solved.noise is None or self.solved.freedom <= 0:  # no more entries than unknowns
            return None
        short = error <= SUSPICIOUS or not self.passed
        harmless = error <= CERTIFIED and (self.drowned or (self.solved.noise.digits is not None and short))
        return None if harmless else self.solved.noise

    @property
    def passed(self) -> bool:
        """Whether the misfit is likely, and that says something."""
        return self.likely and not (self.drowned or self.coincidence)

    @property
    def passes(self) -> bool:
        """Whether the numbers alone would do for a certificate."""
        good = self.passed if self.by_noise else self.certificate.backward_error <= CERTIFIED
        return good and not len(self.certificate.flipped)
