"""What is not sure about nodes, which of them elements show to be right all the same, and what is said of it."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..nodes.nodal import NodalMatrix, determined, valid_pairs
from ..nodes.numbering import NodeNumbering
from ..tolerances import ALIKE
from ..words import count_of
from .materials.cells import RecognisedCells
from .nullspace.checked import checked, checked_beside
from .nullspace.placing import Solution


def unconfirmed(
    nodal: NodalMatrix, numbering: NodeNumbering, points: NDArray[np.float64], shown: NDArray[np.bool_] | None
) -> NDArray[np.bool_]:
    """(n,) nodes with coordinates whose rows may be those of several, and that cells do not confirm.

    Rows that were joined wrongly can be placed all the same; that entries re-assemble which are not zero, some of each
    row, shows that these were not. They are `shown`, (n, d). Where neither order nor patterns say which rows belong
    together, all nodes are as good as doubtful.
    """
    confirmed: NDArray[np.bool_] = np.zeros(nodal.n, dtype=bool)
    if shown is not None:
        confirmed = np.asarray((shown | (nodal.row_of < 0)).all(axis=1))
    return (determined(points) if numbering.likely else nodal.doubtful) & ~confirmed


def unborne(nodal: NodalMatrix, solution: Solution, found: RecognisedCells) -> NDArray[np.bool_]:
    """(n,) nodes whose coordinates hang on an assumption that neither other equations nor cells confirm."""
    if solution.hanging is None:
        return np.zeros(nodal.n, dtype=bool)
    if not found.certified or found.shown is None:
        return solution.hanging
    firm = determined(solution.firm_points)
    shown = firm | (found.shown | (nodal.row_of < 0)).all(axis=1)
    return np.asarray(solution.hanging & ~_held_together(found.among(shown), solution.component, firm))


def unchecked(nodal: NodalMatrix, solution: Solution, found: RecognisedCells) -> NDArray[np.bool_]:
    """(n,) nodes with coordinates that are in no cell which re-assembles, and that no other identities check.

    So are nodes in the place of another, unless their own rows are whole: springs draw nodes together, and bodies in
    contact have nodes upon each other that have rows of elements.
    """
    known = determined(solution.points)
    outside = known.copy()
    for cells in found.blocks.values() if found.certified else ():
        outside[cells.ravel()] = False
    if not outside.any():
        return outside
    twice = np.zeros(nodal.n, dtype=bool)
    twice[known] = _coinciding(solution.points[known])
    whole = valid_pairs(nodal).all(axis=(1, 2))
    sure = checked(nodal, solution) if outside[known].all() else checked_beside(nodal, solution, outside)
    return outside & (~sure | twice & ~whole)


def _coinciding(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) points in the place of another, as far as half of the digits tell; mean edges have length one."""
    away, _ = cKDTree(points).query(points, k=2)
    return np.asarray(away[:, 1] <= ALIKE)


def _held_together(found: RecognisedCells, piece: NDArray[np.int64], firm: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes of the most cells of each piece that lie to each other as they do without an assumption.

    Cells re-assemble wherever they lie, and those of the plane in any size. Two nodes that they share fix both; and
    nodes that are `firm`, (n,), are as good as the nodes of one cell.
    """
    pieces = np.arange(piece.max() + 1)
    groups = [*found.blocks.values(), *(np.flatnonzero(firm & (piece == k))[None] for k in pieces)]
    count = np.repeat([group.shape[1] for group in groups], [len(group) for group in groups])
    first = np.concatenate([*(piece[cells[:, 0]] for cells in found.blocks.values()), pieces])
    nodes, start = np.concatenate([group.ravel() for group in groups]), np.concatenate([[0], np.cumsum(count)])
    member = sp.csr_array((np.ones(len(nodes), np.int32), nodes, start), shape=(len(count), len(piece)))
    shared = member @ member.T
    label = sp.csgraph.connected_components(sp.csr_array(shared >= 2), directed=False)[1]
    order = np.lexsort((np.bincount(label, count)[label], first))
    best = label[order[np.append(np.diff(first[order]) > 0, True)]]  # the largest of each piece
    return np.asarray(member[np.isin(label, best)].sum(axis=0) > 0)


def guessed_directions(numbering: NodeNumbering, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
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


def notes(
    nodal: NodalMatrix,
    solution: Solution,
    found: RecognisedCells | None,
    loose: NDArray[np.bool_],
    masks: tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]],
    guessed: int,
) -> Iterator[str]:
    """What there is to say of nodes without coordinates, `loose`, elements, if these were asked for, and assumptions.

    The `masks`, (n,) each, are of nodes that no element confirms, that rest on an assumption, and that nothing checks.
    So many rows of nodes without coordinates have `guessed` directions.
    """
    withheld, hanging, lone = masks
    sprung = loose & (nodal.size == 0) & (nodal.row_of >= 0).any(axis=1)
    other = loose & ~(withheld | hanging | lone | sprung)
    for some, why in (
        (sprung, "on springs, or on nothing: no linear field knows a spring"),
        (withheld, "no element shows that the rows that were inferred to be its own are"),
        (hanging & ~withheld, "determined only if nodes that lack a direction lie in planes across it"),
        (lone, "determined by identities that no others check, nor an element"),
        (other, "no equation that holds for every element is left of rows that lack entries, or belong to other axes"),
    ):
        if some.any():
            yield f"no position for {count_of(int(some.sum()), 'node')}: {why}"
    if found is not None and not found.certified:
        yield "elements, read off the graph, are not certified" if found.blocks else "no elements were recognised"
    if solution.planes:
        yield "nodes that lack a direction were taken to lie in planes across it, which fits, to determine others"
    if solution.straight:
        yield "the identities leave an affine map free, which elements determined"
    if guessed:
        yield f"directions of {count_of(guessed, 'row')} of nodes without coordinates are not proven, and -1"
