"""A mesh held against its matrix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..certify import Certificate
from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED, SUSPICIOUS
from .noise import Noise, NoiseTest


@dataclass(frozen=True, eq=False)
class Held:
    """A mesh held against the matrix, and against the errors of the entries where these are known."""

    certificate: Certificate
    errors: NDArray[np.float64] | None  # (k,) standard deviations of the entries that the certificate compares
    test: NoiseTest | None

    @classmethod
    def of(
        cls,
        certificate: Certificate,
        stored: OperatorMatrix,
        noise: Noise | None,
        freedom: int,
        factors: NDArray[np.float64],
    ) -> Held:
        """A certificate, and the test where noise is known; `freedom`: entries less unknowns; `factors`: c."""
        if noise is None:
            return cls(certificate, None, None)
        errors = noise.at(certificate.pairs, stored)
        return cls(certificate, errors, NoiseTest.of(noise, certificate.differences / errors, freedom, factors))

    def fields(self, count: int, first: NDArray | None = None) -> dict[str, Any]:
        """What every result says of it, with the worst `count` entries, those of `first` (k, 2) before others."""
        worst, misfits = self.certificate.worst(count, noise=self.errors, first=first)
        return {
            "backward_error": self.certificate.backward_error,
            "worst_entries": worst,
            "worst_misfits": misfits,
            "chi_square": self.test.figures if self.test else None,
            "n_entries": len(self.certificate.misfits),
            "n_fitting": int(np.count_nonzero(self.certificate.misfits <= CERTIFIED)),
        }

    @property
    def by_noise(self) -> bool:
        """Whether noise decides: there is something to test, and no exact fit makes too large a noise harmless.

        Entries of few digits that a mesh has exactly may be no rounded ones.
        """
        test, error = self.test, self.certificate.backward_error
        if test is None or test.freedom <= 0:  # no more entries than unknowns
            return False
        short = error <= SUSPICIOUS or not test.passed
        return not (error <= CERTIFIED and (test.drowned or (test.noise.digits is not None and short)))

    @property
    def passes(self) -> bool:
        """Whether the numbers alone would do for a certificate."""
        if len(self.certificate.flipped):
            return False
        if self.test and self.by_noise:
            return self.test.passed
        return self.certificate.backward_error <= CERTIFIED
