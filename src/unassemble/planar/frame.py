"""Similarity frames: the gauge of a mesh that is known up to similarity and reflection."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..tolerances import ALIKE, LITTLE


@dataclass(frozen=True)
class Similarity:
    """z -> turn * z + shift, or turn * conj(z) + shift."""

    turn: complex
    shift: complex
    mirror: bool = False

    def __call__(self, z: NDArray) -> NDArray:
        """Image of complex positions."""
        return self.turn * (np.conj(z) if self.mirror else z) + self.shift


def canonical_frame(z: NDArray, edges: NDArray, boundary: NDArray) -> tuple[Similarity, str | None]:
    """The frame that positions have where nothing else is known.

    Centroid at the origin, mean edge length 1, first principal axis along x, and the mirror image and half
    turn for which the third moments of x and y are positive. Where second moments are equal in all directions the
    axes follow the edges, those of the boundary before others.

    `z` (n,) complex; `edges` (e, 2); `boundary` (b, 2).

    Returns the frame, and which part of the choice is arbitrary because moments tie or vanish, or None.
    """
    centre = z.mean()
    size = float(np.abs(z[edges[:, 0]] - z[edges[:, 1]]).mean())
    d = (z - centre) / size
    second = (d * d).sum()  # of argument twice the principal axis', and modulus the difference of the moments
    spread = float((np.abs(d) ** 2).sum())
    tie = not abs(second) > ALIKE * spread
    axis = _along_edges(d, edges, boundary) if tie else np.exp(-0.5j * np.angle(second))
    x, y = (axis * d).real, (axis * d).imag
    third = [float((t * t * t).sum()) for t in (x, y)]  # a power would take ten times as long
    sure = [abs(m) > ALIKE * float((np.abs(t) ** 3).sum()) for m, t in zip(third, (x, y), strict=True)]
    flip_x, flip_y = third[0] < 0, third[1] < 0
    turn = axis / size * (-1 if flip_x else 1)
    mirror = flip_x != flip_y
    if mirror:  # conjugation turns y over after the half turn has set x
        turn = np.conj(turn)
    shift = -turn * (np.conj(centre) if mirror else centre)
    same = "second moments are equal, so that axes follow the edges" if tie else "third moments vanish"
    arbitrary = f"{same}, and the choice among symmetric positions is arbitrary" if tie or not all(sure) else None
    return Similarity(complex(turn), complex(shift), mirror), arbitrary


def _along_edges(z: NDArray, edges: NDArray, boundary: NDArray) -> complex:
    """The turn that lays edges along the axes: the fourth powers of their directions agree, or else the sixth ones."""
    for some, power in ((boundary, 4), (edges, 4), (boundary, 6), (edges, 6)):
        line = z[some[:, 1]] - z[some[:, 0]]
        length = np.abs(line)
        mean = np.sum(length * (line / np.where(length > 0, length, 1.0)) ** power) / max(float(length.sum()), 1e-300)
        if abs(mean) > LITTLE:
            return complex(np.exp(-1j * np.angle(mean) / power))
    return 1.0


def fit_similarity(z: NDArray, target: NDArray, *, mirror: bool = False) -> tuple[Similarity, float]:
    """Least-squares similarity from positions to targets, both (k,) complex with k >= 2.

    Returns it and the root mean square misfit.
    """
    source = np.conj(z) if mirror else z
    a, b = source - source.mean(), target - target.mean()
    turn = complex(np.vdot(a, b) / np.vdot(a, a))
    shift = complex(target.mean() - turn * source.mean())
    misfit = float(np.sqrt(np.mean(np.abs(turn * source + shift - target) ** 2)))
    return Similarity(turn, shift, mirror), misfit


def collinear(z: NDArray) -> bool:
    """Whether points (k,) lie on a line to about six digits."""
    d = z - z.mean()
    return abs((d * d).sum()) > (1 - 1e-12) * (np.abs(d) ** 2).sum()
