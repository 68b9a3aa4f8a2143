"""Other elements than linear triangles, with a mass term, or with rows and columns scaled.

On straight triangles of second and third order the entries that a cell shares with no other tell its area: on a
quadratic one int grad phi_a . grad phi_b vanishes for a corner and the side that faces it, int phi_a phi_b does not. So
the mass matrix is known before anything is solved, and taken off. Linear elements have no such entries inside, and
quadrilaterals two, fewer than the numbers that they depend on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ..certify import Terms
from ..clock import Clock
from ..conforming.affine import without_mass
from ..conforming.recover import shown_cells
from ..conforming.roles import Cells
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from .again import Held, areas_of
from .mass import size_note
from .row_sums import RowSums
from .scaling import unscaled


@dataclass(frozen=True, eq=False)
class LessMass:
    """A matrix less its mass term.

    Attributes
    ----------
    matrix : OperatorMatrix
        c L.
    cells : Cells
    area : float
        Of them all, times s.
    """

    matrix: OperatorMatrix
    cells: Cells
    area: float


def less_mass(matrix: OperatorMatrix) -> LessMass | None:
    """A matrix c L + s M less s M; None where row sums show no mass, or rows no such cells that tell it."""
    sign = RowSums.of(matrix).sign
    if not sign:
        return None
    cells = next(shown_cells(matrix, mass=True), None)
    if cells is None or not all(kind.simplex and kind.degree > 1 for kind in cells.blocks):
        return None
    left, areas = without_mass(matrix, cells.blocks)
    return LessMass(left, cells, float(areas.sum())) if (sign * areas > 0).all() else None


Of = Callable[[OperatorMatrix, Iterable[Cells]], PlanarMesh]


def recover_elements_with_terms(matrix: OperatorMatrix, of_cells: Of, clock: Clock) -> PlanarMesh | None:
    """The mesh of c L + s M or S c L S; None where row sums show neither, or nothing comes near.

    Parameters
    ----------
    matrix : OperatorMatrix
    of_cells : callable
        Recovers a matrix c L + D on cells that its rows may form.
    clock : Clock
    """
    held = Held(matrix, None)
    try:
        if (less := less_mass(matrix)) is not None:
            found = of_cells(less.matrix, [less.cells])
            reaction = less.area / float(areas_of(found).sum())
            operator = "c L + s M, M the consistent mass matrix,"
            return held.with_terms(found, Terms(matrix.diagonal, reaction), operator, size_note(reaction))
        sums = RowSums.of(matrix)
        if sums.there.any() and not sums.sign and next(shown_cells(matrix), None) is not None:
            return unscaled(held, lambda left: of_cells(left, shown_cells(left)), clock)
    except RecoveryError:
        pass
    return None
