"""What all terms have in common: the row sums that show them, and a mesh held against the whole matrix."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..certify import Certificate, Terms, certify
from ..certify_elements import certify_elements
from ..matrix import OperatorMatrix
from ..recovery import ConformingMesh, PlanarMesh
from ..tolerances import CERTIFIED, SIGMAS

Plain = Callable[..., PlanarMesh]


class RowSums:
    """A 1: c L has none, s M the integrals of s times its basis functions."""

    def __init__(self, matrix: OperatorMatrix):
        whole = matrix.csr()
        self.values: NDArray[np.float64] = np.asarray(whole.sum(axis=1)).ravel()
        # about their errors
        self.rounding: NDArray[np.float64] = 4 * np.finfo(float).eps * np.asarray(abs(whole).sum(axis=1)).ravel()

    @cached_property
    def there(self) -> NDArray[np.bool_]:
        """(n,) those beyond rounding."""
        return np.asarray(np.abs(self.values) > SIGMAS * self.rounding)

    @property
    def sign(self) -> int:
        """Of all that are beyond rounding, if these are the most and have one sign; else 0.

        Small triangles of graded meshes have integrals that may be lost.
        """
        signs = np.sign(self.values[self.there])
        return int(signs[0]) if 2 * len(signs) > len(self.there) and np.ptp(signs) == 0 else 0

    @property
    def sizes(self) -> NDArray[np.float64]:
        """(n,) at least those of rounding."""
        return np.maximum(np.abs(self.values), self.rounding)


@dataclass(frozen=True, eq=False)
class Held:
    """A matrix, and the tensor that is to be undone."""

    matrix: OperatorMatrix
    tensor: tuple[float, float, float] | None = None

    def with_terms(self, found: PlanarMesh, terms: Terms, operator: str, *notes: str, unproved: str = "") -> PlanarMesh:
        """The mesh of the Laplacian as that of the whole matrix, if it gives that back; `unproved`: what is not."""
        if unproved:
            notes += (unproved,) if found.certified else ()
            found = replace(found, uniqueness="searched" if found.uniqueness == "proved" else found.uniqueness)
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


def size_note(reaction: float) -> str:
    """How lengths depend on s."""
    return (
        "the mesh has a size: if the factor of the mass matrix is s, lengths are those given here times "
        f"sqrt({reaction:.12g} / s)"
    )
