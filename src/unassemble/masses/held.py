"""What all terms have in common: the row sums that show them, and a mesh held against the whole matrix."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..certificate import Certificate, Findings, Terms, Unique, Verdict, certify_mesh
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..recovery import Examined, Placed, PlanarMesh, finish
from ..tolerances import CERTIFIED, SIGMAS
from ..words import Reason, count_of

Plain = Callable[..., PlanarMesh]


@dataclass(frozen=True, eq=False)
class RowSums:
    """A matrix, its row sums, of which c L has none and s M the integrals of s times its basis functions, and a tensor.

    `tensor`: (kxx, kxy, kyy) to be undone.
    """

    matrix: OperatorMatrix
    tensor: tuple[float, float, float] | None = None
    clock: Clock = field(default_factory=Clock)

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
        if unproved and found.certified:
            notes += (unproved,)
        if terms.reaction:
            notes = (
                "the mesh has a size: if the factor of the mass matrix is s, lengths are those given here times "
                f"sqrt({terms.reaction:.12g} / s)",
                *notes,
            )

        def examine(_: PlanarMesh, whole: Certificate) -> Examined:
            error, known = whole.backward_error, found.verdict
            fits = f"{operator} re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"
            another = None
            if known.status == "ambiguous":  # the first reason is that of the other mesh
                another = Reason(known.reasons[0], fits, advice=known.advice)
            objections = tuple(_objections(whole, fits, known))
            unique: Unique = "searched" if unproved else known.unique
            return Examined(Findings((fits,), error, objections, another, unique), fields=whole.counts())

        return finish(
            self.clock,
            lambda: Placed(
                replace(found, reaction=terms.reaction, row_scaling=terms.scaling), (*found.warnings, *notes)
            ),
            lambda mesh: certify_mesh(self.matrix, mesh, self.tensor, terms),
            examine,
        )


def _objections(whole: Certificate, fits: str, known: Verdict) -> Iterator[Reason]:
    """All that speaks against a mesh as that of the whole matrix.

    `fits` says how well it gives this back; `known` is what it is worth as the mesh of the Laplacian alone, whose
    objections it keeps.
    """
    if not whole.backward_error <= CERTIFIED:
        yield Reason(f"{fits} only", advice=known.advice)
    yield from known.objections
    if len(whole.flipped) and not known.objections:
        yield Reason(f"{count_of(len(whole.flipped), 'cell is', 'cells are')} flat, not convex or turned over")
