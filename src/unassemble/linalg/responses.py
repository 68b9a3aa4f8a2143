"""Responses of an estimate to independent errors of its data, added up one by one or by random patterns."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SamplingOptions:
    """How responses to the errors of entries are added up."""

    exact_up_to: int = 3000  # edges whose responses are computed one by one; above, random sign patterns stand in
    samples: int = 400  # of these: the relative standard error of a standard deviation is 1 / sqrt(2 samples)
    block: int = 64  # right-hand sides that are solved for together


def noise_blocks(n_edges: int, options: SamplingOptions) -> Iterator[NDArray[np.float64]]:
    """Columns r with sum r r' = I, exactly or in the mean."""
    exact, rng = n_edges <= options.exact_up_to, np.random.default_rng(0)
    count = n_edges if exact else options.samples
    for start in range(0, count, options.block):
        width = min(options.block, count - start)
        if exact:
            yield np.eye(n_edges, width, -start)
        else:
            yield rng.choice([-1.0, 1.0], size=(n_edges, width)) / np.sqrt(count)
