"""A mesh of what was left, held against the whole matrix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..certify import Terms, certify
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..tolerances import CERTIFIED

Plain = Callable[..., PlanarMesh]


@dataclass(frozen=True, eq=False)
class Held:
    """A matrix, and the tensor that is to be undone."""

    matrix: OperatorMatrix
    tensor: tuple[float, float, float] | None

    def with_terms(self, found: PlanarMesh, terms: Terms, operator: str, *notes: str) -> PlanarMesh:
        """The mesh of the Laplacian as that of the whole matrix, if it gives that back."""
        matrix, triangles = self.matrix, found.divided()[0]
        factor = found.scale[found.component[triangles].max(axis=1)]  # a hinge carries the lowest label
        held = certify(matrix.edges, matrix.entries, found.points, triangles, factor, self.tensor, terms)
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


def areas_of(mesh: PlanarMesh) -> NDArray[np.float64]:
    """(m,) of all triangles, those of polygons too, as ``divided`` has them."""
    a, b, c = mesh.points[mesh.divided()[0]].transpose(1, 2, 0)
    (ux, uy), (wx, wy) = b - a, c - a
    return np.asarray((ux * wy - uy * wx) / 2)
