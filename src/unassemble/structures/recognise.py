"""Whether a matrix is that of a frame, shell or plate, and how its unknowns stand.

The displacements of one direction, all the same, cost nothing: a row away from supports annihilates them. Rotations,
all the same and without displacements, bend everything. This tells the layouts from one another, and from solids.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..errors import InputError
from ..nodes.grouping import by_first_row, same_pattern
from ..nodes.orders import ORDERS, regular
from ..tolerances import CANCELLED, HARDLY_ANY, LITTLE
from .layouts import LAYOUTS, SPACE, Layout

# On regular meshes some of a solid's rows annihilate whatever is asked; read as what it is it has more of them.
_SOLIDS = (Layout("solid", 3, (0, 1, 2), ()), Layout("solid", 2, (0, 1), ()))


@dataclass(frozen=True, eq=False)
class StructuralNumbering:
    """Nodes and directions of the rows of a structure's matrix.

    Attributes
    ----------
    layout : Layout
    node_of_row, direction_of_row : (N,) int64
        A direction of -1 is not known.
    kind : {"interleaved", "by component", "given"}
    share : float
        Share of the rows that annihilate all translations.
    """

    layout: Layout
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    kind: str
    share: float

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self.node_of_row.max()) + 1

    @property
    def block_size(self) -> int:
        """Unknowns per node."""
        return self.layout.block_size


def find_structure(
    matrix: sp.csr_array, kind: str | None = None, block_size: int | None = None
) -> StructuralNumbering | None:
    """Recognise the matrix of a structure; None if it is none.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    kind : {None, "interleaved", "by component"}
    block_size : int, optional
    """
    orders = ORDERS if kind is None else (kind,)
    sizes = {layout.block_size for layout in (*_SOLIDS, *LAYOUTS)}
    usual = {
        (b, name): regular(matrix.shape[0], b, name)
        for b in sizes
        for name in orders
        if matrix.shape[0] % b == 0 and matrix.shape[0] >= 2 * b
    }
    best = _best(matrix, usual, block_size)
    if best is None and kind != "by component":
        best = _best(matrix, {(b, "interleaved"): _with_gaps(matrix, b) for b in (3, 6)}, block_size)
    return best if best is not None and best.layout.rotations else None


def _best(
    matrix: sp.csr_array,
    numberings: Mapping[tuple[int, str], tuple[NDArray[np.int64], NDArray[np.int64]] | None],
    block_size: int | None,
) -> StructuralNumbering | None:
    """The layout and the numbering, by its block size and name, with most rows that annihilate translations."""
    best, most = None, HARDLY_ANY
    for layout in (*_SOLIDS, *LAYOUTS):
        for (b, name), numbering in numberings.items():
            if numbering is None or layout.block_size != b or block_size not in (None, b):
                continue
            share = _share(matrix, layout, numbering[1])
            if share > most:
                best, most = StructuralNumbering(layout, *numbering, name, share), share
    return best


def given_structure(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> StructuralNumbering | None:
    """A numbering that the caller knows, if it is that of a structure; None for those of solids.

    Directions count displacements first, then rotations; nodes may lack some.

    Raises
    ------
    InputError
        If there are four or five directions, or rows do not fit the matrix.
    """
    node, direction = np.asarray(node, dtype=np.int64), np.asarray(direction, dtype=np.int64)
    if node.shape != direction.shape or node.shape != matrix.shape[:1] or not len(node) or direction.min() < 0:
        return None  # elasticity says what is wrong
    size = int(direction.max()) + 1
    if size in (4, 5):
        raise InputError(f"nodes with {size} unknowns are not known: frames and shells have 6, solids 2 or 3")
    node = by_first_row(node)
    if len(np.unique(node * size + direction)) < len(node):
        return None
    fitting = [layout for layout in LAYOUTS if layout.block_size == size]
    shares = [_share(matrix, layout, direction) for layout in fitting]
    if size != SPACE.block_size and max(shares, default=0) <= HARDLY_ANY:
        return None
    if not fitting:
        return None
    best = int(np.argmax(shares))
    return StructuralNumbering(fitting[best], node, direction, "given", shares[best])


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
    return 0.0 if layout.rotations and own[turning].mean() > (LITTLE + layout.twisting) * share else share


def _with_gaps(matrix: sp.csr_array, b: int) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Nodes of rows that stand node by node, where some nodes lack unknowns; None if the pattern shows no nodes.

    The rows of a node couple to the same columns, zeros being stored, as assembly leaves them.

    Parameters
    ----------
    matrix : (N, N) sparse
    b : int
        Unknowns of a whole node.

    Returns
    -------
    node : (N,) int64
    direction : (N,) int64
        -1 for rows of nodes that lack unknowns: which ones, the pattern does not tell.
    """
    order = matrix.shape[0]
    first = np.flatnonzero(np.append(True, np.diff(same_pattern(matrix)) != 0))
    length = np.diff(np.append(first, order))
    if (length % b)[length > b].any() or 2 * length[length % b == 0].sum() < order:
        return None
    # Neighbours in the numbering may couple to the same columns all by chance: such a run is several nodes.
    within = np.arange(order) - np.repeat(first, length)
    whole = np.repeat(length % b == 0, length)
    node = np.cumsum((within == 0) | (whole & (within % b == 0))) - 1
    return node, np.where(whole, within % b, -1)
