"""What is asked for beside the matrix; known positions: one fixes the translation of its piece, two size and sign."""

import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import InputError
from ..matrix import OperatorMatrix
from ..recovery import Evidence
from ..tolerances import ALIKE, SUMMED
from ..words import Reason
from .numbering import Rows
from .rounded import Rounding


@dataclass(frozen=True)
class Request:
    """What is asked for, and what is known beside the matrix."""

    matrix: OperatorMatrix
    clock: Clock
    anchors: Sequence[Any] | None = None  # (row, x, y) or (row, x, y, z)
    cells: bool = True  # look for elements too, not only where nothing else confirms positions
    choice: str = ""  # why the matrix was taken for what it is
    rounding: Rounding | None = None  # of the entries, where they have few digits
    named: bool = False  # whether the caller said in which order the unknowns stand, or gave the numbering

    def held(self, node_of_row: NDArray[np.int64], d: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Nodes (k,) and known positions (k, d) of the anchors.

        InputError for rows that do not exist or belong to one node, and positions of another dimension.
        """
        anchors = list(self.anchors or ())
        try:
            rows = [operator.index(one[0]) for one in anchors]
            places = [tuple(float(x) for x in one[1:]) for one in anchors]
        except (TypeError, ValueError, IndexError) as error:
            raise InputError("anchors are a row, a whole number, and coordinates") from error
        for row, place in zip(rows, places, strict=True):
            if not 0 <= row < len(node_of_row):
                raise InputError(f"row {row} is not in the matrix: its rows count from 0 to {len(node_of_row) - 1}")
            if len(place) != d or not np.isfinite(place).all():
                raise InputError(f"the anchor of row {row} needs {d} finite coordinates: the matrix belongs to {d}D")
        nodes = node_of_row[rows] if rows else np.empty(0, np.int64)
        for k, node in enumerate(nodes):
            if node in nodes[:k]:
                other = rows[int(np.argmax(nodes[:k] == node))]
                raise InputError(f"rows {other} and {rows[k]} belong to one node: anchor one of them")
        return np.asarray(nodes), np.asarray(places, dtype=np.float64).reshape(-1, d)


@dataclass(frozen=True, eq=False)
class Anchored:
    """Pieces moved to their anchors."""

    points: NDArray[np.float64]  # (n, d) as they are to be written
    #: (pieces,) by which each was enlarged; negative where it was reflected in a point, NaN where the size is free
    factor: NDArray[np.float64]
    notes: tuple[str, ...]  # what was not used, what does not fit, and what is free
    lost: float  # the digits that coordinates lost far from the origin, in mean lengths of edges

    def objections(self, before: str) -> Iterator[Reason]:
        """That coordinates lost more digits than entries would bear; `before`: what holds without that."""
        if not self.lost <= SUMMED:
            yield Reason(
                f"the anchors lie so far from the origin that coordinates, as written, are off by {self.lost:.1e} edge "
                "lengths: they have too few digits left",
                f"before, {before}",
                advice="subtract a point near the anchors from all of `anchors`",
            )


def anchored(
    request: Request,
    rows: Rows,
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    edge: float,
    *,
    sized: bool = False,
    free: str,
) -> Anchored:
    """Translate each piece to its anchors and, unless `sized`, rescale it; axes stay.

    Parameters
    ----------
    request : Request
        Has the anchors.
    rows : Rows
        Which node each row belongs to.
    points : (n, d) float64
        Positions of the nodes, NaN where they are not determined.
    component : (n,) int64
        The piece of each node, -1 for those of none.
    edge : float
        The mean length of edges, in which lost digits are measured.
    sized : bool
        Whether the matrix tells size and sign.
    free : str
        What is said where anchors leave them free.
    """
    nodes, places = request.held(rows.node_of_row, points.shape[1])
    count = int(component.max(initial=-1)) + 1
    points, factor, lost = points.copy(), np.full(count, 1.0 if sized else np.nan), 0.0
    notes = []
    adrift = nodes[component[nodes] < 0]
    if len(adrift):
        notes.append(f"the anchored nodes {', '.join(map(str, adrift))} are not determined and were not used")
    for piece in np.unique(component[nodes][component[nodes] >= 0]):
        here, body, size = component[nodes] == piece, component == piece, 1.0
        found, wanted = points[nodes[here]], places[here]
        x, y = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
        if here.sum() > 1 and not sized:
            factor[piece] = size = float((x * y).sum() / (x * x).sum())
            if size == 0:
                raise InputError("the anchors lie in one point, or across the line between their nodes")
        before = size * points[body]
        shift = wanted.mean(axis=0) - (size * found).mean(axis=0)
        points[body] = before + shift
        off = np.abs((points[body] - shift) - before).max() / abs(size)
        lost = float(np.maximum(lost, off / edge))  # NaN stays
        misfit = float(np.linalg.norm(points[nodes[here]] - wanted, axis=1).max())
        if here.sum() > 1 and misfit > ALIKE * np.linalg.norm(y, axis=1).max():
            notes.append(f"the anchors do not fit the mesh: one is missed by {misfit:.3g}")
    if np.isnan(factor).any():
        notes.append(free)
    return Anchored(points, factor, tuple(notes), lost)


def mechanical_fields(
    request: Request, rows: Rows, points: NDArray, component: NDArray[np.int64], evidence: tuple[Evidence, ...]
) -> dict[str, Any]:
    """Fields that all bodies and structures have, by name."""
    return {
        "points": points,
        "component": component,
        "node_status": (component < 0).astype(np.int8),
        "evidence": evidence,
        "node_of_row": rows.node_of_row,
        "direction_of_row": rows.direction_of_row,
        "numbering": rows.kind,
        "choice": request.choice,
    }
