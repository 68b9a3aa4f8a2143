"""Triangles by their squared side lengths: areas, angles, and the derivatives of areas."""

import numpy as np
from numpy.typing import NDArray

from ..tolerances import ROUNDED

# d(u_1 + u_2 - u_0)/du and so on: sums that are four areas times the cotangents.
_SIGNS = np.array([[-1, 1, 1], [1, -1, 1], [1, 1, -1]], dtype=np.float64)


def heron(sides: NDArray) -> NDArray[np.float64]:
    """(m,) 16 times the squared area of triangles with squared side lengths (m, 3); negative where there is none.

    As a difference of two squares that share the shortest side, which loses the fewest digits.
    """
    low, middle, high = np.sort(sides, axis=1).T
    return np.asarray(4 * low * middle - (high - low - middle) ** 2)


def areas_cotangents(sides: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Areas (m,), and cotangents (m, 3) of the angles that face the sides."""
    area = np.sqrt(heron(sides)) / 4
    return area, np.asarray(sides @ _SIGNS / (4 * area)[:, None])


def angles(sides: NDArray) -> NDArray[np.float64]:
    """(m, 3) angles that face the sides."""
    return np.arctan2(np.sqrt(heron(sides))[:, None], sides @ _SIGNS)


def longest_step(sides: NDArray, change: NDArray) -> NDArray[np.float64]:
    """(m,) least t > 0 at which sides + t change is a triangle without area: Heron's formula is a quadratic in t."""

    def product(a: NDArray, b: NDArray) -> NDArray:
        return a.sum(axis=1) * b.sum(axis=1) - 2 * (a * b).sum(axis=1)

    constant, half, square = heron(sides), product(sides, change), product(change, change)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = half**2 - constant * square
        root = np.sqrt(np.where(np.abs(root) <= ROUNDED * half**2, 0, root))  # where all sides shrink alike it is 0
        slope = root - half  # not a number where the area never vanishes
        return np.where(slope > 0, constant / slope, np.inf)


def summed(opposite: NDArray, values: NDArray, size: int) -> NDArray[np.float64]:
    """(size,) sums over the corners that face each edge."""
    return np.asarray(np.bincount(opposite.ravel(), values.ravel(), size), np.float64)


def blocks_of(sides: NDArray, area: NDArray, cotangents: NDArray, first: NDArray, outer: NDArray) -> NDArray:
    """(m, 3, 3) minus second derivatives of phi(S), in units of the sides.

    S'' = (signs - cot cot') / 16 S, S' = cot / 4; `outer` is S phi'' - phi'.
    """
    unit = sides / np.sqrt(16 * area)[:, None]
    flat = cotangents * unit
    second = first[:, None, None] * (_SIGNS * unit[:, :, None] * unit[:, None, :])
    return np.asarray(-second - outer[:, None, None] * (flat[:, :, None] * flat[:, None, :]))
