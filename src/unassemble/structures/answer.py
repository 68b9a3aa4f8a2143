"""A structure held against its matrix and given back: the verdict, fields and sentences that all kinds share."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate_structures import StructureCheck
from ..nodes.anchoring import Request, anchored
from ..nodes.numbering import Rows
from ..nodes.rounded import Known, Rounding, known_to
from ..recovery import Structure
from ..tolerances import ROUNDED
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of, words_of
from .placed import Placed

_LOADED = (
    "sums of moments are not whole, or contradict those of forces, and forces alone do not tell the size of this "
    "structure: with axial forces in its members, or springs between its nodes, they fit another size as well"
)
_WITHOUT_LOADS = "assemble the matrix without geometric stiffness, and without springs"


@dataclass(frozen=True, eq=False)
class Held:
    """Positions held against the matrix."""

    error: float  # the largest misfit
    check: Callable[[NDArray[np.float64]], StructureCheck]  # of points as they are written, by formulas of its own
    misfits: NDArray[np.float64]  # (k,), with their signs
    again: Callable[[sp.csr_array], tuple[NDArray, NDArray]]  # points and misfits of a matrix rounded otherwise
    rounding: Rounding | None
    said: tuple[str, str]  # what holds, and what of it does not, by an {error}

    def known(self, found: Placed, *, sized: bool) -> Known:
        """How far positions may be off, relative to the size; without rounding if each equation were off by as much."""
        if self.rounding is None:
            loosest = min(found.evidence, key=lambda one: one.gap / np.sqrt(one.rows))
            return Known(float(self.error * np.sqrt(loosest.rows) / loosest.gap))
        return known_to(found.points, found.component, self.misfits, self.rounding, self.again, sized=sized)

    def verdict(self, found: Placed, known: Known, check: StructureCheck) -> tuple[str, Reason]:
        """Status and reason."""
        holds, left = self.said
        error = max(self.error, check.backward_error)
        objection = known.objection(error, self.rounding, left.format(error=error) + _most_in(check))
        if objection is None and found.loaded:
            objection = Reason(_LOADED, _WITHOUT_LOADS)
        if objection is None and found.unnoticed.any():
            count = count_of(int(np.count_nonzero(found.unnoticed)), "equation has", "equations have")
            unseen = (
                f"{count} no other to check against, so that springs would go unnoticed: too few whole rows are left"
            )
            objection = Reason(unseen, WITHOUT_SUPPORTS)
        if objection is not None:
            return "uncertified", objection
        digits = known.within(self.rounding)
        share = f"{check.share:.0%} of the rows say so, of {check.unknowns.mean():.0%} of the unknowns"
        return "certified", Reason(f"{holds}{digits}: {share}")


def _most_in(check: StructureCheck) -> str:
    """Which rows the certificate does not explain, in words."""
    worst = check.worst[:3]
    if not len(worst):
        return ""
    more = ", ..." if len(check.unexplained) > len(worst) else ""
    return f", most in {'row' if len(worst) == 1 else 'rows'} {words_of(worst.tolist())}{more}"


def about_loose(loose: NDArray[np.bool_], why: str) -> list[str]:
    """What there is to say of nodes without coordinates, (n,)."""
    count = f"{loose.sum()} of {count_of(len(loose), 'node')}"
    return [f"{count} cannot be determined: {why}"] if loose.any() else []


def answer(
    request: Request,
    rows: Rows,
    found: Placed,
    held: Held,
    *,
    edges: NDArray[np.int64],
    sized: bool,
    free: str,
    doubt: Callable[[], Reason | None] = lambda: None,
    notes: list[str],
    **fields: Any,
) -> Structure:
    """What was found, with its verdict; what is `free` is said where anchors leave a size so.

    What is `held` against the matrix counts unless there is a `doubt`. Errors are measured in distances of coupled
    nodes, `edges` (e, 2); `fields` are further ones of a Structure.
    """
    with request.clock("certify"):
        known = held.known(found, sized=sized)
        check = held.check(found.points)
        verdict = held.verdict(found, known, check)
        doubts = doubt() if verdict[0] == "certified" else None
    length = np.linalg.norm(found.points[edges[:, 0]] - found.points[edges[:, 1]], axis=1)
    if 2 * (length <= ROUNDED * np.nanmax(length, initial=0.0)).sum() > len(edges):
        doubts = Reason("most nodes that are coupled are in one place", GIVE_NUMBERING)
    if verdict[0] == "certified" and doubts is not None:
        verdict = "uncertified", doubts
    edge = float(np.nanmean(length)) if np.nansum(length) > 0 else 1.0
    said, placed = (*found.notes, *notes), (found.points, found.component, found.evidence)
    factor, shared = anchored(request, rows, *placed, verdict, edge, sized=sized, notes=said, free=free)
    if request.anchors:
        with request.clock("certify"):
            check = held.check(shared["points"])
        moved = held.verdict(found, known, check)
        if shared["status"] == "certified" and moved[0] != "certified":
            shared |= {"status": moved[0], "uniqueness": None, "reason": moved[1].text, "advice": moved[1].advice}
    off = known.error if held.rounding and known.explained else None
    scale = np.full(len(factor), np.nan)
    return Structure(scale=scale, backward_error=check.backward_error, position_error=off, **shared, **fields)
