"""Edges of large meshes as an image: how much ink falls on each pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_CHUNK = 1 << 20
_OVERSAMPLING = 2


def ink(start: NDArray, stop: NDArray, low: NDArray, high: NDArray, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Length of line in each pixel, in pixels.

    Each line is replaced by points half a pixel apart or nearer, on a grid twice as fine as the image.

    Parameters
    ----------
    start, stop : (e, 2) float64
        Ends of the lines.
    low, high : (2,) float64
        Corners of the image.
    shape : (rows, columns)
        Row 0 is the lowest.
    """
    fine = np.array(shape) * _OVERSAMPLING
    to_pixel = fine[::-1] / (high - low)
    image = np.zeros(int(fine.prod()))
    for first in range(0, len(start), _CHUNK):
        a = (start[first : first + _CHUNK] - low) * to_pixel
        b = (stop[first : first + _CHUNK] - low) * to_pixel
        _splat(image, a, b - a, fine)
    image = image.reshape(shape[0], _OVERSAMPLING, shape[1], _OVERSAMPLING).sum(axis=(1, 3))
    return image / _OVERSAMPLING


def _splat(image: NDArray, origin: NDArray, line: NDArray, shape: NDArray) -> None:
    """Spread the length of each line over points one fine pixel apart."""
    length = np.hypot(line[:, 0], line[:, 1])
    count = np.ceil(length).astype(np.int64).clip(1)
    which = np.repeat(np.arange(len(count)), count)
    position = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    at = origin[which] + ((position + 0.5) / count[which])[:, None] * line[which]
    column = at[:, 0].astype(np.int64).clip(0, shape[1] - 1)
    row = at[:, 1].astype(np.int64).clip(0, shape[0] - 1)
    image += np.bincount(row * shape[1] + column, (length / count)[which], len(image))
