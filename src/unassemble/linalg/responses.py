"""Responses of an estimate to independent errors of its data, added up one by one or by random patterns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SamplingOptions:
    """How responses to the errors of entries are added up.

    Attributes
    ----------
    exact_up_to : int
        Edges whose responses are computed one by one; above, random sign patterns stand in for them.
    samples : int
        Of these patterns: the relative standard error of a standard deviation is 1 / sqrt(2 samples).
    block : int
        Right-hand sides that are solved for together.
    """

    exact_up_to: int = 3000
    samples: int = 400
    block: int = 64


def noise_blocks(n_edges: int, options: SamplingOptions) -> Iterator[NDArray[np.float64]]:
    """Columns r with sum r r' = I, exactly or in the mean."""
    if n_edges <= options.exact_up_to:
        for start in range(0, n_edges, options.block):
            width = min(options.block, n_edges - start)
            block = np.zeros((n_edges, width))
            block[start + np.arange(width), np.arange(width)] = 1
            yield block
        return
    rng = np.random.default_rng(0)
    for start in range(0, options.samples, options.block):
        width = min(options.block, options.samples - start)
        yield rng.choice([-1.0, 1.0], size=(n_edges, width)) / np.sqrt(options.samples)
