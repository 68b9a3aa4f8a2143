"""What a scalar matrix may be that of, from the likeliest on: the first that fits is the answer."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .boundaries import (
    recover_lattice,
    recover_partial,
    recover_partial_elements,
    recover_without_boundary_terms,
    unless_flow,
    with_boundary_edges,
    with_diagonals,
)
from .budget import Budget
from .clock import Clock
from .conforming.recover import recover_conforming, shown_cells
from .conforming.roles import OrderedCells
from .errors import GeometryError, RecoveryError
from .masses import less_mass, recover_elements_with_terms, recover_with_terms
from .matrix import OperatorMatrix
from .options import ScalarOptions
from .recovery import PlanarMesh
from .regions import exchange_budget, recover_regions, uneven
from .scalar import recover_scalar
from .scalar.placement import Placement
from .tolerances import CERTIFIED, LITTLE


@dataclass(frozen=True, eq=False)
class ScalarReadings:
    """Readings of a scalar matrix as one of a mesh in the plane.

    Each comes before that of linear triangles where the matrix shows it at first sight, and after it where it does not.
    """

    matrix: OperatorMatrix
    placement: Placement
    clock: Clock
    options: ScalarOptions

    @property
    def crowded(self) -> bool:
        """Whether the graph has more edges than a planar one can have."""
        return len(self.matrix.edges) > 3 * self.matrix.n

    @cached_property
    def lattice(self) -> PlanarMesh | None:
        """A grid of parallelograms beside rows that were taken out; None where it is none."""
        return recover_lattice(self.matrix, self.placement, self.clock, self.options)

    @cached_property
    def other_elements(self) -> PlanarMesh | None:
        """A mesh of other elements than linear triangles; None where no cells show, or none is near."""

        def of_cells(matrix: OperatorMatrix, cells: Iterable[OrderedCells]) -> PlanarMesh:
            return recover_conforming(matrix, cells, self.placement, self.clock, self.options)

        def plainly() -> PlanarMesh | None:
            with suppress(RecoveryError):
                return of_cells(self.matrix, shown_cells(self.matrix))
            return None

        def with_terms() -> PlanarMesh | None:
            found = recover_elements_with_terms(self.matrix, of_cells, self.clock)
            return None if found is None or found.status == "uncertified" else found

        terms = not self.placement.tensor
        told = terms and less_mass(self.matrix) is not None  # by entries that are zero without a mass term
        found = (with_terms() if told else None) or plainly()
        # One that is off by 1e-10, because of an entry that stands out, lacks no term.
        if terms and not told and not (found and (found.status != "uncertified" or found.backward_error <= CERTIFIED)):
            found = with_terms() or found
        return found if found and (found.status != "uncertified" or found.backward_error < LITTLE) else None

    def likeliest(self) -> PlanarMesh:
        """The mesh of the first reading that fits, or else of the first that comes near.

        Raises RecoveryError if there is none.
        """
        if self.options.method != "conformal":
            return self._plain(self.matrix)
        order: list[tuple[int, Callable[[], PlanarMesh | None]]] = [(0, lambda: self.lattice)]
        replaced, incomplete = self.matrix.replaced is not None, self.matrix.incomplete_rows.any()
        spread = uneven(self.matrix)
        if replaced or not self.matrix.adds_up.all():  # else nothing was taken out
            partial = [self._partial_regions, self._partial] if spread else [self._partial]
            order += [(1 if replaced or incomplete else 3, reading) for reading in partial]
            order.append((0, self._without_boundary_terms))
            order.append((1 if self.crowded else 3, self._partial_elements))
        if not replaced:
            linear = [self._regions, self._linear] if spread else [self._linear, self._regions]
            order += [(1 if self.crowded else 3, lambda: self.other_elements), *((2, reading) for reading in linear)]
        nearest: PlanarMesh | None = None
        failure: RecoveryError | None = None
        for _, reading in sorted(order, key=lambda one: one[0]):
            try:
                found = reading()
            except RecoveryError as error:
                failure = error if reading == self._linear else failure or error
                continue
            if found is not None and found.status != "uncertified":
                return found
            nearest = nearest or found
        if nearest is None:
            raise failure or GeometryError(
                "the entries that boundary conditions left determine no mesh: assemble the matrix without them"
            )
        return nearest

    def _without_boundary_terms(self) -> PlanarMesh | None:
        if self.matrix.replaced is not None or self.options.noise is not None:
            return None
        tensor = self.placement.coefficients
        return recover_without_boundary_terms(self.matrix, self._plain, self.options.scale, self.clock, tensor)

    @cached_property
    def _given(self) -> tuple[OperatorMatrix, NDArray[np.bool_] | None]:
        """The matrix with what entries it lacks, and those that are whole, where rows were replaced."""
        matrix = with_boundary_edges(with_diagonals(self.matrix))
        return matrix, None if matrix.replaced is None else np.asarray(~matrix.replaced[matrix.edges].all(axis=1))

    @cached_property
    def _exchanges(self) -> Budget:
        return exchange_budget(self.matrix.n)

    def _partial(self) -> PlanarMesh | None:
        return recover_partial(*self._given, self.placement, self.clock, self.options)

    def _partial_regions(self) -> PlanarMesh | None:
        return recover_regions(*self._given, self.placement, self.clock, self.options, self._exchanges)

    def _partial_elements(self) -> PlanarMesh | None:
        return recover_partial_elements(self.matrix, self.placement, self.clock, self.options)

    def _regions(self) -> PlanarMesh | None:
        matrix = with_diagonals(self.matrix, everywhere=True)
        every = np.ones(len(matrix.edges), dtype=bool)
        return recover_regions(matrix, every, self.placement, self.clock, self.options, self._exchanges)

    def _linear(self) -> PlanarMesh:
        found = recover_with_terms(self.matrix, self._plain, self.clock, self.placement.coefficients)
        return found if self.options.noise is not None else unless_flow(self.matrix, found)

    def _plain(self, matrix: OperatorMatrix, squared_lengths: NDArray | None = None) -> PlanarMesh:
        return recover_scalar(matrix, self.placement, self.clock, self.options, squared_lengths)
