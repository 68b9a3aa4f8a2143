"""Other elements than linear triangles, with a mass term, or with rows and columns scaled.

Where entries tell the areas of cells the mass matrix is taken off before anything is solved. Elsewhere it is taken off
as row sums let guess, and again as the mesh of what is left has it: up to s h^2 / c of about 0.1 each round leaves at
most half of the misfit, on meshes of any size; beyond it they come to no end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..certify import Terms
from ..clock import Clock
from ..conforming.mass import Weights, guessed_from_sums, less, told_by_entries, total, weights_at
from ..conforming.recover import shown_cells
from ..conforming.roles import Cells
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..tolerances import NEARLY_ALL, SUSPICIOUS
from .again import Held
from .mass import size_note
from .row_sums import RowSums
from .scaling import unscaled

Of = Callable[[OperatorMatrix, Iterable[Cells]], PlanarMesh]


@dataclass(frozen=True, eq=False)
class LessMass:
    """A matrix less its mass term.

    Attributes
    ----------
    matrix : OperatorMatrix
        c L.
    cells : Cells
    """

    matrix: OperatorMatrix
    cells: Cells

    @classmethod
    def of(cls, matrix: OperatorMatrix, cells: Cells, weights: Weights) -> LessMass:
        """Less the mass matrix of cells with these weights."""
        return cls(less(matrix, cells.blocks, weights), cells)


def less_mass(matrix: OperatorMatrix) -> LessMass | None:
    """A matrix c L + s M less s M; None where row sums show no mass, or rows no such cells that tell it."""
    sign = RowSums.of(matrix).sign
    cells = next(shown_cells(matrix, mass=True), None) if sign else None
    weights = cells and told_by_entries(matrix, cells.blocks)
    if not cells or not weights or not all((sign * some > 0).all() for some in weights.values()):
        return None
    return LessMass.of(matrix, cells, weights)


def recover_elements_with_terms(matrix: OperatorMatrix, of_cells: Of, clock: Clock) -> PlanarMesh | None:
    """The mesh of c L + s M or S c L S; None where row sums show neither, or nothing comes near.

    Parameters
    ----------
    matrix : OperatorMatrix
    of_cells : callable
        Recovers a matrix c L + D on cells that its rows may form.
    clock : Clock
    """
    sums = RowSums.of(matrix)
    if not sums.there.any():
        return None
    try:
        if (told := less_mass(matrix)) is not None:
            return _settled(matrix, told, of_cells)
        cells = next(shown_cells(matrix), None)
        if cells is None:
            return None
        scaled = (
            None if sums.sign else unscaled(Held(matrix, None), lambda left: of_cells(left, shown_cells(left)), clock)
        )
        guessed = guessed_from_sums(sums.values, cells.blocks)  # serendipity functions have integrals of both signs
        return scaled or _settled(matrix, LessMass.of(matrix, cells, guessed), of_cells)
    except RecoveryError:
        return None


def _settled(matrix: OperatorMatrix, taken: LessMass, of_cells: Of) -> PlanarMesh | None:
    """The mesh whose mass matrix, taken off, leaves its Laplacian: again and again while that comes nearer."""
    found, error, cells = None, np.inf, taken.cells
    area = float(RowSums.of(matrix).values.sum())  # times s
    while True:
        left = of_cells(taken.matrix, [cells])
        if not left.backward_error < NEARLY_ALL * error:
            return found
        error = left.backward_error
        areas = weights_at(left.points, cells.blocks)
        reaction = area / total(areas)
        operator = "c L + s M, M the consistent mass matrix,"
        terms = Terms(matrix.diagonal, reaction)
        found = Held(matrix, None).with_terms(left, terms, operator, size_note(reaction))
        if error < SUSPICIOUS:
            return found
        taken = LessMass.of(matrix, cells, {kind: reaction * some for kind, some in areas.items()})
