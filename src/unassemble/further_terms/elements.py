"""Other elements than linear triangles, with a mass term, or with rows and columns scaled.

Where entries tell the areas of cells the mass matrix is taken off before anything is solved. Elsewhere it is taken off
as row sums let guess, and again as the mesh of what is left has it: a fixed point, mixed from the last rounds after
Anderson, which is found up to s h^2 / c of 1 to 3, on meshes of any size.

D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965), 547-560.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..conforming.mass import Blocks, Weights, guessed_from_sums, less, told_by_entries, weights_at
from ..conforming.recover import shown_cells
from ..conforming.roles import Cells
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..tolerances import SUSPICIOUS
from .held import Held, RowSums, size_note
from .recover import unscaled

Of = Callable[[OperatorMatrix, Iterable[Cells]], PlanarMesh]
Sized = Callable[[OperatorMatrix, Sequence[Cells]], PlanarMesh]


@dataclass(frozen=True, eq=False)
class LessMass:
    """A matrix less its mass term."""

    matrix: OperatorMatrix  # c L
    cells: Cells
    weights: Weights  # times s


def less_mass(matrix: OperatorMatrix) -> LessMass | None:
    """A matrix c L + s M less s M; None where row sums show no mass, or rows no such cells that tell it."""
    sign = RowSums(matrix).sign
    cells = next(shown_cells(matrix, mass=True), None) if sign else None
    weights = cells and told_by_entries(matrix, cells.blocks)
    if not cells or not weights or not all((sign * some > 0).all() for some in weights.values()):
        return None
    return LessMass(less(matrix, cells.blocks, weights), cells, weights)


def recover_elements_with_terms(
    matrix: OperatorMatrix, of_cells: Of, clock: Clock, *, anchored: bool
) -> PlanarMesh | None:
    """The mesh of c L + s M or S c L S; None where row sums show neither, or nothing comes near.

    `of_cells`: recovers a matrix c L + D on cells that its rows may form; `anchored`: whether positions are given, so
    that no piece may change its size.
    """
    sums = RowSums(matrix)
    if not sums.there.any():
        return None

    def sized(left: OperatorMatrix, shown: Sequence[Cells]) -> PlanarMesh:
        found = of_cells(left, shown)
        return found if anchored else _in_one_size(found, sums.values, shown[0].blocks)

    try:
        if (told := less_mass(matrix)) is not None:
            return _settled(matrix, told.weights, told.cells, sized, patience=0)
        cells = next(shown_cells(matrix), None)
        if cells is None:
            return None
        scaled = None if sums.sign else unscaled(Held(matrix), lambda left: of_cells(left, shown_cells(left)), clock)
        if scaled is not None:
            return scaled
        guessed = guessed_from_sums(sums.values, cells.blocks)  # serendipity functions have integrals of both signs
        areas = np.concatenate([some.sum(axis=1) for some in guessed.values()])
        return _settled(matrix, guessed, cells, sized) if np.ptp(np.sign(areas)) == 0 else None
    except RecoveryError:
        return None


def _settled(
    matrix: OperatorMatrix, start: Weights, cells: Cells, of_cells: Sized, *, patience: int = 9
) -> PlanarMesh | None:
    """The mesh whose mass matrix, taken off, leaves its Laplacian; the nearest where there is none.

    As many rounds as `patience` are mixed, and may pass without a better one.
    """
    blocks, area = cells.blocks, float(RowSums(matrix).values.sum())  # times s
    x = np.concatenate([some.ravel() for some in start.values()])
    ends = np.cumsum([some.size for some in start.values()])
    best, least, since, rounds = None, np.inf, 0, list[tuple[NDArray, NDArray]]()
    while True:
        parts = zip(start.items(), np.split(x, ends[:-1]), strict=True)
        weights = {kind: part.reshape(some.shape) for (kind, some), part in parts}
        try:
            found = of_cells(less(matrix, blocks, weights), [cells])
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
    operator, terms = "c L + s M, M the consistent mass matrix,", Terms(matrix.diagonal, reaction)
    # Where entries tell it the mass is not found, but read off.
    unproved = "that no other mesh, with another mass, fits as well is not proved" if patience else ""
    return Held(matrix).with_terms(found, terms, operator, size_note(reaction), unproved=unproved)


def _in_one_size(found: PlanarMesh, sums: NDArray[np.float64], blocks: Blocks) -> PlanarMesh:
    """Pieces that share no vertex, each about its centroid in the size that its row sums give it beside the first."""
    component, n = found.component, len(found.scale)
    if n == 1 or len(found.hinges) or (component < 0).any():
        return found
    areas = weights_at(found.points, blocks)
    each = sum(np.bincount(component[cells[:, 0]], areas[kind].sum(axis=1), n) for kind, cells in blocks.items())
    ratio = np.bincount(component, sums, n) / each
    if not (ratio / ratio[0] > 0).all():
        return found
    factor = np.sqrt(ratio / ratio[0])[component, None]
    count = np.bincount(component)
    centre = np.column_stack([np.bincount(component, x) / count for x in found.points.T])[component]
    bars = None if found.standard_deviations is None else factor * found.standard_deviations
    return replace(found, points=centre + factor * (found.points - centre), standard_deviations=bars)
