"""Independent errors of known size in the entries: what they leave of row sums, and what they make of lengths."""

import numpy as np
from numpy.typing import NDArray

from ..certify import chi_square_verdict
from ..linalg.responses import SamplingOptions, noise_blocks
from ..matrix import OperatorMatrix
from .heron import areas_cotangents, blocks_of, summed
from .program import Normal


def row_sum_test(matrix: OperatorMatrix, sigma: float) -> dict[str, float]:
    """Whether rows sum to zero but for errors of standard deviation `sigma` in the entries, the diagonal's included.

    The sums of rows with k and l entries have the correlation 1 / sqrt(k l) if these share one: of as many sums, the
    squares vary as those of tr(R^2) / n times fewer independent ones (Satterthwaite).
    """
    count = np.bincount(matrix.edges.ravel(), minlength=matrix.n) + 1
    used = count > 1
    shared = 2 * float((1 / count[matrix.edges].prod(axis=1)).sum())
    return chi_square_verdict(
        (matrix.row_sums / (sigma * np.sqrt(count)))[used],
        int(used.sum()),
        sigma,
        repeats=1 + shared / float(used.sum()),
    )


def scale_deviation(squared: NDArray, opposite: NDArray) -> float:
    """Standard deviation of c for errors of standard deviation 1 in the entries: |u| / F(u)."""
    area, _ = areas_cotangents(squared[opposite])
    return float(np.linalg.norm(squared) / (2 * area.sum()))


def length_deviations(
    squared: NDArray, opposite: NDArray, options: SamplingOptions | None = None
) -> NDArray[np.float64]:
    """Standard deviations (e,) of edge lengths of mean 1, for errors of standard deviation 1 in the weights A_ij / c.

    Of one piece, from the squared lengths (e,) and the edge that faces each corner (m, 3).

    With F twice the area and w = F', errors a in the weights change u by the solution d of F'' d = a - w (a.u) / (w.u),
    which fixes the change of c, and lengths by d / 2 l, without a change of their mean.
    """
    sides = squared[opposite]
    area, cotangents = areas_cotangents(sides)
    weights = summed(opposite, cotangents / 2, len(squared))
    ones = np.ones(len(area))
    normal = Normal(opposite, len(squared))
    factor = normal.factorised(2 * blocks_of(sides, area, cotangents, ones, -ones), 1e-10)
    length = np.sqrt(squared)
    total = np.zeros(len(squared))
    for noise in noise_blocks(len(squared), options or SamplingOptions()):
        told = noise - weights[:, None] * (squared @ noise) / (weights @ squared)
        change = factor.solve(told * squared[:, None]) * (length / 2)[:, None]
        change -= length[:, None] * change.mean(axis=0) / length.mean()
        total += (change**2).sum(axis=1)
    normal.release()
    return np.sqrt(total)
