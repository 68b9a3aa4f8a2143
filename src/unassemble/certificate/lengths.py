"""Whether edge lengths explain a matrix: the certificate of curved surfaces, which shares nothing with the solver."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..tolerances import CERTIFIED
from .comparison import Certificate, compared, relative


@dataclass(frozen=True, eq=False)
class MetricCertificate:
    """How well edge lengths explain a matrix."""

    entries: Certificate  # of the off-diagonal entries; `flipped` are triangles whose sides do not meet
    # the diagonal matrix D of A = c L + D that comes nearest to the row sums: "zero", "constant", a multiple of the
    # identity, or "areas", a multiple of the lumped mass matrix of a single piece
    diagonal: str
    # (n,) differences of the row sums from those of that D, relative to the largest off-diagonal entry of the row
    row_misfits: NDArray[np.float64]


def certify_metric(
    edges: NDArray, entries: NDArray, diagonal: NDArray, lengths: NDArray, triangles: NDArray, factor: NDArray
) -> MetricCertificate:
    """Re-assemble factor * Laplacian from edge lengths (e,) alone and compare entries (e,), by triangle in its plane.

    `edges` (e, 2) are pairs i < j in lexicographic order, with lengths of NaN where they belong to no triangle;
    `diagonal` (n,) is A_ii, and `factor` (m,) the c of each triangle's piece.
    """
    n = len(diagonal)
    key = edges[:, 0] * n + edges[:, 1]
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [n, 1]
    row = np.minimum(np.searchsorted(key, ends), len(key) - 1)
    if not np.array_equal(key[row], ends):
        raise ValueError("a triangle has a side that is no edge")
    a, b, c = lengths[row].T
    # Kahan: the area of a triangle with sides a >= b >= c, without loss of digits; and the sides meet in two points.
    low, middle, high = np.sort(lengths[row], axis=1).T
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = (low - (high - middle)) > 0
        quad = (high + (middle + low)) * (low - (high - middle)) * (low + (high - middle)) * (high + (middle - low))
        area = np.sqrt(np.where(inside, quad, np.nan)) / 4
        # cot(angle facing a) = (b^2 + c^2 - a^2) / 4 area, the difference of squares as a product.
        sums = np.stack([b * b + (c - a) * (c + a), c * c + (a - b) * (a + b), a * a + (b - c) * (b + c)], axis=1)
        assembled = np.bincount(row.ravel(), (-factor[:, None] * sums / (8 * area[:, None])).ravel(), len(key))
    covered = np.bincount(row.ravel(), minlength=len(key)) > 0
    found = compared(
        n, edges, entries, (edges[:, 0], edges[:, 1]), np.where(covered, assembled, 0.0), np.flatnonzero(~inside)
    )
    size = np.zeros(n)
    sums_of_rows = np.asarray(diagonal, np.float64)
    for end in edges.T:
        np.maximum.at(size, end, np.abs(entries))
        sums_of_rows = np.asarray(sums_of_rows + np.bincount(end, entries, n))
    shapes = {"zero": np.zeros(n), "constant": np.ones(n)}
    if (factor == factor[0]).all():  # else each piece has a unit of area of its own
        shapes["areas"] = np.asarray(np.bincount(triangles.ravel(), np.repeat(area, 3), n))
    held = {name: relative(sums_of_rows - _multiple(shape, sums_of_rows, size), size) for name, shape in shapes.items()}
    nearest = min(held, key=lambda name: float(held[name].max()))
    if held["zero"].max() <= CERTIFIED:
        nearest = "zero"
    return MetricCertificate(found, nearest, held[nearest])


def _multiple(shape: NDArray, wanted: NDArray, size: NDArray) -> NDArray[np.float64]:
    """The multiple of `shape` next to `wanted`, with errors in units of `size`."""
    there = size > 0
    unit = size[there].min(initial=1.0)  # nothing overflows
    one, other = shape[there] * (unit / size[there]), wanted[there] / size[there]
    square = float(one @ one)
    return np.asarray(shape * unit * (float(one @ other) / square if square > 0 else 0.0))
