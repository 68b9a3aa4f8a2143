"""What the rows of a scalar matrix add up to, and what that says of boundary conditions and further terms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import MOST, SMALL
from ..words import count_of
from .kinds import KEEP_ALL, WITHOUT_MASS


@dataclass(frozen=True, eq=False)
class Sums:
    """What rows add up to."""

    # (n,) each: rows that add up to nothing, and to more than nothing, alone ones left out
    zero: NDArray[np.bool_]
    positive: NDArray[np.bool_]
    # (n,) each: rows with nothing beside the diagonal; those of them that have something on it
    alone: NDArray[np.bool_]
    identity: NDArray[np.bool_]
    penalised: NDArray[np.bool_]  # (n,) rows whose diagonal is beyond everything else
    sign: int  # that of all sums that are not zero, where these are not few and all have one; else 0

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Sums:
        """Those of a matrix."""
        sums, alone = matrix.row_sums, matrix.couplings == 0
        zero = matrix.adds_up & ~alone
        penalised = (SMALL * np.abs(matrix.diagonal) > matrix.couplings) & ~alone
        rest = ~(zero | alone | penalised)
        signs = np.unique(np.sign(sums[rest]))
        sign = int(signs[0]) if len(signs) == 1 and rest.sum() > MOST * (zero | rest).sum() else 0
        return cls(zero, (sums > 0) & ~zero & ~alone, alone, alone & (matrix.diagonal != 0), penalised, sign)

    @property
    def rest(self) -> NDArray[np.bool_]:
        """Rows with a sum that calls for a reason."""
        return ~(self.alone | self.zero | self.penalised)

    @property
    def eliminated(self) -> bool:
        """Whether sums are as next to unknowns that are gone: few, beside others that are zero."""
        return bool(self.zero.any() and 0 < self.rest.sum() <= MOST * (~self.alone).sum())

    @property
    def remedy(self) -> str:
        """What to assemble, so that all rows add up to zero; empty where penalties alone do not."""
        if self.eliminated:
            return KEEP_ALL
        return WITHOUT_MASS if self.rest.any() and (self.zero.any() or self.sign) else ""

    @property
    def evidence(self) -> tuple[str, ...]:
        """What they say of boundary conditions and further terms, the strongest first."""
        used = ~self.alone
        said = []
        if self.identity.any() and self.zero.any():
            rows = count_of(int(self.identity.sum()), "row is that", "rows are those")
            which = f"of the identity, as of unknowns with Dirichlet conditions (row {self.identity.argmax()})"
            said.append(f"{rows} {which}")
        if self.penalised.any():
            rows = count_of(int(self.penalised.sum()), "diagonal entry is", "diagonal entries are")
            said.append(f"{rows} a penalty, as for Dirichlet conditions (row {self.penalised.argmax()})")
        if self.zero[used].all():
            said.append("all rows add up to zero")
        elif (self.zero | self.penalised)[used].all():
            said.append("all other rows add up to zero")
        elif self.zero.any():
            added = "where a mass matrix or a diagonal was added"
            cause = "next to unknowns that were eliminated" if self.eliminated else added
            rows = f"{int(self.rest.sum()):,} of {int(used.sum()):,} rows do not add up to zero"
            said.append(f"{rows}, as {cause} (row {self.rest.argmax()})")
        else:
            one = f"all sums are {'positive' if self.sign > 0 else 'negative'}" if self.sign else "sums have both signs"
            said.append(f"no row adds up to zero, and {one}")
        return tuple(said)


def further_terms(matrix: OperatorMatrix) -> str:
    """What was added to a Laplacian, or done to it, as its row sums tell before anything is solved."""
    sums = Sums.of(matrix)
    if (sums.zero | sums.alone).all():
        return ""
    if sums.penalised.any() and (sums.zero | sums.alone | sums.penalised).all():
        return ", plus a diagonal"
    if sums.zero.any() and not sums.sign:
        return ", plus a diagonal or without some unknowns"
    if sums.sign:
        return ", plus a diagonal or a mass matrix, as of a reaction"
    scaled = (matrix.diagonal > 0).all() or (matrix.diagonal < 0).all()  # squares of factors keep signs
    return ", plus a diagonal, or with rows and columns scaled" if scaled else ", plus a diagonal"
