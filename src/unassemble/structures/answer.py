"""A structure held against its matrix and given back: the verdict, fields and sentences that all kinds share."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import Findings, StructureCheck
from ..nodes.anchoring import Request, anchored, mechanical_fields
from ..nodes.numbering import Rows
from ..nodes.rounded import Known, Rounding, known_to, misfits_allowed
from ..recovery import Examined, Placed, Structure, finish
from ..tolerances import CERTIFIED, ROUNDED
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of, words_of
from .placed import PlacedNodes

_LOADED = (
    "only forces tell the size of this structure, for its moments are incomplete or contradict them; and with axial "
    "forces in its members, or springs between its nodes, forces fit another size as well"
)
_NOTHING_COMPARED = "all rows of the matrix lack something, so that none of them can be held against the coordinates"
_NO_LENGTH = "nodes that members join lie in one place, or entries are missing that these members have"
_UNSUPPORTED = " do not add up to zero, and neither supports nor springs bring that about: entries there are wrong"
_WITHOUT_LOADS = "assemble the matrix without geometric stiffness, and without springs"


@dataclass(frozen=True, eq=False)
class HeldStructure:
    """Positions held against the matrix."""

    error: float  # the largest misfit; NaN where there is none
    check: Callable[[NDArray[np.float64]], StructureCheck]  # of points as they are written, by formulas of its own
    misfits: NDArray[np.float64]  # (k,), with their signs
    again: Callable[[sp.csr_array], tuple[NDArray, NDArray]]  # points and misfits of a matrix rounded otherwise
    rounding: Rounding | None
    said: tuple[str, str]  # what holds, and what of it does not, by an {error}

    def known(self, found: PlacedNodes, *, sized: bool) -> Known:
        """How far positions may be off, relative to the size; without rounding if each equation were off by as much."""
        if self.rounding is None:
            if np.isnan(self.error):
                return Known(float("inf"))
            loosest = min(found.evidence, key=lambda one: one.gap / np.sqrt(one.rows))
            return Known(float(self.error * np.sqrt(loosest.rows) / loosest.gap))
        return known_to(found.points, found.component, self.misfits, self.rounding, self.again, sized=sized)

    def objections(self, found: PlacedNodes, known: Known, check: StructureCheck) -> Iterator[Reason]:
        """What speaks against the positions."""
        errors = [one for one in (self.error, check.backward_error) if not np.isnan(one)]
        error = max(errors, default=0.0)
        if len(errors) < 2 and error <= misfits_allowed(self.rounding):
            yield Reason(_NOTHING_COMPARED, advice=WITHOUT_SUPPORTS)
        else:
            said = _NO_LENGTH if np.isinf(error) else self.said[1].format(error=error)
            yield from known.objections(error, self.rounding, said + _most_in(check))
        if found.loaded:
            yield Reason(_LOADED, advice=_WITHOUT_LOADS)
        if found.unnoticed.any():
            count = count_of(int(np.count_nonzero(found.unnoticed)), "equation has", "equations have")
            unseen = (
                f"{count} no other to check against, so that springs would go unnoticed: too few whole rows are left"
            )
            yield Reason(unseen, advice=WITHOUT_SUPPORTS)
        if len(check.unsupported):
            yield Reason(_rows_of(check.unsupported) + _UNSUPPORTED)

    def fits(self, known: Known, check: StructureCheck) -> str:
        """What holds, how far it determines positions, and which rows say so."""
        digits = known.within(self.rounding)
        share = f"{check.share:.0%} of the rows say so, of {check.unknowns.mean():.0%} of the unknowns"
        return f"{self.said[0]}{digits}: {share}"


def _most_in(check: StructureCheck) -> str:
    """Which rows the certificate does not explain, in words."""
    return f", most in {_rows_of(check.unexplained)}" if len(check.unexplained) else ""


def _rows_of(rows: NDArray[np.int64]) -> str:
    """The first of some rows, in words: ``rows 3, 7, 9 and others``."""
    more = " and others" if len(rows) > 3 else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {words_of(rows[:3].tolist())}{more}"


def _about_silent(check: StructureCheck) -> list[str]:
    """What there is to say of rows that were not compared."""
    silent = np.flatnonzero(~check.rows)
    if not len(silent):
        return []
    count = count_of(len(silent), "row is", "rows are")
    return [
        f"{count} not compared, as next to supports or with springs ({_rows_of(silent)}): wrong entries between such "
        "rows may go unnoticed"
    ]


def about_loose(loose: NDArray[np.bool_], why: str) -> list[str]:
    """What there is to say of nodes without coordinates, (n,)."""
    count = f"{loose.sum()} of {count_of(len(loose), 'node')}"
    return [f"{count} cannot be determined: {why}"] if loose.any() else []


def answer(
    request: Request,
    rows: Rows,
    found: PlacedNodes,
    held: HeldStructure,
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
    length = np.linalg.norm(found.points[edges[:, 0]] - found.points[edges[:, 1]], axis=1)
    edge = float(np.nanmean(length)) if np.nansum(length) > 0 else 1.0
    with request.clock("place"):
        moved = anchored(request, rows, found.points, found.component, edge, sized=sized, free=free)
    objections = list(moved.objections(held.said[0]))
    if 2 * (length <= ROUNDED * np.nanmax(length, initial=0.0)).sum() > len(edges):
        objections.insert(0, Reason("most nodes that are coupled are in one place", advice=GIVE_NUMBERING))

    def place() -> Placed[Structure]:
        structure = Structure(
            scale=np.full(len(moved.factor), np.nan),
            position_error=known.error if held.rounding and known.explained else None,
            **mechanical_fields(request, rows, moved.points, found.component, found.evidence),
            **fields,
        )
        return Placed(structure, (*request.matrix.warnings, *found.notes, *notes, *moved.notes))

    def examine(_: Structure, check: StructureCheck) -> Examined:
        against = [*held.objections(found, known, check), *objections]
        if not against and (doubts := doubt()) is not None:
            against.append(doubts)
        allowed = np.inf if held.rounding else CERTIFIED
        fits = held.fits(known, check)
        notes = [] if against else _about_silent(check)
        return Examined(Findings((fits,), check.backward_error, tuple(against), allowed=allowed), notes)

    return finish(request.clock, place, lambda mesh: held.check(mesh.points), examine)
