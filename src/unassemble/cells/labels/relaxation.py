"""Labels between 0 and 1: many wrong ones put right at once.

There are more candidates than conditions, and many fractional labels explain the matrix. As wrong labels are few, the
least change in the sense of sum_k |s_k - s0_k| is sought, subject to the weights: linearised at the right mesh, this
linear program has whole labels as its solution. Positions are not known yet, so they and the labels are improved
together, along the central path of a logarithmic barrier t:

    minimise  sum_k p_k |s_k - s0_k| - t sum_k log s_k (1 - s_k) + 1/(2 q) |r - J d - g w - B ds|^2,

one Newton step for each t, q falling with t. The path commits itself to whole labels as late as possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import solved
from .fitting import cost
from .sheet import Placed, Sheet, unpinned

HOPELESS = 0.05
"""Mean cost of an edge at the end of a path with which there is nothing to begin with: 0.03 at most on meshes."""
_HELD = 1e-9  # keeps the problem definite where labels of zero leave vertices free
_NEAREST = 0.1  # of the way to 0 or 1 that one step leaves


class HopelessError(Exception):
    """Not even labels between 0 and 1 come near the weights."""


@dataclass(frozen=True)
class Path:
    """From one barrier to another.

    Attributes
    ----------
    first, last, factor : float
        Barriers t, and the ratio of one to the one before.
    slack : float
        q at the first barrier.
    mapped_above : float
        Barriers above which positions are those of the conformal map; from there on they move with the labels.
    outlier : float
        Misfit beyond which an edge counts by its misfit, not by the square.
    """

    first: float = 0.3
    last: float = 1e-3
    factor: float = 0.75
    slack: float = 0.03
    mapped_above: float = 0.01
    outlier: float = np.inf


@dataclass(frozen=True, eq=False)
class Aim:
    """What labels are drawn to: (k,) whole labels of the chosen candidates, and the price of a change of each.

    It is infinite for labels that are known.
    """

    labels: NDArray[np.float64]
    price: NDArray[np.float64]

    @property
    def free(self) -> NDArray[np.bool_]:
        """(k,) which labels may change."""
        return np.isfinite(self.price)

    @property
    def drawn_to(self) -> NDArray[np.float64]:
        """Price of a growing strength, where it may change."""
        return np.where(self.labels > 0.5, -self.price, self.price)[self.free]


def central_path(
    sheet: Sheet, aim: Aim, strength: NDArray, placed: Placed | None, path: Path
) -> tuple[NDArray[np.float64], Placed]:
    """Strengths (cells,) and positions at the end of the path.

    Parameters
    ----------
    sheet : Sheet
    aim : Aim
    strength : (cells,) float64
        Start, within (0, 1) on the chosen candidates that may change.
    placed : Placed, optional
        Positions at the start.
    path : Path

    Raises
    ------
    RecoveryError
        If there is no conformal map on the way, or an equation is singular.
    HopelessError
        If no map on the way leaves less of the weights than no cells at all.
    """
    strength = strength.copy()
    changing = np.flatnonzero(sheet.chosen)[aim.free]
    t = path.first
    nothing = float(cost(sheet.weights / sheet.spread(1.0)).sum())  # is what no cells explain
    least = 0.0 if t <= path.mapped_above else np.inf
    while t > path.last:
        if placed is None or t > path.mapped_above:
            placed = sheet.mapped(strength, placed)
            least = min(least, float(cost(sheet.misfit(placed, strength)).sum()))
        elif least > nothing:
            raise HopelessError
        new, d, log_scale = _step(sheet, placed, strength, aim, t, path)
        if t <= path.mapped_above:
            length = float((np.abs(d) / sheet.extent(placed.z)).max())
            placed = sheet.moved(placed, d, log_scale, 1 / max(length, 1.0))
        strength[changing] = new
        t *= path.factor
    assert placed is not None
    return strength, placed


def _step(
    sheet: Sheet, placed: Placed, strength: NDArray, aim: Aim, t: float, path: Path
) -> tuple[NDArray, NDArray, float]:
    """New strengths of the candidates that may change, displacements and the change of log c."""
    s = strength[sheet.chosen][aim.free]
    by_position, by_label, by_scale = sheet.linearised(placed, strength)
    free = unpinned(placed.z)
    moving, k = int(free.sum()), len(s)
    columns = sp.hstack([by_position[:, free], by_label[:, np.flatnonzero(aim.free)], sp.csr_array(by_scale[:, None])])
    misfit, slack = sheet.misfit(placed, strength), path.slack * t / path.first
    with np.errstate(divide="ignore"):
        weighted = columns.T @ sp.diags_array(np.minimum(path.outlier / np.abs(misfit), 1.0) / slack)
    held = np.full(moving + k + 1, _HELD / slack)
    held[-1] += 0.0 if sheet.free_scale else 1.0
    held[moving : moving + k] = t / s**2 + t / (1 - s) ** 2
    rhs = weighted @ misfit
    rhs[moving : moving + k] -= aim.drawn_to - t / s + t / (1 - s)
    step = solved((weighted @ columns + sp.diags_array(held)).tocsr(), rhs)
    new = np.clip(s + step[moving : moving + k], _NEAREST * s, 1 - _NEAREST * (1 - s))
    d = np.zeros(2 * len(placed.z))
    d[free] = step[:moving]
    return new, d.view(np.complex128), float(step[-1])
