"""The certificate: the operator re-assembled on the mesh as written, held against the matrix.

Knows nothing of how the mesh was found, and imports no solver.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtr

from .tolerances import CERTIFIED


@dataclass(frozen=True, eq=False)
class Terms:
    """What a matrix S (c L + s M) S has besides c L, and nothing else on its diagonal."""

    diagonal: NDArray[np.float64]  # (n,) A_ii of the matrix
    reaction: float = 0.0  # s
    lumped: bool = False  # whether M is diagonal: a third of its area from each triangle to each of its corners
    scaling: NDArray[np.float64] | None = None  # (n,) S; the identity by default


@dataclass(frozen=True, eq=False)
class Certificate:
    """How well a mesh explains a matrix."""

    # largest difference between an off-diagonal entry and the re-assembled one, relative to the largest off-diagonal
    # entry of its row
    backward_error: float
    # (k, 2) rows and columns of all entries of either, upper triangle; with further terms the diagonal as well
    pairs: NDArray[np.int64]
    misfits: NDArray[np.float64]  # (k,) their differences, relative in the same way
    differences: NDArray[np.float64]  # (k,) re-assembled minus given
    flipped: NDArray[np.int64]  # (f,) triangles that are flat or turned over: with any of them a mesh is not planar

    def worst(
        self, count: int = 10, *, noise: NDArray | None = None, first: NDArray | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, worst first, and their misfits.

        Those above the bound, by misfit relative to the row; or, for noise of standard deviations (k,), those off by
        more than three of them, by that. Pairs `first`, (k, 2) with i < j, come before all others.
        """
        size = self.misfits if noise is None else np.abs(self.differences) / noise
        above = np.flatnonzero(size > (CERTIFIED if noise is None else 3))
        order = above[np.argsort(-size[above], kind="stable")][:count]
        if first is not None and len(first):
            n = int(self.pairs.max()) + 1
            key = self.pairs[:, 0] * n + self.pairs[:, 1]  # ascending
            leading = np.searchsorted(key, first[:, 0] * n + first[:, 1])
            order = np.concatenate([leading, order[~np.isin(order, leading)]])[:count]
        return self.pairs[order], self.misfits[order]


def certify(
    edges: NDArray,
    entries: NDArray,
    points: NDArray,
    triangles: NDArray,
    factor: NDArray,
    tensor: tuple[float, float, float] | None = None,
    terms: Terms | None = None,
) -> Certificate:
    """Re-assemble factor * div(K grad) with P1 elements and compare off-diagonal entries; with further terms all.

    `edges` (e, 2): pairs i < j of the matrix; `entries` (e,): A_ij; `points` (n, 2); `triangles` (m, 3); `factor` (m,):
    the factor c of each triangle's piece; `tensor`: kxx, kxy and kyy of K, the identity by default; `terms`: what the
    matrix has besides, where it has.
    """
    kxx, kxy, kyy = tensor or (1.0, 0.0, 1.0)
    corners = [np.ascontiguousarray(column) for column in triangles.T]
    at = [points[corner] for corner in corners]
    (ux, uy), (wx, wy) = (at[1] - at[0]).T, (at[2] - at[0]).T
    flipped = np.flatnonzero(~(ux * wy - uy * wx > 0))
    # With side s_i facing corner i turned by a right angle, grad(phi_i) = s_i / (2 area), and the turned tensor is the
    # adjugate of K: the entry is s_i' adj(K) s_j / (4 area), areas taken positive.
    sides = [(b - a).T for a, b in (at[1:], at[2::-2], at[:2])]
    ends, values = [], []
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a flat triangle certifies nothing
        double = np.abs(sides[0][0] * sides[1][1] - sides[0][1] * sides[1][0])
        weight = factor / (2 * double)
        for i, j in ((0, 1), (1, 2), (2, 0), *(((0, 0), (1, 1), (2, 2)) if terms else ())):
            (xi, yi), (xj, yj) = sides[i], sides[j]
            product = kyy * (xi * xj) - kxy * (xi * yj + yi * xj) + kxx * (yi * yj)
            ends.append((np.minimum(corners[i], corners[j]), np.maximum(corners[i], corners[j])))
            value = weight * product
            if terms is not None:  # int s phi_i phi_j is s area (1 + delta_ij) / 12
                part = (6 if i == j else np.inf) if terms.lumped else (12 if i == j else 24)
                value = value + terms.reaction / part * double
            values.append(value)
    rows, columns = (np.concatenate(part) for part in zip(*ends, strict=True))
    return compared(len(points), edges, entries, (rows, columns), np.concatenate(values), flipped, terms)


def compared(
    n: int,
    edges: NDArray,
    entries: NDArray,
    places: tuple[NDArray, NDArray],
    values: NDArray,
    flipped: NDArray,
    terms: Terms | None = None,
) -> Certificate:
    """The entries of a mesh of n points, added up of values at rows i and columns j >= i, against those of a matrix."""
    summed = sp.coo_array((values, places), shape=(n, n)).tocsr()
    summed.sort_indices()
    key, value = np.repeat(np.arange(n), np.diff(summed.indptr)) * n + summed.indices, summed.data
    if terms is not None and terms.scaling is not None:
        value = value * terms.scaling[key // n] * terms.scaling[key % n]
    given = edges[:, 0] * n + edges[:, 1]
    if terms is not None:
        given, order = np.unique(np.concatenate([given, np.arange(n) * (n + 1)]), return_index=True)
        edges, entries = np.column_stack([given // n, given % n]), np.concatenate([entries, terms.diagonal])[order]
    if np.array_equal(key, given):
        pairs, difference = edges, value - entries
    else:
        both = np.sort(np.concatenate([key, given]))
        union = both[np.append(True, both[1:] != both[:-1])]
        difference = np.zeros(len(union))
        difference[np.searchsorted(union, key)] += value
        difference[np.searchsorted(union, given)] -= entries
        pairs = np.column_stack([union // n, union % n])
    size = np.zeros(n)
    apart = edges[:, 0] != edges[:, 1]
    for end in edges[apart].T:
        np.maximum.at(size, end, np.abs(entries[apart]))
    reference = np.minimum(size[pairs[:, 0]], size[pairs[:, 1]])
    misfits = relative(difference, reference)
    return Certificate(float(misfits.max(initial=0.0)), pairs, misfits, difference, flipped)


def relative(difference: NDArray, reference: NDArray) -> NDArray[np.float64]:
    """Absolute difference relative to a reference; infinite where it is not a number."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(difference == 0, 0.0, np.abs(difference) / reference)
    return np.where(np.isnan(ratio), np.inf, ratio)


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
