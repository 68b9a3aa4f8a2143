"""Positions of all pieces of a body, from the identities that are valid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.nodal import NodalMatrix, determined, valid_pairs
from .nullspace.placing import placed
from .nullspace.planes import with_planes
from .nullspace.solution import Solution
from .straight.straight import straightened

# Nodes of a body in space beyond which planes are asked at once where there are rollers: without them rows next to
# rollers leave hundreds of fields free, all of which charts would look for.
_LARGE = 2000


def solve(nodal: NodalMatrix) -> Solution:
    """Place all nodes.

    Raises
    ------
    GeometryError
        If no piece has positions.
    """
    valid = valid_pairs(nodal)
    found: Solution | None = None
    failure: GeometryError | None = None
    if nodal.dim == 3 and nodal.n > _LARGE and not nodal.penalised.any():
        at_once = _with_planes(nodal, None, valid)
        found = at_once if at_once is not None and at_once.unique else None
    if found is None:
        try:
            found = placed(nodal, valid)
        except GeometryError as error:
            failure = error
        if not (found is not None and found.whole):
            found = _with_planes(nodal, found, valid)
    if not (found is not None and found.unique):
        found = straightened(nodal, found, valid)
        if found is not None and found.straight and found.planes:  # elements told axes only
            found = replace(found, hanging=determined(found.points))
    if found is None:
        raise failure or GeometryError("no positions fit the valid rows")
    return found


def _with_planes(nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_]) -> Solution | None:
    """Once more with what rows next to rollers say, if there are any, and that fits and determines more.

    What is determined by that only hangs on an assumption: elements have to show it.
    """
    completed = with_planes(nodal, valid)
    if completed is None:
        return found
    try:
        other = replace(placed(*completed), planes=True, valid=valid)
    except GeometryError:
        return found
    if not other.exact or (found is not None and other.rank <= found.rank):
        return found
    if not other.unique:
        return other
    hanging = determined(other.points)
    if found is not None and found.unique:
        hanging &= ~determined(found.points)
    other = replace(other, hanging=hanging if hanging.any() else None)
    return found if found is not None and other.rank <= found.rank else other
