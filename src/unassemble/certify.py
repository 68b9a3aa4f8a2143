"""The certificate: the operator re-assembled on the mesh as written, held against the matrix.

Knows nothing of how the mesh was found, and imports no solver.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtr

from .budget import AT_ONCE
from .certify_elements import corners_of, functions, masses, rule_of
from .tolerances import CERTIFIED

_CELLS = AT_ONCE // 100  # whose products have about a hundred numbers each


@dataclass(frozen=True, eq=False)
class Terms:
    """What a matrix S (c L + s M) S has besides c L, and nothing else on its diagonal."""

    diagonal: NDArray[np.float64]  # (n,) A_ii of the matrix
    reaction: float = 0.0  # s
    lumped: bool = False  # whether M is diagonal: the sums of the consistent one's rows
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
    flipped: NDArray[np.int64]  # (f,) cells that are flat or turned over: with any of them a mesh is not planar

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
    blocks: Mapping[str, NDArray],
    factors: Mapping[str, NDArray],
    *,
    rules: Mapping[str, str] = MappingProxyType({"triangle": "degree 1"}),
    tensor: tuple[float, float, float] | None = None,
    terms: Terms | None = None,
) -> Certificate:
    """Re-assemble factor * div(K grad) with isoparametric elements and compare off-diagonal entries.

    With further terms the diagonal as well. `edges` (e, 2): pairs i < j of the matrix; `entries` (e,): A_ij; `points`
    (n, 2); `blocks`: cells (m, k) by meshio's names and in its order; `factors` (m,) of each: the c of each cell's
    piece; `rules`: quadrature of each, see :func:`.certify_elements.rule_of`; `tensor`: kxx, kxy and kyy of K, the
    identity by default. Cells are flipped that are not right side out in each corner and at each point of the
    quadrature; they count through all kinds.
    """
    (kxx, kxy, kyy), n = tensor or (1.0, 0.0, 1.0), len(points)
    keys, values, flipped, first = [], [], [], 0
    for name, cells in blocks.items():
        at, weights = rule_of(rules[name])
        _, phi_s, phi_t = functions(name, at)
        _, corner_s, corner_t = functions(name, corners_of(name))
        a, b = np.triu_indices(cells.shape[1], 1 if terms is None else 0)
        for start in range(0, len(cells), _CELLS):
            some = cells[start : start + _CELLS]
            x, y = (points[some] - points[some[:, :1]]).transpose(2, 0, 1)  # digits of differences, not of coordinates
            xs, ys, xt, yt = x @ phi_s.T, y @ phi_s.T, x @ phi_t.T, y @ phi_t.T
            determinant = xs * yt - xt * ys
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a flat cell certifies nothing
                scaled = weights / np.abs(determinant)
                ss = scaled * (kxx * yt**2 - 2 * kxy * xt * yt + kyy * xt**2)
                st = scaled * (kxx * ys * yt - kxy * (xs * yt + xt * ys) + kyy * xs * xt)
                tt = scaled * (kxx * ys**2 - 2 * kxy * xs * ys + kyy * xs**2)
                value = (
                    ss @ (phi_s[:, a] * phi_s[:, b])
                    - st @ (phi_s[:, a] * phi_t[:, b] + phi_t[:, a] * phi_s[:, b])
                    + tt @ (phi_t[:, a] * phi_t[:, b])
                )
            at_corner = (x @ corner_s.T) * (y @ corner_t.T) - (x @ corner_t.T) * (y @ corner_s.T)
            right = (determinant > 0).all(axis=1) & (at_corner > 0).all(axis=1)
            flipped.append(first + start + np.flatnonzero(~right))
            keys.append((np.minimum(some[:, a], some[:, b]) * n + np.maximum(some[:, a], some[:, b])).ravel())
            value = value * factors[name][start : start + _CELLS, None]
            if terms is not None and terms.reaction:
                value += terms.reaction * masses(name, x, y, lumped=terms.lumped)
            values.append(value.ravel())
        first += len(cells)
    places = np.divmod(np.concatenate(keys), n)
    return compared(n, edges, entries, places, np.concatenate(values), np.concatenate(flipped), terms)


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
