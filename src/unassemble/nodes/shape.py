"""From null fields to coordinates: projecting translations out, setting aside what stays loose, choosing the gauge."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..linalg import Factorisation, svd
from ..linalg.definite import STEPS
from ..recovery import Evidence
from ..tolerances import ALIKE, CANCELLED, SINGULAR

SOFT = 2e-7  # singular values at which entries rounded to 1e-15 still give coordinates to 1e-8
MOST_FIELDS = 256
"""Fields of least misfit to look at, at most: what leaves more of them free is not placed."""
_FEW = 0.25  # share of nodes that may be loose although rows of their own are valid, or may be out of one plane


@dataclass(frozen=True, eq=False)
class Shape:
    """Coordinates of one piece."""

    # (n, d) centred, of norm one; NaN where loose: of nodes that can move while the others stay
    points: NDArray[np.float64]
    evidence: Evidence
    freedom: str = ""  # beyond translation and scale: "" or "affine"
    exact: bool = True  # whether the field is a null field, not only the best one
    ratio: float | None = None  # lambda / mu, where elements told the axes


def shape(fields: NDArray[np.float64], values: NDArray[np.float64], told: NDArray[np.bool_], rows: int) -> Shape:
    """Find the coordinates among least singular fields (n, d, k), orthonormal, with increasing singular values (k,).

    Nodes with a valid row of their own, `told` (n,), are not left loose by supports; `rows` have equations.
    GeometryError if the null space leaves more than an affine map free, or there are too few nodes.
    """
    n, d, k = fields.shape
    if k <= d:
        raise GeometryError(f"{n} nodes with valid rows are too few to tell their positions")
    common = d + 1  # translations and scale
    exact = values[d] <= SINGULAR
    count = int((values <= SINGULAR).sum()) if exact else d + 1
    null, loose = fields[..., :count], np.zeros(n, dtype=bool)
    soft = int((values <= SOFT).sum()) if exact else count
    for some in dict.fromkeys((soft, count)):  # nodes that alone can move almost freely are as good as loose
        if some <= common:
            continue
        shared, apart = set_aside(fields[..., :some], common)
        few = _FEW * n >= np.count_nonzero(apart)  # the others are determined, whatever these do
        if apart.any() and (few or 2 * np.count_nonzero(told & apart) <= np.count_nonzero(apart)):
            null, loose, count = shared, apart, some
            break
    kept = null[~loose]
    u, s, _ = svd((kept - kept.mean(axis=0)).reshape(-1, kept.shape[2]), full_matrices=False)
    others = kept.shape[2] - d  # in slender bodies rounding leaves more of the translations
    moving = u[:, :others][:, s[:others] > ALIKE].reshape(len(kept), d, -1)
    dimension = d + moving.shape[2] if exact else d
    points = np.full((n, d), np.nan)
    points[~loose], freedom = _choose(moving, exact=bool(exact))
    gap = float(values[max(count, common) :].min(initial=np.inf))
    return Shape(points, Evidence(dimension, float(values[d]), gap, rows), freedom, bool(exact))


def least_fields(
    residual: Callable[[NDArray], NDArray], solver: Factorisation, order: int, d: int, stiff: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Orthonormal fields (order, k) of least residuals, and their increasing singular values; the last is `stiff`.

    By inverse iteration with a factor of the normal matrix; fewer fields if there are no more, or too many.
    """
    count = min(4 * d, order)
    while True:
        x = np.random.default_rng(0).standard_normal((order, count))
        for _ in range(STEPS):
            x = np.linalg.qr(solver.solve(x))[0]
        x, values = singular(residual(x), x)
        if values[-1] > stiff or count >= min(order, MOST_FIELDS):
            return x, values
        count = min(2 * count, order)


def singular(residuals: NDArray, x: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Combinations of fields x (N, k) with residuals (m, k) that are singular ones, and their values, increasing."""
    _, values, v = svd(np.linalg.qr(residuals, mode="r"))
    return x @ v[::-1].T, np.concatenate([values, np.zeros(x.shape[1] - len(values))])[::-1]


def set_aside(null: NDArray, common: int) -> tuple[NDArray, NDArray[np.bool_]]:
    """Find nodes that carry fields of their own, and the fields, so many in number, that the other nodes share.

    Loose nodes move more than others in the null fields, and their own fields vanish at the others, or die out over
    some cells. So the fields that the least mobile nodes share are the body's, and what vanishes at all of these is
    loose.
    """
    n, _d, k = null.shape
    calm = np.argsort((null**2).sum(axis=(1, 2)), kind="stable")
    _, s, v = svd(null[calm[: max(n // 2, min(n, common + 1))]].reshape(-1, k), full_matrices=False)
    loose = np.zeros(n, dtype=bool)
    if (s > ALIKE * s[0]).sum() == common:
        own = np.einsum("nak,lk->nal", null, v[s <= ALIKE * s[0]])
        loose = np.abs(own).max(axis=(1, 2)) > CANCELLED
    if not loose.any() or np.count_nonzero(~loose) * null.shape[1] < common:  # too few to carry what they share
        return null, np.zeros(n, dtype=bool)
    fields = np.einsum("nak,lk->nal", null, v[:common])
    shared = np.zeros_like(fields)  # orthonormal over the others
    shared[~loose] = np.linalg.qr(fields[~loose].reshape(-1, common))[0].reshape(-1, *fields.shape[1:])
    return shared, loose


def _choose(moving: NDArray, *, exact: bool) -> tuple[NDArray, str]:
    """The coordinates, or a representative and the name of what remains free."""
    _, d, k = moving.shape
    if k == 1 and exact and _flat(moving[..., 0]):
        raise GeometryError("the valid rows are satisfied with all nodes in one plane only: some of them are not whole")
    if k == 1:
        return moving[..., 0], ""
    single = [svd(moving[:, a], full_matrices=False) for a in range(d)]
    ranks = [int((s > ALIKE).sum()) for _, s, _ in single]
    if k == d * d and ranks == [d] * d:
        return single[0][0][:, :d] / np.sqrt(d), "affine"
    raise GeometryError(
        f"the valid rows leave a null space of dimension {d + k} where {d + 1} is expected: too many unknowns are "
        "eliminated, or reduced integration leaves hourglass modes"
    )


def _flat(points: NDArray) -> bool:
    """Whether most nodes lie in one plane across an axis, as no mesh does, whatever the others do."""
    most = int(np.ceil((1 - _FEW) * len(points)))
    ordered = np.sort(points, axis=0)
    spread = (ordered[most - 1 :] - ordered[: len(points) - most + 1]).min(axis=0)
    return bool((spread <= ALIKE * np.abs(points).max()).any()) and most > 2 ** points.shape[1]


def in_gauge(points: NDArray, graph: sp.csr_array) -> NDArray[np.float64]:
    """Centroid at the origin, mean edge length 1, and of the two point reflections that with positive third moments."""
    pairs = sp.triu(graph, 1).tocoo()
    length = np.linalg.norm(points[pairs.row] - points[pairs.col], axis=1)
    mean = np.nanmean(length) if np.isfinite(length).any() else 1.0
    centred = (points - np.nanmean(points, axis=0)) / (mean if mean > 0 else 1.0)
    moments = np.nansum(centred**3, axis=0)
    spread = np.nansum(np.abs(centred) ** 3, axis=0)
    decisive = np.flatnonzero(np.abs(moments) > ALIKE * spread)
    return -centred if len(decisive) and moments[decisive[0]] < 0 else centred
