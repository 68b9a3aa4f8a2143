"""A mass term taken off with the areas that are known, or again and again with those of the mesh of what is left.

Where entries tell the areas of cells, or the fit of edge lengths found them, the mass matrix is taken off before
anything is solved. Elsewhere it is taken off as row sums let guess, and again as the mesh of what is left has it: a
fixed point, mixed from the last rounds after Anderson, which is found up to s h^2 / c of 1 to 3, on meshes of any size.

D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965), 547-560.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..certificate import Terms
from ..conforming.recover import shown_cells
from ..conforming.roles import OrderedCells
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..tolerances import SUSPICIOUS
from .cells import Blocks, Weights, less, told_by_entries, weights_at
from .held import RowSums


def less_mass(matrix: OperatorMatrix) -> tuple[OperatorMatrix, OrderedCells, Weights] | None:
    """Of c L + s M first c L, its cells and their weights; None where no sums, or no cells, tell the mass."""
    sign = RowSums(matrix).sign
    cells = next(shown_cells(matrix, mass=True), None) if sign else None
    weights = cells and told_by_entries(matrix, cells.blocks)
    if not cells or not weights or not all((sign * some > 0).all() for some in weights.values()):
        return None
    return less(matrix, cells.blocks, weights), cells, weights


def settled(
    held: RowSums,
    start: Weights,
    blocks: Blocks,
    plain: Callable[[OperatorMatrix], PlanarMesh],
    patience: int,
    told: bool,
) -> PlanarMesh | None:
    """The mesh whose mass matrix, taken off, leaves its Laplacian; the nearest where there is none.

    As many rounds as `patience` are mixed, and may pass without a better one; `told`: whether the matrix says what the
    weights to begin with are.
    """
    area = float(held.matrix.row_sums.sum())  # times s
    x = np.concatenate([some.ravel() for some in start.values()])
    ends = np.cumsum([some.size for some in start.values()])
    best, least, since, rounds = None, np.inf, 0, list[tuple[NDArray, NDArray]]()
    while True:
        parts = zip(start.items(), np.split(x, ends[:-1]), strict=True)
        weights = {kind: part.reshape(some.shape) for (kind, some), part in parts}
        try:
            found = plain(less(held.matrix, blocks, weights))
        except RecoveryError:
            break
        areas = weights_at(found.points, blocks)
        reaction = area / float(sum(some.sum() for some in areas.values()))
        since += 1
        if found.backward_error < least:
            best, least, since = (found, reaction), found.backward_error, 0
        if least < SUSPICIOUS or since >= patience:
            break
        rounds = [*rounds[-patience:], (x, reaction * np.concatenate([some.ravel() for some in areas.values()]) - x)]
        place, change = (np.stack(some) for some in zip(*rounds, strict=True))
        past = np.linalg.lstsq(np.diff(change, axis=0).T, change[-1])[0]
        step = change[-1] - past @ np.diff(change, axis=0)
        x = place[-1] - past @ np.diff(place, axis=0) + step / 3  # whole steps lead away from s h^2 / c = 0.2 on
    if best is None:
        return None
    found, reaction = best
    operator, terms = "c L + s M, M the consistent mass matrix,", Terms(held.matrix.diagonal, reaction)
    unproved = "" if told else "that no other mesh, with another mass, fits as well is not proved"
    return held.with_terms(found, terms, operator, unproved=unproved)
