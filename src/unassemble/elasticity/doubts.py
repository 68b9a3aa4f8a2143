"""Nodes that may lack a direction, or whose missing row may stand elsewhere: neither pattern nor order can tell."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .elements.cells import Cells
from .nodal import NodalMatrix, annihilating, determined, without_trace
from .nullspace.solution import Solution
from .rows.numbering import Numbering
from .rows.orders import ORDERS


def with_doubts(nodal: NodalMatrix, numbering: Numbering) -> NodalMatrix:
    """Mark nodes whose rows may be those of two halves of one: near, with no direction in common.

    Where all entries are stored the halves of a node couple to the same nodes; and where unknowns stand in order, it
    tells which of them are in doubt. Where order alone joined rows that couple to different nodes, so are theirs.
    """
    inferred = numbering.common < 1 and numbering.kind != "given"
    mixed = _mixed(nodal) if inferred else np.zeros(nodal.n, dtype=bool)
    nodal = replace(nodal, sure=_sure(nodal, numbering))
    if numbering.kind in ORDERS and mixed.any():
        nodal = replace(nodal, doubtful=mixed)
    if numbering.open_row is not None:
        nodal = _with_open_rows(nodal, numbering, numbering.open_row)
        if not numbering.likely:
            return nodal
    ordered = numbering.kind != "pattern" and numbering.common == 1 and not numbering.odd
    if numbering.kind == "given" or not numbering.incomplete or ordered:
        return nodal
    return _with_halves(nodal, numbering, mixed)


def _with_open_rows(nodal: NodalMatrix, numbering: Numbering, unsure: NDArray[np.bool_]) -> NodalMatrix:
    """Mark nodes with rows that were left open, (N,) `unsure`, where a direction is missing."""
    if nodal.blurred is not None and numbering.unnamed is not None:  # rows without a name were left out
        unsure = unsure | numbering.unnamed
    doubtful = np.zeros(nodal.n, dtype=bool)
    doubtful[numbering.node_of_row[unsure]] = True
    doubtful &= (nodal.row_of < 0).any(axis=1)
    if not doubtful.any():
        return nodal
    return replace(nodal, doubtful=doubtful | _doubtful(nodal))


def _with_halves(nodal: NodalMatrix, numbering: Numbering, mixed: NDArray[np.bool_]) -> NodalMatrix:
    """Mark nodes that may be two halves of one, and those that may be halves of two, `mixed`, (n,)."""
    present = nodal.row_of >= 0
    some = np.asarray(present.any(axis=1) & ~present.all(axis=1))
    i, j = _near(nodal, some) if numbering.common < 1 else (nodal.node, nodal.indices)
    halves = some[i] & some[j] & (i != j) & ~(present[i] & present[j]).any(axis=1)
    code = _neighbourhoods(nodal)
    alike = halves & (code[i] == code[j])
    apart = np.asarray(without_trace(nodal).any(axis=1))
    apart[i[alike]] = False
    doubtful = np.zeros(nodal.n, dtype=bool)
    doubtful[i[halves if apart.any() or numbering.common < 1 else alike]] = True
    if numbering.unnamed is not None:  # one of its rows may be another node's, taken for it
        named = np.bincount(numbering.node_of_row, numbering.unnamed, nodal.n) == 0
        doubtful |= mixed & ~named
    around = np.asarray(nodal.graph @ doubtful.astype(float) > 0)  # even the directions of such rows were searched for
    blurred = around if nodal.blurred is None else nodal.blurred | around
    return replace(nodal, doubtful=doubtful | _doubtful(nodal), blurred=blurred)


def _doubtful(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n,) nodes that are doubtful so far."""
    return np.zeros(nodal.n, dtype=bool) if nodal.doubtful is None else nodal.doubtful


def _sure(nodal: NodalMatrix, numbering: Numbering) -> NDArray[np.bool_] | None:
    """(n,) nodes that are beyond doubt without an equation that shows it; None if all are.

    Node by node these are single rows before and after which others stand that couple to other unknowns. Two rows that
    couple to the same, in the order of directions, may be two nodes that lack all others. Component by component they
    are single rows that the order keeps apart from all others that couple to the same, so that they were not left open.
    """
    if numbering.kind == "given" or (numbering.kind in ORDERS and not numbering.incomplete):
        return None
    sure = np.zeros(nodal.n, dtype=bool)
    if numbering.kind not in ORDERS or numbering.common < 1 or numbering.odd:
        return sure
    count = (nodal.row_of >= 0).sum(axis=1)
    if numbering.kind == "interleaved":
        live = np.flatnonzero(count)
        code = _neighbourhoods(nodal)[live]
        same = np.concatenate([[False], code[1:] == code[:-1], [False]])
        sure[live] = (count[live] == 1) & ~same[1:] & ~same[:-1]
    elif numbering.open_row is not None:
        sure = (count == 1) & (np.bincount(numbering.node_of_row, numbering.open_row, nodal.n) == 0)
    return sure


