"""Which rows of a matrix belong to one node, and to which direction each of them.

Two kinds of evidence decide. Constants: in the right numbering the columns of one direction add up to zero in
the rows of interior nodes. And the pattern: the unknowns of a node couple to the same unknowns. The usual orders are
tried first, whole and then with gaps; only where they fail is searched for nodes anywhere.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import InputError, RecoveryError
from ..tolerances import MOST, NEARLY_ALL
from .constants import row_sizes
from .grouping import by_first_row, coupled_in_common, made_up, same_pattern
from .numbering import NodeNumbering, measured
from .orders import ORDERS, Reading, regular
from .searching import searched

MORE_THAN_STIFFNESS = (
    "a mass matrix, a multiple of the identity or springs at all nodes were added, or unknowns are scaled one by one"
)


def find_numbering(matrix: sp.csr_array, block_size: int | None = None, *, at_sight: bool = False) -> NodeNumbering:
    """Recognise nodes and directions of a symmetric matrix (N, N), with 2 or 3 unknowns per node if that is known.

    Nodes are looked for `at_sight` only where a glance shows that there are some: unknowns in order, or rows of the
    same pattern. InputError for other block sizes, RecoveryError if no numbering makes rows annihilate constants.
    """
    sizes = _sizes(block_size)
    best = _in_order(matrix, sizes)
    shown = not at_sight or (best is not None and best.common > NEARLY_ALL)
    if best is None or not best.clear:
        group = same_pattern(matrix, row_sizes(matrix) == 0)  # which several nodes may share
        shown = shown or bool(np.mean(np.bincount(group)[group] > 1) > 0.5)
        best = _best([best, *searched(matrix, sizes)]) if shown else None
    if best is None:
        raise RecoveryError(
            f"no numbering with {block_size or '2 or 3'} unknowns per node makes the rows annihilate translations: "
            f"this is no elasticity matrix, or {MORE_THAN_STIFFNESS}, or supports take entries from nearly all rows"
        )
    return best


def nodes_of_pattern(matrix: sp.csr_array) -> tuple[int, int] | None:
    """How many nodes there are and their unknowns, by what rows couple to; None where none show.

    Sums are not asked: this is for matrices whose rows do not annihilate translations.
    """
    order = matrix.shape[0]
    for d, kind in product((3, 2), ORDERS):
        if order % d == 0 and coupled_in_common(matrix, regular(order, d, kind)[0]) > NEARLY_ALL:
            return order // d, d
    group = same_pattern(matrix, row_sizes(matrix) == 0)
    of_size = np.bincount(np.bincount(group)[group], minlength=4)
    d = 3 if of_size[3] > of_size[2] else 2
    return (int(group.max()) + 1, d) if of_size[d] > NEARLY_ALL * order else None


def regular_numbering(matrix: sp.csr_array, kind: str, block_size: int | None = None) -> NodeNumbering:
    """The numbering of unknowns in an order that the caller knows, "interleaved" or "by component".

    InputError if the order of the matrix is no multiple of the block size; RecoveryError if the rows of this numbering
    do not annihilate translations.
    """
    order = matrix.shape[0]
    sizes = [d for d in _sizes(block_size) if order % d == 0]
    if not sizes:
        raise InputError(f"a matrix with {order} rows has no numbering {kind!r} with {block_size or '2 or 3'} unknowns")
    best = _best(_regular(matrix, d, kind, checked=False) for d in sizes)
    if best is None:
        raise RecoveryError(f"with unknowns {kind} no row annihilates translations: this is no elasticity matrix, or "
                            "its unknowns stand in another order")  # fmt: skip
    return best


def _sizes(block_size: int | None) -> tuple[int, ...]:
    if block_size not in (None, 2, 3):
        raise InputError(f"the block size is {block_size}, and elasticity has 2 or 3 unknowns per node")
    return (block_size,) if block_size else (3, 2)


def _best(readings: Iterable[NodeNumbering | None]) -> NodeNumbering | None:
    """The one that most speaks for; None if nothing does for any."""
    some = [one for one in readings if one is not None and one.quality > 0]
    return max(some, key=lambda one: one.quality, default=None)


def _in_order(matrix: sp.csr_array, sizes: tuple[int, ...]) -> NodeNumbering | None:
    """The best of the numberings that need no search, or what patterns show in its place.

    A clear one whose nodes each couple to common nodes is the only such one, unless nearly all couple to all: rows of
    one node of two such numberings would couple to the same unknowns, and theirs, and so on.
    """
    found = []
    for d, kind in product(sizes, ORDERS):
        one = _regular(matrix, d, kind)
        if one is not None and one.clear and one.common == 1 and 2 * matrix.nnz < matrix.shape[0] ** 2:
            return one
        found.append(one)
    best = _best(found)
    return best if best is None or not best.clear or best.common == 1 else _with_gaps(matrix, best, sizes)


def _with_gaps(matrix: sp.csr_array, regular: NodeNumbering, sizes: tuple[int, ...]) -> NodeNumbering:
    """The numbering with gaps that patterns show in place of one without, where that one cannot be right.

    Boundary nodes often come first, and rollers leave one unknown to each of many: taken in pairs, they fit in among
    nodes that have all of theirs. Sums tell their directions, or they couple to no node in common. Where neither shows,
    rows that couple to different nodes can be one node's all the same, as entries that vanished need not be stored.
    """
    impossible = int(made_up(matrix, regular.node_of_row, regular.direction_of_row, regular.block_size).sum())
    for one in searched(matrix, sizes, as_stored=True):
        unlike = (one.direction_of_row != regular.direction_of_row) & ~regular.identity_row  # which has any
        contradicts = (unlike if one.unnamed is None else unlike & ~one.unnamed).any()  # by sums that prove
        if one.common == 1 and not one.odd and (impossible or contradicts):
            return one
    return replace(regular, odd=impossible)


def _regular(matrix: sp.csr_array, d: int, kind: str, *, checked: bool = True) -> NodeNumbering | None:
    """One of the two numberings that need no search, if order and pattern allow it."""
    if matrix.shape[0] % d:
        return None
    one = measured(matrix, Reading(*regular(matrix.shape[0], d, kind)), d, kind, searched=False)
    return None if checked and one.common < MOST else one


def given_numbering(matrix: sp.csr_array, node_of_row: NDArray, direction_of_row: NDArray) -> NodeNumbering:
    """A numbering that the caller knows: node and direction of each row, (N,).

    InputError if two rows have the same node and direction, or the arrays do not fit the matrix.
    """
    node, direction = np.asarray(node_of_row, dtype=np.int64), np.asarray(direction_of_row, dtype=np.int64)
    order = matrix.shape[0]
    if node.shape != (order,) or direction.shape != (order,):
        raise InputError(f"node and direction are needed for each of the {order} rows")
    d = int(direction.max()) + 1
    if d not in (2, 3) or direction.min() < 0:
        raise InputError("directions are numbered from 0: solids have 2 or 3, beams 4, frames and shells 3 or 6")
    node = by_first_row(node)
    if len(np.unique(node * d + direction)) < order:
        raise InputError("two rows have the same node and direction")
    return measured(matrix, Reading(node, direction), d, "given")
