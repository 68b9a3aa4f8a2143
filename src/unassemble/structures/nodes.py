"""The matrix of a structure node by node, and which of its equations are whole."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CANCELLED, LAST_DIGITS, PENALTY
from .layouts import Layout


@dataclass(frozen=True, eq=False)
class Nodes:
    """Unknowns of a matrix by node and direction."""

    layout: Layout
    matrix: sp.csr_array  # row ``i b + k`` is direction k of node i; empty where there is no such unknown
    row_of: NDArray[np.int64]  # (n, b) of the given matrix; -1 where there is none, or only that of an identity

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.row_of)

    @property
    def present(self) -> NDArray[np.bool_]:
        """(n, b) unknowns that the matrix has."""
        return self.row_of >= 0

    @cached_property
    def graph(self) -> sp.csr_array:
        """(n, n) pattern of coupled nodes, with the diagonal."""
        return self.pattern(self.layout.block_size)

    def pattern(self, directions: int) -> sp.csr_array:
        """(n, n) pattern of nodes coupled in the first of their directions, with the diagonal."""
        coo, b, own = self.matrix.tocoo(), self.layout.block_size, np.arange(self.n)
        some = (coo.row % b < directions) & (coo.col % b < directions)
        place = np.concatenate([coo.row[some] // b, own]), np.concatenate([coo.col[some] // b, own])
        pattern = sp.csr_array((np.ones(len(place[0]), np.int32), place), shape=(self.n, self.n))
        pattern.data[:] = 1
        return pattern

    def direction(self, k: int) -> sp.csr_array:
        """(n b, n) the columns of one direction."""
        return sp.csr_array(self.matrix[:, k :: self.layout.block_size])

    def whole(self) -> NDArray[np.bool_]:
        """(n, b, rotations) rows in which the equation of a rotation holds every coefficient that assembly gave it.

        It needs the displacements across the axis, and the rotation, of all coupled nodes. Displacements that were
        taken away leave a trace, since translations are no longer annihilated; rotations do not, and are looked up.
        A penalty on a rotation spoils the equations of its own row.

        An eliminated neighbour may act on the moments of a node like a spring that resists rotations only, as the
        torsion of a column does; but its forces show. So moments count only of nodes no force of which depends on
        translations, and forces only if they do not depend on the translation along themselves.
        """
        layout, b = self.layout, self.layout.block_size
        moves = len(layout.displacements)
        columns = [self.direction(k) for k in range(b)]
        sums = np.column_stack([part.sum(axis=1) for part in columns])
        size = np.column_stack([abs(part).sum(axis=1) for part in columns])
        zero = (np.abs(sums) <= CANCELLED * size).reshape(self.n, b, b)
        lacking = self.graph @ (~self.present).astype(np.int32) > 0
        diagonal = np.abs(self.matrix.diagonal()).reshape(self.n, b)
        penalised = diagonal > PENALTY * (size.reshape(self.n, b, b).sum(axis=2) - diagonal)
        sound: NDArray[np.bool_] = self.present & ~penalised
        still = np.asarray(zero[:, :moves, :moves].all(axis=(1, 2)) & sound[:, :moves].all(axis=1))
        sound[:, :moves] &= zero[:, range(moves), range(moves)]
        sound[:, moves:] &= still[:, None]
        valid = np.zeros((self.n, b, len(layout.turning)), dtype=bool)
        for k, axis in enumerate(layout.turning):
            across = [direction for direction, _, _ in layout.turned(axis)]
            needed = [*across, moves + k] if layout.rotations else across
            valid[:, :, k] = zero[:, :, across].all(axis=2) & sound & ~lacking[:, needed].any(axis=1)[:, None]
        return valid


def nodes_of(matrix: sp.csr_array, layout: Layout, node: NDArray[np.int64], direction: NDArray[np.int64]) -> Nodes:
    """Order a matrix by nodes; entries that are rounding, rows of the identity and of direction -1 are left out."""
    b = layout.block_size
    coo = matrix.tocoo()
    diagonal = np.abs(matrix.diagonal())
    real = np.abs(coo.data) > LAST_DIGITS * np.sqrt(diagonal[coo.row] * diagonal[coo.col])
    coupled = np.zeros(len(node), dtype=bool)
    coupled[coo.row[real & (coo.row != coo.col)]] = True
    coupled &= direction >= 0
    keep = real & coupled[coo.row] & coupled[coo.col]
    place = node * b + direction
    n = int(node.max()) + 1
    ordered = sp.csr_array((coo.data[keep], (place[coo.row[keep]], place[coo.col[keep]])), shape=(n * b, n * b))
    row_of = np.full(n * b, -1)
    row_of[place[coupled]] = np.flatnonzero(coupled)
    return Nodes(layout, ordered, row_of.reshape(n, b))
