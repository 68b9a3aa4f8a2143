"""Labels around a misfit fractional again, the others nearly fixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import SolverError
from .fitting import Fitted, fitted
from .neighbourhood import Neighbourhoods
from .relaxation import Aim, Path, central_path
from .sheet import Sheet

_COLD, _SURE = 5.0, 1e-3  # price of a change, and distance from a whole label, of labels far from the misfit


@dataclass(frozen=True)
class Reopening:
    """Labels near misfits above a part of the largest, and what they start from on a path."""

    above: float
    rings: int
    strength: float
    path: Path


_WARM = Path(first=0.05, last=1e-3, factor=0.7, slack=0.01, mapped_above=np.inf)
REOPENINGS = (
    Reopening(0.3, 0, 0.7, _WARM),
    Reopening(0.1, 0, 0.7, _WARM),
    Reopening(0.1, 1, 0.5, Path(first=0.2, last=1e-3, factor=0.7, slack=0.01, mapped_above=np.inf)),
)
"""In the order in which they are tried: each opens more labels than the one before, or leaves them more freedom."""


def reopened(sheet: Sheet, near: Neighbourhoods, usual: NDArray[np.bool_], how: Reopening, fit: Fitted) -> Fitted:
    """Whole labels again; those around the misfit may have changed.

    Parameters
    ----------
    sheet : Sheet
    near : Neighbourhoods
    usual : (cells,) bool
        What opened labels are drawn to.
    how : Reopening
    fit : Fitted
    """
    size = np.abs(fit.misfit)
    at = np.zeros(sheet.n_vertices, dtype=bool)
    at[sheet.edges[size > how.above * min(float(size.max()), 0.3)]] = True
    for _ in range(how.rings):
        at = near.next_vertex @ at > 0
    around = np.zeros(sheet.candidates.count, dtype=bool)
    around[sheet.cell[at[sheet.triangles].any(axis=1)]] = True
    opened = around[sheet.chosen]
    labels = np.where(opened, usual[sheet.chosen], fit.labels[sheet.chosen])
    distance = np.where(opened, 1 - how.strength, _SURE)
    strength = np.zeros(sheet.candidates.count)
    strength[sheet.chosen] = np.abs(labels - distance)
    aim = Aim(labels, np.where(opened, 1.0, _COLD))
    try:
        strength, placed = central_path(sheet, aim, strength, fit.placed, how.path)
    except SolverError:
        return fit
    return fitted(sheet, strength > 0.5, placed)
