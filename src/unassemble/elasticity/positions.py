"""Positions of all pieces of a body, from the identities that are valid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from .nodal import NodalMatrix, determined, valid_pairs
from .nullspace.extending import extended, overdetermined, well_supplied
from .nullspace.identities import boundary_terms
from .nullspace.material import poisson_ratio
from .nullspace.placing import placed
from .nullspace.planes import with_planes
from .nullspace.solution import Solution
from .straight.straight import straightened

_ACCURATE = 1e-11  # residual over gap up to which nodes are placed from others without loss


def solve(nodal: NodalMatrix, patch: int | None) -> Solution:
    """Place all nodes: read validity strictly, and only where that determines nothing leniently."""
    best: Solution | None = None
    failure: GeometryError | None = None
    for strict in (True, False):
        valid = valid_pairs(nodal, strict=strict)
        if best is not None and np.array_equal(valid, best.valid):
            break
        rows, completed = valid, None
        found = _well_supplied_first(nodal, valid, patch) if strict else None
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
        if found is None:
            continue
        found = replace(_with_ratio(nodal, found, completed, patch), strict=strict)
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


def _with_planes(
    completed: NodalMatrix, full: NDArray[np.bool_], found: Solution | None, valid: NDArray[np.bool_], patch: int | None
) -> Solution | None:
    """Once more with what rows next to rollers say, if that fits and determines more."""
    other = _more(completed, full, found, patch)
    if other is None or not other.exact or (found is not None and other.rank <= found.rank):
        return found
    return replace(other, planes=True, valid=valid, leaning=_leaning(found, other, (completed, full)))


def _well_supplied_first(nodal: NodalMatrix, valid: NDArray[np.bool_], patch: int | None) -> Solution | None:
    """Positions from rows that have enough equations, then from the others; None if the first are not unique so."""
    first = well_supplied(nodal, valid)
    if np.array_equal(first, valid):
        return None
    try:
        found = placed(nodal, first, patch)
    except GeometryError:
        return None
    if not found.unique:
        return None
    more = _more(nodal, valid, found, patch) if _firm(found) else None
    return replace(found if more is None else more, valid=valid)


def _more(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    found: Solution | None,
    patch: int | None,
    terms: NDArray[np.float64] | None = None,
) -> Solution | None:
    """Positions from more rows than those found; None if these do not fit.

    Nodes of one piece with places that are unique stay where they are, if these are known without loss. What other rows
    have placed since is placed anew: nodes that few rows hold feel rounding, and would hand it on.
    """
    if found is None or not _firm(found):
        try:
            return placed(nodal, valid, patch, terms)
        except GeometryError:
            return None
    firm = found.points if found.firm is None else found.firm
    more = extended(nodal, valid, firm, terms)
    if more is None:
        return None
    points, residual = more
    (one,) = found.evidence
    evidence = (replace(one, residual=float(np.hypot(one.residual, residual))),)
    component = np.where(determined(points), 0, -1)
    return replace(found, points=points, component=component, evidence=evidence, firm=firm)


def _firm(found: Solution) -> bool:
    """Whether others can be placed from what was found."""
    if not found.unique or len(found.evidence) > 1:
        return False
    return found.firm is not None or found.evidence[0].residual <= _ACCURATE * found.evidence[0].gap


def _leaning(
    before: Solution | None,
    after: Solution,
    rows: tuple[NodalMatrix, NDArray[np.bool_]],
    terms: NDArray[np.float64] | None = None,
) -> NDArray[np.bool_]:
    """(n,) nodes that an assumption places and few equations: all, if without it more than translation, scale is free.

    Where there are equations enough they would not fit if it were false.
    """
    leaning = determined(after.points)
    if before is not None and before.unique:
        leaning &= ~determined(before.points) & ~overdetermined(*rows, before.points, terms)
        if before.leaning is not None:
            leaning |= before.leaning
    return leaning


def _with_ratio(
    nodal: NodalMatrix,
    found: Solution,
    completed: tuple[NodalMatrix, NDArray[np.bool_]] | None,
    patch: int | None,
) -> Solution:
    """Once more with Poisson's ratio, if it is one number and nodes were left loose."""
    if found.whole or not found.unique or found.straight:  # only points that are unique have a ratio to read off
        return found
    nu = poisson_ratio(nodal, found.valid, found.points)
    if nu is None:
        return found
    rows = completed if completed is not None and found.planes else (nodal, found.valid)
    ratio = 2 * nu / (1 - 2 * nu)
    terms = boundary_terms(nodal.dim, ratio)
    other = _more(*rows, found, patch, terms)
    if other is None or not other.exact or other.rank <= found.rank:
        return found
    return replace(
        other, planes=found.planes, valid=found.valid, ratio=ratio, leaning=_leaning(found, other, rows, terms)
    )
