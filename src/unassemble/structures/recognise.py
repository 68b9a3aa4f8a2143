"""Whether a matrix is that of a frame, shell or plate, and how its unknowns stand.

The displacements of one direction, all the same, cost nothing: a row away from supports annihilates them. Rotations,
all the same and without displacements, bend everything. This tells the layouts from one another, and from solids.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..nodes.grouping import by_first_row, pattern_of
from ..nodes.numbering import Rows
from ..nodes.orders import ORDERS, regular
from ..tolerances import CANCELLED, HARDLY_ANY, LITTLE, MOST
from .gaps import continued, with_gaps
from .layouts import LAYOUTS, SOLIDS, SPACE, Layout

# On regular meshes some of a solid's rows annihilate whatever is asked; read as what it is it has more of them.
_KNOWN = (*SOLIDS.values(), *LAYOUTS)


@dataclass(frozen=True, eq=False)
class StructuralNumbering(Rows):
    """Nodes and directions of the rows of a structure's matrix."""

    layout: Layout

    @property
    def block_size(self) -> int:
        """Unknowns per node."""
        return self.layout.block_size

    @property
    def told(self) -> float:
        """Share of all rows whose direction is known and that annihilate translations."""
        return float(self.share * np.mean(self.direction_of_row >= 0))


def find_structure(
    matrix: sp.csr_array, kind: str | None = None, block_size: int | None = None
) -> StructuralNumbering | None:
    """Recognise the symmetric matrix (N, N) of a structure, in one `kind` of order or any; None if it is none."""
    order, orders = matrix.shape[0], ORDERS if kind is None else (kind,)
    sizes = {
        layout.block_size for layout in _KNOWN if order % layout.block_size == 0 and order >= 2 * layout.block_size
    }
    usual = {(b, name): regular(order, b, name) for b in sizes for name in orders}
    best = _best(matrix, usual, block_size)
    if (best is None or best.share < MOST) and kind != "by component" and matrix.diagonal().all():
        other = _best(matrix, {(b, "interleaved"): with_gaps(matrix, b) for b in (3, 6)}, block_size)
        best = max((one for one in (best, other) if one is not None), key=lambda one: one.told, default=None)
        if best is other and best is not None and best.layout.rotations:
            node, direction = continued(matrix, best.layout, best.node_of_row, best.direction_of_row)
            best = replace(best, node_of_row=node, direction_of_row=direction)
    return _beside(matrix, best) if best is not None and best.layout.rotations else None


def _beside(matrix: sp.csr_array, one: StructuralNumbering) -> StructuralNumbering:
    """The same where each node has further rows, before its own or after: those of the same node, if they couple alike.

    So stand the displacements in the plane of a plate beside those across it, to which they are not coupled.
    """
    told = one.direction_of_row[np.flatnonzero(np.diff(one.node_of_row, prepend=-1))] >= 0
    if one.kind != "interleaved" or len(told) % 2 or (told[::2] != told[0]).any() or (told[1::2] == told[0]).any():
        return one
    onto = sp.csr_array((np.ones(len(one.node_of_row)), (np.arange(len(one.node_of_row)), one.node_of_row)))
    near = sp.csr_array(onto.T @ pattern_of(matrix) @ onto) != 0
    same = near[::2][:, ::2] != near[1::2][:, 1::2]
    return one if same.nnz > HARDLY_ANY * near.nnz else replace(one, node_of_row=one.node_of_row // 2)


def _best(
    matrix: sp.csr_array,
    numberings: Mapping[tuple[int, str], tuple[NDArray[np.int64], NDArray[np.int64]]],
    block_size: int | None,
) -> StructuralNumbering | None:
    """The layout and the numbering, by its block size and name, with most rows that annihilate translations."""
    found = [
        StructuralNumbering(*numbering, name, _share(matrix, layout, numbering[1]), layout)
        for layout in _KNOWN
        for (b, name), numbering in numberings.items()
        if layout.block_size == b and block_size in (None, b)
    ]
    return max((one for one in found if one.told > HARDLY_ANY), key=lambda one: one.told, default=None)


def given_structure(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> StructuralNumbering | None:
    """A numbering that the caller knows, if it is that of a structure; None for those of solids.

    Directions count displacements first, then rotations; nodes may lack some. None too where rows do not fit.
    """
    node, direction = np.asarray(node, dtype=np.int64), np.asarray(direction, dtype=np.int64)
    if node.shape != direction.shape or node.shape != matrix.shape[:1] or not len(node) or direction.min() < 0:
        return None  # elasticity says what is wrong
    size = int(direction.max()) + 1
    node = by_first_row(node)
    if len(np.unique(node * size + direction)) < len(node):
        return None
    fitting = [layout for layout in LAYOUTS if layout.block_size == size]
    found = [StructuralNumbering(node, direction, "given", _share(matrix, one, direction), one) for one in fitting]
    best = max(found, key=lambda one: one.share, default=None)
    return best if best and (size == SPACE.block_size or best.share > HARDLY_ANY) else None


def _share(matrix: sp.csr_array, layout: Layout, direction: NDArray) -> float:
    """Share of rows that annihilate all displacements, of forces or of moments, whichever is less.

    None do if rotations are annihilated like displacements.
    """
    rows = np.arange(len(direction))
    if len(rows) > SAMPLE:
        rows = np.sort(np.random.default_rng(0).choice(rows, SAMPLE, replace=False))
    rows = rows[(np.diff(matrix.indptr)[rows] > 1) & (direction[rows] >= 0)]
    some = sp.csr_array(matrix[rows])
    labels = (direction[:, None] == np.arange(layout.block_size)).astype(float)
    size = abs(some) @ labels
    zero = np.abs(some @ labels) <= CANCELLED * size
    coupled = size > 0
    moves = len(layout.displacements)
    turning = direction[rows] >= moves
    own = zero[np.arange(len(rows)), direction[rows]]
    if not len(rows) or (layout.rotations and not turning.any()):
        return 0.0
    good = (zero | ~coupled)[:, :moves].all(axis=1)
    tells = coupled[:, :moves].any(axis=1)
    kinds = [kind & tells for kind in (turning, ~turning) if kind.any()]
    share = float(min(good[kind].mean() if kind.any() else 0.0 for kind in kinds))
    if not layout.rotations:
        return share
    twisting = max(axis < layout.dim for axis in layout.rotations) / len(layout.rotations)  # a line, about its own axis
    return 0.0 if own[turning].mean() > (LITTLE + twisting) * share else share
