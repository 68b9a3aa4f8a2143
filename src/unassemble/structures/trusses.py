"""Pin-jointed trusses: the block of two nodes is that of a bar, and tells its direction.

A bar between nodes i and j with direction e has A_ij = - k e e^T, and nothing else has. So for every bar, whatever its
stiffness, next to supports as well, (I - e e^T) (x_i - x_j) = 0: linear in the coordinates. All solutions have the
bars' directions; where the truss has enough of them, these are its translations and enlargements.
"""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..certificate import StructureCheck, check_bars
from ..errors import GeometryError
from ..nodes.anchoring import Request
from ..nodes.constants import row_sizes
from ..nodes.nodal import NodalMatrix, determined, nodal_matrix
from ..nodes.numbering import NodeNumbering
from ..nodes.orders import ORDERS, regular
from ..recovery import Evidence, Structure
from ..tolerances import CANCELLED, CERTIFIED, SMALL
from .answer import HeldStructure, about_loose, answer
from .least_squares import up_to_size
from .placed import EquationPiece, PlacedNodes, placed, without_free


class Bars(NamedTuple):
    """Bars of a truss."""

    ends: NDArray[np.int64]  # (m, 2) nodes, the lesser first
    directions: NDArray[np.float64]  # (m, d) unit vectors, sign arbitrary
    known: NDArray[np.bool_]  # False where both ends lack unknowns, so that only a part of the direction shows
    sure: NDArray[np.bool_]  # whose blocks are whole, and vouched for by the diagonal block of an end


def bars_of(nodal: NodalMatrix, allowed: float = CANCELLED) -> Bars | None:
    """The bars, if all pairs of coupled nodes are, but for what is `allowed`, and they span space; None if not so."""
    upper = (nodal.node < nodal.indices) & (np.abs(nodal.data).max(axis=(1, 2)) > 0)
    blocks = nodal.data[upper]
    if not len(blocks):
        return None
    some = np.linalg.svd(blocks[:SAMPLE], compute_uv=False)
    if (some[:, 1] > allowed * some[:, 0]).any():  # mostly a solid: not worth looking at all of it
        return None
    i, j = nodal.node[upper].astype(np.int64), nodal.indices[upper].astype(np.int64)
    left, size, right = np.linalg.svd(blocks)
    if (size[:, 1] > allowed * size[:, 0]).any():
        return None
    whole = nodal.row_of.min(axis=1) >= 0
    # Rows belong to i, columns to j: whichever has all its unknowns shows all of the direction.
    directions = np.where(whole[j][:, None], right[:, 0], left[:, :, 0])
    known = whole[i] | whole[j]
    both = whole[i] & whole[j]
    aligned = (left[both, :, 0] * right[both, 0]).sum(axis=1)
    if not both.any() or np.abs(np.abs(aligned) - 1).max() > allowed:
        return None
    spread = np.linalg.eigvalsh(directions[known].T @ directions[known] / known.sum())
    pulls = np.trace(blocks[both], axis1=1, axis2=2) > 0
    if spread[0] < CANCELLED or 0 < pulls.sum() < len(pulls):  # bars all in line or in a plane; of stiffness below zero
        return None
    vouched = _balanced(nodal, whole, -allowed if pulls.any() else allowed)
    return Bars(np.column_stack([i, j]), directions, known, both & (vouched[i] | vouched[j]))


def _balanced(nodal: NodalMatrix, whole: NDArray, allowed: float) -> NDArray[np.bool_]:
    """(n,) nodes whose blocks with whole nodes add up to nothing, or to bars that support one in some directions only.

    A negative `allowed` is for matrices of the other sign.
    """
    size = np.where(nodal.node == nodal.indices, np.inf, np.linalg.norm(nodal.data, axis=(1, 2)))
    there = nodal.data * whole[nodal.indices][:, None, None]
    left = np.sign(allowed) * np.add.reduceat(there, nodal.indptr[:-1], axis=0)
    least = np.linalg.eigvalsh((left + left.transpose(0, 2, 1)) / 2)[:, 0]
    return np.asarray(np.abs(least) <= abs(allowed) * np.minimum.reduceat(size, nodal.indptr[:-1]))


def truss_numbering(
    matrix: sp.csr_array, block_size: int | None = None, kind: str | None = None, allowed: float = CANCELLED
) -> NodeNumbering | None:
    """The usual numbering in which all blocks are those of bars, however many supports there are; None if none is.

    Of `block_size` 2 or 3 and a `kind` of order if these are known; what is `allowed` see :func:`bars_of`.
    """
    order = matrix.shape[0]
    sizes = [d for d in ((3, 2) if block_size is None else (block_size,)) if order % d == 0 and order >= 2 * d]
    for d, name in product(sizes, ORDERS if kind is None else (kind,)):
        node, direction = regular(order, d, name)
        numbering = NodeNumbering(node, direction, name, 0.0, d, row_sizes(matrix) == 0, 1.0)
        if bars_of(nodal_matrix(matrix, numbering), allowed) is not None:
            return numbering
    return None


