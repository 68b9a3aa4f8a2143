"""What is said of positions once they are found: certificate, material, cells, and what is not certain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..nodes.nodal import NodalMatrix, determined
from ..nodes.numbering import Numbering
from ..nodes.redrawn import known_to
from ..nodes.rounded import Rounding
from ..tolerances import ALIKE
from .doubts import guessed_directions, unborne, unconfirmed
from .materials.cells import no_cells, recognise_cells
from .nullspace.certificate import residuals
from .nullspace.material import lame_ratio, poisson_ratio
from .nullspace.redundancy import checked
from .nullspace.solution import Solution
from .remarks import about_assumptions, about_cells, about_directions, about_nodes
from .results import ElasticityRecovery
from .verdict import NOTHING_CHECKED, NOTHING_SHOWN, RESTS_ON_PLANES, hidden, of_few_digits, verdict


def described(
    nodal: NodalMatrix,
    numbering: Numbering,
    solution: Solution,
    clock: Clock,
    *,
    cells: bool,
    rounding: Rounding | None,
    placed_again: Callable[[sp.csr_array], tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> ElasticityRecovery:
    """The recovery, with its certificate, material and cells, and the sentences that go with them.

    Parameters
    ----------
    nodal : NodalMatrix
    numbering : Numbering
    solution : Solution
    clock : Clock
    cells : bool
        Look for elements too, not only where nothing else confirms positions.
    rounding : Rounding, optional
        Of the entries, where they have few digits.
    placed_again : callable
        Points (n, d), and misfits (k,), from another matrix that may have been rounded to the given one.
    """
    with clock("certify"):
        misfits = residuals(nodal, solution.valid, solution.points, solution.ratio)
        error = float(np.abs(misfits).max()) if len(misfits) else float("nan")
        near = not error >= max(ALIKE, rounding.spread if rounding else 0.0)  # NaN where only elements can tell
        ratio = _lame_ratio(nodal, solution) if near else None
    found = no_cells()
    if (cells or solution.straight or solution.hanging is not None) and near:
        with clock("cells"):
            found = recognise_cells(nodal, solution.points, ratio)
    if solution.cautious is not None and not found.certified:
        return described(
            nodal, numbering, solution.cautious, clock, cells=cells, rounding=rounding, placed_again=placed_again
        )
    backward = found.backward_error if found.certified else error
    status, reason = verdict(nodal, solution, error, found, numbering)
    alone = status == "certified" and not found.certified
    lone = determined(solution.points) & ~checked(nodal, solution) if alone else np.zeros(nodal.n, dtype=bool)
    if lone.any() and not cells:  # only elements can confirm them
        return described(nodal, numbering, solution, clock, cells=True, rounding=rounding, placed_again=placed_again)
    if alone and not (determined(solution.points) & ~lone).any():
        status, reason, lone = "uncertified", NOTHING_CHECKED, np.zeros_like(lone)
    known = None
    if rounding and near and not any(solution.freedoms):
        with clock("certify"):
            known = known_to(solution.points, solution.component, misfits, rounding, placed_again, sized=False)
        status, reason = of_few_digits(nodal, solution, error, numbering, rounding, known)
    elif rounding:
        reason = hidden(reason, rounding)
    withheld = np.zeros(nodal.n, dtype=bool)
    if status == "certified" and (found.certified or numbering.open_row is not None or not numbering.incomplete):
        withheld = unconfirmed(nodal, numbering, solution.points, found.shown)
    hanging = unborne(nodal, solution, found)
    if hanging.any() and (hanging | withheld | ~determined(solution.points)).all():
        status, reason = "uncertified", RESTS_ON_PLANES
        hanging = np.zeros(nodal.n, dtype=bool)  # said of all of them
    kept = ~(withheld | hanging | lone)
    points = np.where(kept[:, None], solution.points, np.nan)
    found = found.among(kept)
    loose = ~determined(points)
    if status == "certified" and loose.all():
        status, reason = "uncertified", NOTHING_SHOWN
    guessed = guessed_directions(numbering, loose)
    return ElasticityRecovery(
        points=points,
        node_of_row=numbering.node_of_row,
        direction_of_row=np.where(guessed, -1, numbering.direction_of_row),
        node_status=np.asarray(loose, dtype=np.int8),
        component=np.where(loose, -1, solution.component),
        evidence=solution.evidence,
        poisson_ratio=None if ratio is None else poisson_ratio(ratio),
        cells=found,
        backward_error=backward,
        position_error=known.error if known and known.explained else None,
        status=status,
        reason=reason.text,
        advice=reason.advice,
        numbering=numbering.kind,
        warnings=(
            *solution.warnings,
            *(about_cells(found) if cells else ()),
            *about_nodes(nodal, loose, withheld, hanging, lone),
            *about_assumptions(solution),
            *about_directions(int(guessed.sum())),
        ),
        timings=clock.timings,
    )


def _lame_ratio(nodal: NodalMatrix, solution: Solution) -> float | None:
    """The number lambda / mu as boundary terms have it, and as the elements that told axes do; None if they differ.

    None too where more than translation and scale is free, since boundary terms go with the points.
    """
    if any(solution.freedoms):
        return None
    told = list(solution.straight)
    if len(solution.straight) < len(solution.evidence):
        read = lame_ratio(nodal, solution.valid, solution.points)
        if read is None:
            return None
        told.append(read)
    return told[0] if np.ptp([poisson_ratio(one) for one in told]) < ALIKE else None
