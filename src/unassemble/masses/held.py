"""What all terms have in common: the row sums that show them, and a mesh held against the whole matrix."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..certificate import Terms
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..scalar.held import held
from ..tolerances import CERTIFIED, SIGMAS

Plain = Callable[..., PlanarMesh]


@dataclass(frozen=True, eq=False)
class Held:
    """A matrix, its row sums, of which c L has none and s M the integrals of s times its basis functions, and a tensor.

    `tensor`: (kxx, kxy, kyy) to be undone.
    """

    matrix: OperatorMatrix
    tensor: tuple[float, float, float] | None = None

    @cached_property
    def rounding(self) -> NDArray[np.float64]:
        """(n,) about the errors of row sums."""
        return np.asarray(4 * np.finfo(float).eps * (np.abs(self.matrix.diagonal) + self.matrix.couplings))

    @property
    def has_sums(self) -> NDArray[np.bool_]:
        """(n,) rows with sums beyond rounding."""
        return np.asarray(np.abs(self.matrix.row_sums) > SIGMAS * self.rounding)

    @property
    def sign(self) -> int:
        """Of all sums beyond rounding, if most are and have one sign; else 0: those of small triangles may be lost."""
        there = self.has_sums
        signs = np.sign(self.matrix.row_sums[there])
        return int(signs[0]) if 2 * len(signs) > len(there) and np.ptp(signs) == 0 else 0

    def with_terms(self, found: PlanarMesh, terms: Terms, operator: str, *notes: str, unproved: str = "") -> PlanarMesh:
        """The mesh of the Laplacian as that of the whole matrix, if it gives that back; `unproved`: what is not."""
        if unproved:
            notes += (unproved,) if found.certified else ()
            found = replace(found, uniqueness="searched" if found.uniqueness == "proved" else found.uniqueness)
        if terms.reaction:
            notes = (
                "the mesh has a size: if the factor of the mass matrix is s, lengths are those given here times "
                f"sqrt({terms.reaction:.12g} / s)",
                *notes,
            )
        certificate = held(self.matrix, found, self.tensor, terms)
        good = certificate.backward_error <= CERTIFIED and not len(certificate.flipped)
        fits = (
            f"{operator} re-assembled on this mesh gives the matrix back to {certificate.backward_error:.1e} (relative)"
        )
        worst, misfits = certificate.worst(0 if good and found.certified else 10)
        return replace(
            found,
            reaction=terms.reaction,
            row_scaling=terms.scaling,
            status=found.status if good else "uncertified",
            uniqueness=found.uniqueness if good else None,
            reason=fits if good and found.certified else f"{fits}, but {found.reason}" if good else f"{fits} only",
            backward_error=certificate.backward_error,
            warnings=(*found.warnings, *notes),
            worst_entries=worst,
            worst_misfits=misfits,
        )