def serve_truss(nodal: NodalMatrix, numbering: NodeNumbering, bars: Bars, request: Request) -> Structure:
    """Recover a truss, up to the size of each piece; errors as of :func:`.frames.serve_structure`."""
    rounding = request.rounding
    allowed = rounding.spread if rounding else CERTIFIED

    def again(matrix: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        nodal = nodal_matrix(matrix, numbering)
        bars = bars_of(nodal, allowed)
        if bars is None:
            raise GeometryError("blocks are no longer those of bars")
        points = _place_joints(bars, numbering.n_nodes, allowed).points
        return points, _misfits(nodal, points)

    with request.clock("solve"):
        found = _place_joints(bars, nodal.n, allowed)
    misfits, loose = _misfits(nodal, found.points), found.component < 0
    error = float(np.abs(misfits).max(initial=0.0))
    said = (
        "bars between the nodes re-assemble to the matrix",
        "blocks are off those of bars by {error:.1e} of a row's largest",
    )
    lines = bars.ends[~loose[bars.ends].any(axis=1)]
    node, direction = numbering.node_of_row, numbering.direction_of_row

    def check(points: NDArray[np.float64]) -> StructureCheck:
        return check_bars(request.matrix.csr(), node, direction, points, allowed=allowed)

    held = HeldStructure(error, check, misfits, again, rounding, said)
    free = "the sign of the scale is free: the point reflection of a truss has the same matrix"
    notes = about_loose(loose, "the directions of all bars leave them room")
    return answer(
        request, numbering, found, held, edges=lines, sized=False, free=free, notes=notes, lines=lines, operator="truss"
    )


def _place_joints(bars: Bars, n: int, allowed: float) -> PlacedNodes:
    """Find positions for which all bars have their directions.

    A block of which only one row or column is left is that of a bar for any numbers, and whole blocks are those of
    other bars if numbers are wrong, unless the diagonal block of an end contradicts: bars that only such blocks tell of
    count where others would contradict their directions.
    """
    ends, directions, sure = bars.ends[bars.known], bars.directions[bars.known], bars.sure[bars.known]
    m, d = directions.shape
    across = np.eye(d) - directions[:, :, None] * directions[:, None, :]
    # What a field moves the ends of each bar against each other across its direction.
    blocks = np.stack([across, -across], axis=1).reshape(2 * m, d, d)
    operator = sp.bsr_array((blocks, ends.ravel(), np.arange(0, 2 * m + 1, 2)), shape=(m * d, n * d)).tocsr()

    def solve(piece: EquationPiece) -> tuple[NDArray[np.float64], Evidence, NDArray[np.bool_]]:
        points, evidence, probes = up_to_size(piece, d)
        which = piece.rows[::d] // d
        seen = across[which] @ probes.reshape(len(which), d, -1)
        blind = ~sure[which] & (np.linalg.svd(seen, compute_uv=False)[:, d - 2] < SMALL)
        return points, replace(evidence, rows=len(which)), np.repeat(blind, d)

    return without_free(placed(operator, d, ends, solve, allowed), d + 1)


def _misfits(nodal: NodalMatrix, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Entries that are left of blocks, (k,), once the bars between the given points are taken away.

    Relative to the largest off-diagonal entry of the node's rows; pairs with undetermined nodes do not count. Infinite
    where both ends of a bar lie in one point.
    """
    known = determined(points)
    i, j = nodal.node, nodal.indices
    off = (i != j) & known[i] & known[j]
    blocks, i, j = nodal.data[off], i[off], j[off]
    along = points[i] - points[j]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if (length == 0).any():
        return np.array([np.inf])  # a bar without length has no direction
    along /= length
    present = nodal.row_of >= 0
    bar = along[:, :, None] * along[:, None, :] * (present[i][:, :, None] & present[j][:, None, :])
    weight = (bar * bar).sum(axis=(1, 2))
    force = (blocks * bar).sum(axis=(1, 2)) / np.where(weight > 0, weight, 1)
    left = blocks - force[:, None, None] * bar
    size = np.zeros(nodal.n)
    np.maximum.at(size, i, np.abs(blocks).max(axis=(1, 2), initial=0))
    return np.asarray(left / np.where(size[i] > 0, size[i], 1)[:, None, None]).ravel()
