"""Elastic bodies: the matrix re-assembled on the body as written, or rigid motions and identities asked of its points.

Which entries a list of cells has to explain is read off the matrix: a node is surrounded if its rows annihilate the
translations, but for a penalty on the diagonal, and if all that they couple to has a position. All cells around such
a node have to be there, and so every entry of its rows is that of the cells, but for that diagonal.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..tolerances import ALIKE, CERTIFIED, PENALTY
from .comparison import relative
from .semidefinite import remainder_of, semidefinite
from .solids import Rule, rules_of, stiffness
from .surrounded import penalised, row_sizes, surrounded, without_springs


@dataclass(frozen=True, eq=False)
class BodyCertificate:
    """How well a body explains the rows of a matrix, (N, N)."""

    # largest difference between an entry and the re-assembled one, or what a row leaves of an identity over the
    # distance of the farthest node to which it is coupled, relative to the largest entry between nodes of the row, of
    # two rows the smaller; NaN where nothing was compared
    backward_error: float
    pairs: NDArray[np.int64]  # (k, 2) rows and columns that were compared; for identities the row and itself
    misfits: NDArray[np.float64]  # (k,) of each, relative in this way
    compared: NDArray[np.bool_]  # (N,) rows all of whose entries were
    unexplained: NDArray[np.int64]  # (u,) of these, rows that are not given back
    # what cells leave of the entries between nodes with positions, each over the sizes of its rows; None for identities
    remainder: sp.csr_array | None = None

    def worst(
        self, count: int = 10, allowed: float | NDArray[np.float64] = CERTIFIED
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, each once, worst first, and their misfits: those above what is `allowed`.

        That is a number, or one for each row, (N,). Of identities there are none, since each belongs to a whole row.
        """
        row, column = self.pairs.T
        above = (self.misfits > self.bounds(allowed)) & (row <= column) & (self.remainder is not None)
        order = _largest(self.misfits, np.flatnonzero(above))[:count]
        return self.pairs[order], self.misfits[order]

    def bounds(self, allowed: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) of each comparison the larger of what is `allowed` in its two rows."""
        by_row = np.broadcast_to(np.asarray(allowed, dtype=float), self.compared.shape)
        return np.asarray(by_row[self.pairs].max(axis=1))

    def silent(self, allowed: float | NDArray[np.float64]) -> NDArray[np.int64]:
        """Rows that were not compared and of which cells leave more than is `allowed`, as next to supports.

        Those of which they leave most come first.
        """
        if self.remainder is None:
            return np.empty(0, np.int64)
        rest = np.asarray(abs(self.remainder).max(axis=1).todense()).ravel()
        return _largest(rest, np.flatnonzero((rest > allowed) & ~self.compared))

    def could_be_elements(self, allowed: float | NDArray[np.float64]) -> bool:
        """Whether what cells leave may be the stiffness of other elements, of which supports took nodes away.

        The rows and columns that are left of an element's stiffness matrix are positive semidefinite, as is the matrix
        of a spring, and so is any sum of them. What a wrong entry leaves mostly is not. `allowed` is how far below zero
        an eigenvalue may be, relative to the rows: a number, or one for each row, (N,).
        """
        return self.remainder is None or semidefinite(self.remainder, allowed)

    def of_no_element(self, allowed: float | NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Entries (k, 2) that cells leave and no other elements have, the largest first, and their sizes; or none.

        In a positive semidefinite matrix no entry is larger than the root of the product of the two diagonal ones, and
        these are not negative. Where all entries are so, and the matrix is indefinite yet, the largest are named.
        """
        if self.remainder is None or self.could_be_elements(allowed):
            return np.empty((0, 2), np.int64), np.empty(0)
        entry = self.remainder.tocoo()
        own = np.maximum(self.remainder.diagonal() + allowed, 0.0)
        apart = entry.row < entry.col
        wrong = apart & (np.abs(entry.data) > np.sqrt(own[entry.row] * own[entry.col]))
        wrong |= (entry.row == entry.col) & (own[entry.row] == 0)
        order = _largest(np.abs(entry.data), np.flatnonzero(wrong if wrong.any() else apart))
        return np.column_stack([entry.row, entry.col]).astype(np.int64)[order], np.abs(entry.data[order])


