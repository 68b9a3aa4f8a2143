"""A structure as it is given back: moved to its anchors, with the fields and sentences that all kinds share."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..nodes.anchoring import Request, anchored
from ..nodes.numbering import Numbering
from ..recovery import Structure
from ..tolerances import ROUNDED
from ..words import GIVE_NUMBERING, Reason
from .placed import Placed
from .recognise import StructuralNumbering


def covered(rows: NDArray[np.bool_], columns: NDArray[np.bool_]) -> str:
    """How much of a matrix speaks for the coordinates, in words: masks of its rows, and of the unknowns they touch."""
    return f"{rows.mean():.0%} of the rows say so, of {columns.mean():.0%} of the unknowns"


def answer(
    numbering: Numbering | StructuralNumbering,
    request: Request,
    found: Placed,
    verdict: tuple[str, Reason],
    *,
    edges: NDArray[np.int64],
    sized: bool = True,
    free: str = "",
    notes: list[str],
    **fields: Any,
) -> Structure:
    """What was found, by status and reason of the `verdict`; what is `free` is said where anchors leave a size so.

    Errors are measured in distances of coupled nodes, `edges` (e, 2); `fields` are further ones of a Structure.
    """
    held = request.held(numbering.node_of_row, found.points.shape[1])
    length = np.linalg.norm(found.points[edges[:, 0]] - found.points[edges[:, 1]], axis=1)
    if verdict[0] == "certified" and 2 * (length <= ROUNDED * np.nanmax(length, initial=0.0)).sum() > len(edges):
        verdict = "uncertified", Reason("most nodes that are coupled are in one place", GIVE_NUMBERING)
    edge = float(np.nanmean(length)) if np.nansum(length) > 0 else 1.0
    points, factor, more, (status, reason) = anchored(
        found.points, found.component, len(found.evidence), held, verdict, edge, sized=sized
    )
    return Structure(
        points=points,
        component=found.component,
        scale=np.full(len(factor), np.nan),
        node_status=(found.component < 0).astype(np.int8),
        evidence=found.evidence,
        status=status,
        uniqueness="searched" if status == "certified" else None,
        reason=reason.text,
        advice=reason.advice,
        timings=request.clock.timings,
        warnings=(*request.matrix.warnings, *found.notes, *notes, *([free] if np.isnan(factor).any() else []), *more),
        node_of_row=numbering.node_of_row,
        direction_of_row=numbering.direction_of_row,
        numbering=numbering.kind,
        choice=request.choice,
        **fields,
    )
