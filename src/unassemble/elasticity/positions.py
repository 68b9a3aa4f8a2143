"""Positions of all pieces of a body, from the identities that are valid, and what rows next to rollers still say.

A row next to unknowns of direction b that were taken out lacks some coefficients of its blocks (c, b), of which it
keeps one number: all of them together would add up to zero. If the nodes that lack direction b lie in a plane
across b, as on rollers and symmetry planes they do, that number is enough for the coordinate x_b, the same in
all of them: the missing coefficients may be thought of as any that have this sum. So A^{cb} x_b = p_c + 2 delta_cb q_b
stays valid, though A^{cb} x_a for other a does not. And x_b is constant over such nodes, one more equation each.

That they lie in a plane is an assumption. It is refused where no exact null field is left with it.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.nodal import NodalMatrix, determined, eliminated, surrounded, valid_pairs
from .nullspace.placing import Solution, placed
from .straight import straight

# Nodes of a body in space beyond which planes are asked at once where there are rollers: without them rows next to
# rollers leave hundreds of fields free, all of which charts would look for.
_LARGE = 2000


def solve(nodal: NodalMatrix) -> Solution:
    """Place all nodes; GeometryError if no piece has positions."""
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
        if found is None or not (found.unique and np.isfinite(found.firm_points).all()):
            found = _with_planes(nodal, found, valid)
    if not (found is not None and found.unique):
        with suppress(GeometryError):
            other = placed(nodal, valid, straight)
            found = other if other.straight else found
    if found is None:
        raise failure or GeometryError("no positions fit the valid rows")
    return found


def _with_planes(nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_]) -> Solution | None:
    """Once more with what rows next to rollers say, if there are any, and that fits and determines more.

    What is determined by that only hangs on an assumption: elements have to show it.
    """
    completed = _completed(nodal, valid)
    if completed is None:
        return found
    try:
        other = replace(placed(*completed), planes=True, valid=valid)
    except GeometryError:
        return found
    if not other.exact:
        return found
    if other.unique:
        hanging = determined(other.points)
        if found is not None and found.unique:
            hanging &= ~determined(found.points)
        other = replace(other, hanging=hanging if hanging.any() else None)
    return found if found is not None and other.rank <= found.rank else other


def _completed(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NodalMatrix, NDArray[np.bool_]] | None:
    """Complete the rows next to rollers; None where there are none.

    The missing sums are put to neighbours that lack the direction, and in places (b, b) of nodes that lack b the
    differences of x_b to neighbours that do. What is valid then, (n, d, d, d), goes by component c of the row, b of the
    columns, and a of the coordinate.
    """
    d = nodal.dim
    present = nodal.row_of >= 0
    gone = eliminated(nodal) & ~nodal.doubtful[:, None]  # or the missing row may be another node's
    whole = surrounded(nodal, valid)  # or more is missing than a roller takes
    graph = nodal.graph
    count = graph @ gone.astype(float)
    held = ((count > 0) & whole[:, None])[:, None, :] & present[:, :, None] & (nodal.size > 0)[:, None, None]
    held &= ~(nodal.penalised[:, None, :] & np.eye(d, dtype=bool))  # beside a penalty the sum does not show
    if not held.any():
        return None
    missing = -nodal.row_sums() / np.maximum(count, 1)[:, None, :]
    i, j = nodal.node, nodal.indices
    data = nodal.data + np.where(held, missing, 0)[i] * gone[j][:, None, :]
    flat = gone & (count > 1) & (nodal.size > 0)[:, None]
    level = np.where(i == j, 1.0, 0.0)[:, None] - gone[j] / np.maximum(count, 1)[i]
    full: NDArray[np.bool_] = np.repeat(valid[..., None], d, axis=3)
    for b in range(d):
        data[:, b, b] += np.where(flat[i, b], nodal.size[i] * level[:, b], 0)
        full[:, :, b, b] |= held[:, :, b]
        full[:, b, b, b] |= flat[:, b]
    return replace(nodal, data=data), full
