"""What is asked for beside the matrix; known positions: one fixes the translation of its piece, two size and sign."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import InputError
from ..matrix import OperatorMatrix
from ..tolerances import ALIKE, SUMMED
from ..words import Reason
from .rounded import Rounding

Anchors = tuple[NDArray[np.int64], NDArray[np.float64]]


@dataclass(frozen=True)
class Request:
    """What is asked for, and what is known beside the matrix."""

    matrix: OperatorMatrix
    clock: Clock
    anchors: Sequence[Any] | None = None  # (row, x, y) or (row, x, y, z)
    cells: bool = True  # look for elements too, not only where nothing else confirms positions
    choice: str = ""  # why the matrix was taken for what it is
    rounding: Rounding | None = None  # of the entries, where they have few digits

    def held(self, node_of_row: NDArray[np.int64], d: int) -> Anchors:
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


def anchored(
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    n_pieces: int,
    anchors: Anchors,
    verdict: tuple[str, Reason],
    edge: float,
    *,
    sized: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str], tuple[str, Reason]]:
    """Move pieces to their anchors; axes stay, and so does the size if pieces are `sized`. With factor, notes, verdict.

    The factor, (n_pieces,), is that by which each piece was enlarged; negative where it was reflected in a point, NaN
    where the size is by convention. What was certified is not if its coordinates, of that mean `edge`, lost more digits
    than entries would bear, as they do far from the origin.
    """
    nodes, places = anchors
    points, factor, notes, lost = points.copy(), np.full(n_pieces, 1.0 if sized else np.nan), [], 0.0
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
        lost = max(lost, float(np.abs((points[body] - shift) - before).max() / abs(size)) / edge)
        misfit = float(np.linalg.norm(points[nodes[here]] - wanted, axis=1).max())
        if here.sum() > 1 and misfit > ALIKE * np.linalg.norm(y, axis=1).max():
            notes.append(f"the anchors do not fit the mesh: one is missed by {misfit:.3g}")
    if verdict[0] == "certified" and lost > SUMMED:
        verdict = (
            "uncertified",
            Reason.of(
                f"the anchors lie so far from the origin that coordinates, as written, are off by {lost:.1e} edge "
                "lengths: they have too few digits left",
                f"before, {verdict[1].text}",
                advice="subtract a point near the anchors from all of `anchors`",
            ),
        )
    return points, factor, notes, verdict