def _near(nodal: NodalMatrix, some: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of some nodes, both ways, that are coupled or have half of the neighbours of one of them in common.

    On straight sides of regular meshes the entry between two directions of a node vanishes, and need not be stored.
    """
    rows = np.flatnonzero(some)
    if not len(rows):
        return rows, rows
    around = nodal.graph[rows]
    common = sp.coo_array(around @ around.T + nodal.n * around[:, rows])  # more than any node has neighbours
    degree = np.diff(around.indptr) - 1
    near = 2 * common.data >= np.minimum(degree[common.row], degree[common.col])
    return rows[common.row[near]], rows[common.col[near]]


def unconfirmed(
    nodal: NodalMatrix, numbering: Numbering, points: NDArray[np.float64], shown: NDArray[np.bool_] | None
) -> NDArray[np.bool_]:
    """(n,) nodes with coordinates next to doubtful ones that cells do not confirm.

    Rows that were joined wrongly can be placed all the same; that entries re-assemble which are not zero, some of each
    row, shows that these were not. They are `shown`, (n, d). Where neither order nor patterns say which rows belong
    together, all nodes are as good as doubtful.
    """
    confirmed: NDArray[np.bool_] = np.zeros(nodal.n, dtype=bool)
    if shown is not None:
        confirmed = np.asarray((shown | (nodal.row_of < 0)).all(axis=1))
    if numbering.likely:
        return determined(points) & ~confirmed
    if nodal.doubtful is None:
        return np.zeros(nodal.n, dtype=bool)
    if numbering.open_row is not None:  # nothing was joined that order does not join
        return nodal.doubtful & ~confirmed
    doubtful = nodal.doubtful & ~(confirmed & (nodal.row_of >= 0).all(axis=1))  # all rows of one node are its own
    doubtful |= without_trace(nodal).any(axis=1)
    return np.asarray(determined(points) & (nodal.graph @ doubtful.astype(float) > 0) & ~confirmed)


def unborne(nodal: NodalMatrix, solution: Solution, found: Cells) -> NDArray[np.bool_]:
    """(n,) nodes whose coordinates hang on an assumption that neither other equations nor cells confirm."""
    if solution.hanging is None:
        return np.zeros(nodal.n, dtype=bool)
    if not found.certified or found.shown is None:
        return solution.hanging
    return np.asarray(solution.hanging & ~(found.shown | (nodal.row_of < 0)).all(axis=1))


def guessed_directions(numbering: Numbering, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) rows whose direction is the likeliest and no more: those of nodes without coordinates, `loose`, (n,).

    Where unknowns stand node by node and rows are missing, or at random, sums over directions tell which. On regular
    meshes wrong ones vanish, too. Rows that fit the coordinates of their node are right; of others nothing shows it.
    Not even that there are as many as directions: where planes of rollers meet, they may be those of several nodes.
    """
    if numbering.unnamed is None:
        return np.zeros(len(numbering.node_of_row), dtype=bool)
    whole = np.bincount(numbering.node_of_row) == numbering.block_size
    if numbering.kind == "pattern":  # no order tells which row of a whole node is which
        whole[:] = False
    return np.asarray(loose[numbering.node_of_row] & (numbering.unnamed | ~whole[numbering.node_of_row]))


def _mixed(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n,) nodes whose rows couple to different nodes, and may be several nodes each of which lacks directions.

    They are not, where rows of the same neighbours lack one without a trace: the others are theirs.
    """
    d, present = nodal.dim, nodal.row_of >= 0
    coupled = nodal.data != 0
    key = np.random.default_rng(0).integers(1, 2**62, nodal.n, dtype=np.uint64)
    shape = (nodal.n, nodal.n)
    code = np.column_stack([
        sp.csr_array((coupled[:, c].any(axis=1).astype(np.uint64), nodal.indices, nodal.indptr), shape=shape) @ key
        for c in range(d)
    ])  # fmt: skip
    alike = (code[:, :, None] == code[:, None, :]) & present[:, :, None] & present[:, None, :]
    missing = (~annihilating(nodal) & present[:, :, None]).astype(float)
    missed = np.zeros((nodal.n, d, d))
    for c, e in product(range(d), repeat=2):
        pairs = sp.csr_array((coupled[:, c, e].astype(float), nodal.indices, nodal.indptr), shape=shape)
        missed[:, c] += pairs @ missing[:, e]
    untold = np.einsum("nce,neb->ncb", alike.astype(float), missed) == 0
    lacking = present[:, :, None] & present[:, None, :] & ~alike
    return np.asarray(lacking.any(axis=(1, 2)) & ~(lacking & untold).any(axis=(1, 2)))


def _neighbourhoods(nodal: NodalMatrix) -> NDArray[np.uint64]:
    """(n,) equal for nodes that couple to the same nodes."""
    key = np.random.default_rng(0).integers(1, 2**62, nodal.n, dtype=np.uint64)
    return np.asarray(nodal.graph.astype(np.uint64) @ key)  # sums wrap around, which does no harm