def certify_body(
    matrix: sp.csr_array,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
    blocks: Mapping[str, NDArray[np.int64]],
    lame: NDArray[np.float64],
) -> BodyCertificate:
    """Re-assemble isotropic elasticity on cells and compare all entries of rows around which all cells are there.

    `node_of_row` and `direction_of_row` (N,) with -1 for rows whose direction is not known; `points` (n, d), NaN for
    nodes without a position; `blocks` cells (m, k) by meshio's names and in its order; `lame` lambda and mu (m, 2) of
    all of them one after the other. Of quadrature rules the one that fits best counts: a mesh does not tell it.
    """
    n, d = points.shape
    known = np.asarray(np.isfinite(points).all(axis=1))
    row_of = np.full(n * d, -1)
    named = (direction_of_row >= 0) & (row_sizes(matrix, node_of_row) > 0)  # rows of the identity are none
    row_of[node_of_row[named] * d + direction_of_row[named]] = np.flatnonzero(named)
    compared = surrounded(matrix, node_of_row, direction_of_row, known, d)
    matrix = without_springs(matrix, node_of_row, direction_of_row, compared)
    size = row_sizes(matrix, node_of_row)
    penalty = penalised(matrix, node_of_row)
    given = matrix.tocoo()
    best: BodyCertificate | None = None
    names = list(blocks)
    rich = next((name for name in names if name not in ("triangle", "tetra")), names[0] if names else "")
    usual = {name: next(rules_of(name)) for name in names}
    for rule in rules_of(rich) if names else ():
        assembled = _assembled(row_of, points, blocks, lame, usual | {rich: rule}, len(node_of_row)).tocoo()
        rows = compared & ~_hidden(given, assembled, compared, node_of_row, size)
        found = _compared(given, assembled, rows, penalty, size)
        if best is None or not best.backward_error <= found.backward_error:
            best = replace(found, remainder=remainder_of(given, assembled, size, known[node_of_row] & named))
        if best.backward_error <= CERTIFIED:
            break
    return best if best is not None else _nothing(len(node_of_row))


def certify_positions(
    matrix: sp.csr_array,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
) -> BodyCertificate:
    """Ask rows that annihilate translations for what isotropic elasticity does to linear fields, of any element.

    The force of a row of direction c, where each node moves along b by its coordinate x_a, is

        F_cba = delta_ab p_c + delta_ac q_b + delta_cb q_a

    with two vectors p and q of each node, the integrals of lambda and of mu times the gradient of its shape function.
    Each component is read off one force, p_b off F_baa and q_b off F_aba with another axis a, and all of F is held
    against them. That rigid rotations cause no forces is among it: F_cba = F_cab. Arguments as those of
    :func:`certify_body`.
    """
    n, d = points.shape
    order = len(node_of_row)
    known = np.asarray(np.isfinite(points).all(axis=1))
    compared = surrounded(matrix, node_of_row, direction_of_row, known, d)
    matrix = without_springs(matrix, node_of_row, direction_of_row, compared)
    rows = np.flatnonzero(compared & ~penalised(matrix, node_of_row))
    nodes = np.unique(node_of_row[rows])
    nodes = nodes[np.bincount(node_of_row[rows], minlength=n)[nodes] == d]
    rows = rows[np.isin(node_of_row[rows], nodes)]
    if not len(rows):
        return _nothing(order)
    some = sp.csr_array(matrix[rows]).tocoo()
    own = node_of_row[rows]
    away = points[node_of_row[some.col]] - points[own[some.row]]  # coordinates seen from the node of the row
    force = np.zeros((len(rows), d, d))  # by row, the axis along which nodes move, and the coordinate by which
    for a in range(d):
        np.add.at(force[:, :, a], (some.row, direction_of_row[some.col]), some.data * away[:, a])
    far = np.zeros(len(rows))
    np.maximum.at(far, some.row, np.linalg.norm(away, axis=1))
    size = row_sizes(matrix, node_of_row)[rows] * far
    full = np.zeros((n, d, d, d))
    unit = np.ones((n, d))
    full[own, direction_of_row[rows]] = force
    unit[own, direction_of_row[rows]] = size
    full, unit = full[nodes], unit[nodes]
    p = np.stack([full[:, b, (b + 1) % d, (b + 1) % d] for b in range(d)], axis=1)
    q = np.stack([full[:, (b + 1) % d, b, (b + 1) % d] for b in range(d)], axis=1)
    one = np.eye(d)
    expected = np.einsum("ab,nc->ncba", one, p) + np.einsum("ac,nb->ncba", one, q) + np.einsum("cb,na->ncba", one, q)
    smallest = np.minimum(unit[:, :, None], unit[:, None, :])  # p and q come from other rows of the node
    misfit = relative(full - expected, smallest.min(axis=2)[:, :, None, None]).max(axis=(2, 3))
    by_row = np.zeros((n, d))
    by_row[nodes] = misfit
    misfits = by_row[own, direction_of_row[rows]]
    asked = np.zeros(order, dtype=bool)
    asked[rows] = True
    return BodyCertificate(
        float(misfits.max(initial=0.0)), np.column_stack([rows, rows]), misfits, asked, rows[misfits > CERTIFIED]
    )


