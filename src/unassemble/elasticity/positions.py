"""Positions of all pieces of a body, from the identities that are valid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.nodal import NodalMatrix, determined, valid_pairs
from .nullspace.identities import boundary_terms
from .nullspace.material import lame_ratio
from .nullspace.placing import placed
from .nullspace.planes import with_planes
from .nullspace.solution import Solution
from .straight.straight import straightened

# Nodes of a body in space beyond which planes are asked at once where there are rollers: without them rows next to
# rollers leave hundreds of fields free, all of which charts would look for.
_LARGE = 2000


def solve(nodal: NodalMatrix, patch: int | None) -> Solution:
    """Place all nodes, those that only rows in doubt determine once more without the doubts.

    The equations without doubts are among the others, so that nodes which they determine lie where they lay. All others
    need elements that show them; where these do not, the solution with doubts is still there.
    """
    found = _solve(nodal, patch)
    if found.whole or not found.unique or nodal.doubtful is None:
        return found
    try:
        other = _solve(replace(nodal, doubtful=None), patch)
    except GeometryError:
        return found
    if not other.unique or other.straight or determined(other.points).sum() <= determined(found.points).sum():
        return found
    return replace(other, hanging=determined(other.points) & ~determined(found.firm_points), cautious=found)


def _solve(nodal: NodalMatrix, patch: int | None) -> Solution:
    """Place all nodes: read validity strictly, and only where that determines nothing leniently."""
    best: Solution | None = None
    failure: GeometryError | None = None
    for strict in (True, False):
        valid = valid_pairs(nodal, strict=strict)
        if best is not None and np.array_equal(valid, best.valid):
            break
        found, rows, completed = None, valid, None
        if strict and nodal.dim == 3 and nodal.n > _LARGE and not nodal.penalised.any():
            found, completed = _planes_at_once(nodal, valid, patch)
        if found is None:
            try:
                found = placed(nodal, valid, patch)
            except GeometryError as error:
                failure = failure or error
            if strict and not (found is not None and found.whole):
                found, rows = _with_diagonals(nodal, found, valid, patch)
            completed = with_planes(nodal, rows) if strict and not (found is not None and found.whole) else None
            if completed is not None:
                found = _with_planes(*completed, found, rows, patch)
        if strict and not (found is not None and found.unique):
            found = straightened(nodal, found, valid, patch)
            if found is not None and found.straight and found.planes:  # elements told axes only
                found = replace(found, hanging=determined(found.points))
        if found is None:
            continue
        ratio = _read_ratio(nodal, found)
        if ratio is not None:
            found = _with_ratio(nodal, found, ratio, completed, patch)
        found = replace(found, strict=strict)
        if found.unique:
            return found
        best = best or found
    if best is None:
        raise failure or GeometryError("no positions fit the valid rows")
    return best


def _with_diagonals(
    nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_], patch: int | None
) -> tuple[Solution | None, NDArray[np.bool_]]:
    """Once more with rows that have a penalty, their diagonals inferred, if that fits and determines more."""
    more = valid_pairs(nodal, inferred=True)
    if np.array_equal(more, valid):
        return found, valid
    try:
        other = placed(nodal, more, patch)
    except GeometryError:
        return found, valid
    return (other, more) if other.exact and (found is None or other.rank > found.rank) else (found, valid)


def _planes_at_once(
    nodal: NodalMatrix, valid: NDArray[np.bool_], patch: int | None
) -> tuple[Solution | None, tuple[NodalMatrix, NDArray[np.bool_]] | None]:
    """Positions with what rows next to rollers say, and these rows; None if there are none, or much stays free."""
    completed = with_planes(nodal, valid)
    found = None if completed is None else _with_planes(*completed, None, valid, patch)
    return (found, completed) if found is not None and found.unique else (None, None)


def _with_planes(
    completed: NodalMatrix, full: NDArray[np.bool_], found: Solution | None, valid: NDArray[np.bool_], patch: int | None
) -> Solution | None:
    """Once more with what rows next to rollers say, if that fits and determines more."""
    try:
        other = replace(placed(completed, full, patch), planes=True, valid=valid)
    except GeometryError:
        return found
    if not other.exact:
        return found
    return _better(found, other)


def _better(found: Solution | None, other: Solution) -> Solution:
    """The solution that rests on assumed equations, and which of its points hang on them; `found` if that has more.

    All of them hang that are not determined without: elements have to show them.
    """
    if found is not None and other.rank <= found.rank:
        return found
    if not other.unique:
        return other
    hanging = determined(other.points)
    if found is not None and found.unique:
        hanging &= ~determined(found.firm_points)
    other = replace(other, hanging=hanging if hanging.any() else None)
    return found if found is not None and other.rank <= found.rank else other


def _read_ratio(nodal: NodalMatrix, found: Solution) -> float | None:
    """The number lambda / mu where it may place nodes that were left loose."""
    if found.whole or not found.unique or found.straight:  # only points that are unique have a ratio to read off
        return None
    return lame_ratio(nodal, found.valid, found.firm_points)


def _with_ratio(
    nodal: NodalMatrix,
    found: Solution,
    ratio: float,
    completed: tuple[NodalMatrix, NDArray[np.bool_]] | None,
    patch: int | None,
) -> Solution:
    """Once more with lambda / mu, if it is one number; that it is the same everywhere is an assumption, too."""
    rows, valid = completed if completed is not None and found.planes else (nodal, found.valid)
    terms = boundary_terms(nodal.dim, ratio)
    try:
        other = replace(placed(rows, valid, patch, terms), planes=found.planes, valid=found.valid, ratio=ratio)
    except GeometryError:
        return found
    return _better(found, other)
