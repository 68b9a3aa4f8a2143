"""Positions of all pieces of a body, from the identities that are valid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from .nodal import NodalMatrix, determined, valid_pairs
from .nullspace.control import uncontrolled
from .nullspace.corners import corners_of, with_corners
from .nullspace.identities import boundary_terms
from .nullspace.material import poisson_ratio
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
    if found.whole or not found.unique or (nodal.doubtful is None and nodal.blurred is None):
        return found
    try:
        other = _solve(replace(nodal, doubtful=None, blurred=None), patch)
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
            found = straightened(nodal, found, valid, completed, patch)
            if found is not None and found.straight and found.planes:  # elements told axes only
                found = replace(found, hanging=determined(found.points))
        if found is None:
            continue
        found = replace(_with_ratio(nodal, found, completed, patch), strict=strict)
        if strict:
            found = _with_corners(nodal, found, rows)
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
    if other.unique:
        hanging = uncontrolled(completed, full, full & ~valid[..., None], other.points)
        other = _hanging_on(other, hanging, found)
    if not other.exact or (found is not None and other.rank <= found.rank):
        return found
    return other


def _hanging_on(found: Solution, uncontrolled: NDArray[np.bool_], before: Solution | None) -> Solution:
    """Positions, and which of them hang on an assumption: in the plane all that are not determined without it.

    There a row next to a roller has as many equations as it has coordinates, or hardly more, and in meshes that repeat
    those that control each other are controlled by none.
    """
    hanging = uncontrolled
    if found.points.shape[1] == 2:
        hanging = determined(found.points)
        if before is not None and before.unique:
            hanging &= ~determined(before.firm_points)
    return replace(found, hanging=hanging if hanging.any() else None)


def _with_ratio(
    nodal: NodalMatrix,
    found: Solution,
    completed: tuple[NodalMatrix, NDArray[np.bool_]] | None,
    patch: int | None,
) -> Solution:
    """Once more with Poisson's ratio, if it is one number and nodes were left loose."""
    if found.whole or not found.unique or found.straight:  # only points that are unique have a ratio to read off
        return found
    firm = found.firm_points
    nu = poisson_ratio(nodal, found.valid, firm)
    if nu is None:
        return found
    rows, full = completed if completed is not None and found.planes else (nodal, found.valid)
    terms = boundary_terms(nodal.dim, 2 * nu / (1 - 2 * nu))
    try:
        other = placed(rows, full, patch, terms)
    except GeometryError:
        return found
    if other.unique:  # that the ratio is the same there is an assumption, too
        new = determined(other.points) & ~determined(firm)
        assumed = ~found.valid | (nodal.graph @ new.astype(float) > 0)[:, None, None]
        full = full if full.ndim == 4 else np.repeat(full[..., None], nodal.dim, axis=3)
        hanging = uncontrolled(rows, full, full & assumed[..., None], other.points, terms)
        other = _hanging_on(other, hanging, found)
    if other.rank <= found.rank:
        return found
    return replace(other, planes=found.planes, valid=found.valid, ratio=2 * nu / (1 - 2 * nu))


def _with_corners(nodal: NodalMatrix, found: Solution, valid: NDArray[np.bool_]) -> Solution:
    """Once more where planes of rollers meet, with Poisson's ratio if that is what it takes."""
    if found.whole or not found.unique or found.straight:
        return found
    nu, loose = poisson_ratio(nodal, found.valid, found.firm_points), ~determined(found.firm_points)
    for ratio in (None,) if nu is None else (None, 2 * nu / (1 - 2 * nu)):
        terms = None if ratio is None else boundary_terms(nodal.dim, ratio)
        firm = found.firm_points
        points, component = with_corners(nodal, valid, firm, found.component, terms)
        new = determined(points) & ~determined(firm)
        if new.any():
            hanging = np.zeros(nodal.n, dtype=bool) if found.hanging is None else found.hanging & ~new
            if nodal.dim == 2:  # as all that an assumption places there
                hanging |= new
            elif nodal.sure is not None:
                hanging |= new & ~nodal.sure
            found = replace(
                found,
                points=np.where(new[:, None], points, found.points),
                component=np.where(new, component, found.component),
                planes=True,
                ratio=found.ratio if ratio is None else ratio,
                hanging=hanging if hanging.any() else None,
            )
    return replace(found, corners=corners_of(nodal, valid, found.points, loose))
