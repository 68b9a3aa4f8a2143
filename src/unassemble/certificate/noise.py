"""Whether errors of known size explain what a mesh leaves of the entries."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtr


def chi_square_verdict(misfit: NDArray, freedom: int, sigma: float, *, repeats: float = 1.0) -> dict[str, float]:
    """Tests of a misfit against independent Gaussian noise.

    The sum of squares has a chi-square distribution; but on a large mesh it does not notice a single wrong entry. So
    the largest misfit is tested as well. No misfit varies more than the noise itself, so that the normal tail, times
    the number of entries, bounds its p-value. Errors of rounding are spread evenly: there both p-values are too large.

    `misfit` (k,): re-assembled minus given entries, each over the standard deviation of its noise. `freedom`: entries
    less fitted unknowns. `sigma`: the standard deviation of typical entries. `repeats`: how many entries share an
    error: of the sum of squares, and of the degrees of freedom, only one part in so many counts.
    """
    with np.errstate(over="ignore"):
        statistic = float(np.sum(misfit**2)) / repeats
        largest = float(np.abs(misfit).max(initial=0.0))
    finite = freedom > 0 and np.isfinite(statistic)
    return {
        "statistic": statistic,
        "degrees_of_freedom": freedom / repeats,
        "p_value": float(chdtrc(freedom / repeats, statistic)) if finite else 0.0,
        "sigma": sigma,
        "largest": largest,
        "largest_p_value": min(1.0, float(2 * len(misfit) * ndtr(-largest))) if finite else 0.0,
    }
