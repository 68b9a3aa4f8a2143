"""A mesh of what was left, held against the whole matrix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..certify import Certificate, Terms, certify
from ..certify_elements import certify_elements
from ..matrix import OperatorMatrix
from ..recovery import ConformingMesh, PlanarMesh
from ..tolerances import CERTIFIED

Plain = Callable[..., PlanarMesh]


@dataclass(frozen=True, eq=False)
class Held:
    """A matrix, and the tensor that is to be undone."""

    matrix: OperatorMatrix
    tensor: tuple[float, float, float] | None

    def with_terms(self, found: PlanarMesh, terms: Terms, operator: str, *notes: str) -> PlanarMesh:
        """The mesh of the Laplacian as that of the whole matrix, if it gives that back."""
        held = self._held(found, terms)
        good = held.backward_error <= CERTIFIED and not len(held.flipped)
        fits = f"{operator} re-assembled on this mesh gives the matrix back to {held.backward_error:.1e} (relative)"
        worst, misfits = held.worst(0 if good and found.certified else 10)
        return replace(
            found,
            reaction=terms.reaction,
            row_scaling=terms.scaling,
            status=found.status if good else "uncertified",
            uniqueness=found.uniqueness if good else None,
            reason=fits if good and found.certified else f"{fits}, but {found.reason}" if good else f"{fits} only",
            backward_error=held.backward_error,
            warnings=(*found.warnings, *notes),
            worst_entries=worst,
            worst_misfits=misfits,
        )

    def _held(self, found: PlanarMesh, terms: Terms) -> Certificate:
        def factor(cells: NDArray) -> NDArray:
            return found.scale[found.component[cells].max(axis=1)]  # a hinge carries the lowest label

        given = self.matrix.edges, self.matrix.entries, found.points
        if not isinstance(found, ConformingMesh):
            triangles = found.divided()[0]
            return certify(*given, triangles, factor(triangles), self.tensor, terms)
        rules = {
            name: next(rule for rule in found.quadrature.split(", ") if ("Gauss" in rule) == name.startswith("quad"))
            for name in found.cells
        }
        factors = {name: factor(cells) for name, cells in found.cells.items()}
        return certify_elements(*given, found.cells, factors, rules, terms)


def areas_of(mesh: PlanarMesh) -> NDArray[np.float64]:
    """(m,) of all triangles, those of polygons too, as ``divided`` has them."""
    a, b, c = mesh.points[mesh.divided()[0]].transpose(1, 2, 0)
    (ux, uy), (wx, wy) = b - a, c - a
    return np.asarray((ux * wy - uy * wx) / 2)