def _largest(value: NDArray[np.float64], some: NDArray[np.int64]) -> NDArray[np.int64]:
    """The places in `some` in the order of their values, the largest first."""
    return some[np.argsort(-value[some], kind="stable")]


def _nothing(order: int) -> BodyCertificate:
    """The certificate of what nothing was compared with."""
    return BodyCertificate(
        float("nan"), np.empty((0, 2), np.int64), np.empty(0), np.zeros(order, dtype=bool), np.empty(0, np.int64)
    )


def _hidden(
    given: sp.coo_array,
    assembled: sp.coo_array,
    compared: NDArray[np.bool_],
    node_of_row: NDArray,
    size: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """(N,) rows of nodes with penalties among which elements may be missing from the list, as no other rows show them.

    Cells leave entries between these nodes then, and any two of an element's nodes have a third in common. What is left
    of one wrong entry joins two nodes only.
    """
    penalty = np.abs(given.tocsr().diagonal()) > PENALTY * size
    n = int(node_of_row.max(initial=-1)) + 1
    held = np.bincount(node_of_row, compared & penalty, n) > 0
    rest = (given.tocsr() - assembled.tocsr()).tocoo()
    i, j = node_of_row[rest.row], node_of_row[rest.col]
    left = held[i] & held[j] & (i != j) & (np.abs(rest.data) > ALIKE * np.minimum(size[rest.row], size[rest.col]))
    near = sp.csr_array((np.ones(left.sum()), (i[left], j[left])), shape=(n, n))
    third = sp.csr_array((near @ near).multiply(near))
    return np.asarray(third.sum(axis=1)).ravel()[node_of_row] > 0


def _assembled(
    row_of: NDArray[np.int64],
    points: NDArray[np.float64],
    blocks: Mapping[str, NDArray[np.int64]],
    lame: NDArray[np.float64],
    rules: Mapping[str, Rule],
    order: int,
) -> sp.csr_array:
    """The matrix (N, N) of cells, by the rows of unknowns (n d,); unknowns that have none are left out."""
    d, first = points.shape[1], 0
    total = sp.csr_array((order, order))
    for name, cells in blocks.items():
        step = max(AT_ONCE // (cells.shape[1] * d * (cells.shape[1] * d + 6 * len(rules[name][1]))), 1)
        for start in range(0, len(cells), step):
            some = cells[start : start + step]
            unknown = row_of[some[:, :, None] * d + np.arange(d)].reshape(len(some), -1)
            own = lame[first + start : first + start + len(some)]
            value = stiffness(name, points[some], own, rules[name])
            rows, columns = np.broadcast_arrays(unknown[:, :, None], unknown[:, None, :])
            there = (rows >= 0) & (columns >= 0)
            part = sp.coo_array((value[there], (rows[there], columns[there])), shape=(order, order))
            total = sp.csr_array(total + part.tocsr())
        first += len(cells)
    return total


def _compared(
    given: sp.coo_array,
    assembled: sp.coo_array,
    compared: NDArray[np.bool_],
    penalty: NDArray[np.bool_],
    size: NDArray[np.float64],
) -> BodyCertificate:
    """All entries of either matrix in rows that are `compared`, (N,), but for diagonals with a `penalty`."""
    order = len(size)
    key = np.concatenate([part.row.astype(np.int64) * order + part.col for part in (given, assembled)])
    value = np.concatenate([-given.data, assembled.data])
    pairs, place = np.unique(key, return_inverse=True)
    difference = np.bincount(place, value, len(pairs))
    row, column = np.divmod(pairs, order)
    use = (compared[row] | compared[column]) & ~((row == column) & penalty[row])
    row, column, difference = row[use], column[use], difference[use]
    misfits = relative(difference, np.minimum(size[row], size[column]))
    bad = np.unique(row[misfits > CERTIFIED])
    error = float(misfits.max(initial=0.0)) if len(misfits) else float("nan")
    return BodyCertificate(error, np.column_stack([row, column]), misfits, compared, bad[compared[bad]])
