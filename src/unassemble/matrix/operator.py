"""A checked symmetric matrix, stored as the weighted graph that it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..tolerances import ROUNDED, SUMMED
from ..topology import Topology, local_numbering, surfaces


@dataclass(frozen=True, eq=False)
class OperatorMatrix:
    """A real symmetric matrix that passed every check at the door."""

    n: int  # order
    # (e, 2) pairs i < j with a stored off-diagonal entry, in lexicographic order. Explicit zeros count: they are
    # structure.
    edges: NDArray[np.int64]
    entries: NDArray[np.float64]  # (e,) A_ij of each pair, the mean of both triangles
    diagonal: NDArray[np.float64]  # (n,) absent entries are zero
    # largest difference between an entry and its transpose, relative to the largest off-diagonal entry of the two rows
    asymmetry: float = 0.0
    warnings: tuple[str, ...] = ()  # what was changed on the way, in sentences
    # (e,) standard deviations of the errors of the entries, where they are known; 0 for those that have vanished
    errors: NDArray[np.float64] | None = None
    # (n,) rows that were replaced by those of the identity while their columns were kept: of an entry between two of
    # them nothing is left
    replaced: NDArray[np.bool_] | None = None

    @property
    def row_size(self) -> NDArray[np.float64]:
        """(n,) largest absolute off-diagonal entry of each row."""
        return row_sizes(self.n, self.edges, np.abs(self.entries))

    @cached_property
    def row_sums(self) -> NDArray[np.float64]:
        """(n,) sums of rows, the diagonal included."""
        sums = self.diagonal.copy()
        for end in self.edges.T:
            sums += np.bincount(end, self.entries, self.n)
        return sums

    @cached_property
    def couplings(self) -> NDArray[np.float64]:
        """(n,) sums of the magnitudes of the off-diagonal entries of each row."""
        return np.asarray(np.bincount(self.edges.ravel(), np.repeat(np.abs(self.entries), 2), self.n))

    @cached_property
    def adds_up(self) -> NDArray[np.bool_]:
        """(n,) rows that add up to zero, as those of a Laplacian do."""
        return np.asarray(np.abs(self.row_sums) <= SUMMED * (np.abs(self.diagonal) + self.couplings))

    @cached_property
    def surfaces(self) -> Topology:
        """The surfaces that the 3-cycles of its graph make, as far as they do; vertices in breadth-first order."""
        return surfaces(self.n, self.edges, local_numbering(self.n, self.edges))

    @property
    def alike(self) -> bool:
        """Whether all entries are equal: then the matrix is the Laplacian of a graph, most likely."""
        return len(self.entries) > 0 and bool(np.ptp(self.entries) <= ROUNDED * np.abs(self.entries).max())

    @property
    def unweighted(self) -> bool:
        """Whether all entries are equal and all rows add up to zero: the numbers tell no cell from a hole."""
        return self.alike and bool(self.adds_up.all())

    @property
    def incomplete_rows(self) -> NDArray[np.bool_]:
        """(n,) rows that do not add up to zero, if any others do; none otherwise.

        A mass matrix that was added leaves none. How many there are is no matter: of small grids most rows are next to
        the boundary.
        """
        complete = self.adds_up
        return np.asarray(~complete & complete.any())

    def without(self, gone: NDArray[np.bool_]) -> OperatorMatrix:
        """The same with some entries, (e,) bool, not stored."""
        errors = None if self.errors is None else self.errors[~gone]
        return replace(self, edges=self.edges[~gone], entries=self.entries[~gone], errors=errors)

    def among(self, rows: NDArray[np.int64]) -> OperatorMatrix:
        """The same with some of its rows, (k,) ascending, and their columns only."""
        number = np.full(self.n, -1)
        number[rows] = np.arange(len(rows))
        edges = number[self.edges]
        gone = np.asarray((edges < 0).any(axis=1))
        return replace(self.without(gone), n=len(rows), edges=edges[~gone], diagonal=self.diagonal[rows], replaced=None)

    def without_joining_zeros(self) -> OperatorMatrix | None:
        """The same without stored zeros between parts that no other entry joins; None where there are none.

        They are no structure: a Laplacian annihilates nothing but constants on a connected mesh, so that its entries
        other than zero connect all of it. Of ``kron(L, I)``, say, they join copies of one mesh.
        """
        zero = self.entries == 0
        graph = sp.coo_array((np.ones(int((~zero).sum())), self.edges[~zero].T), shape=(self.n, self.n))
        part = csgraph.connected_components(graph, directed=False)[1]
        alone = (np.bincount(part) == 1)[part]  # rows of the identity, whose zeros tell what was there
        i, j = self.edges.T
        joining = zero & (part[i] != part[j]) & ~alone[i] & ~alone[j]
        if not joining.any():
            return None
        note = f"stored zeros that join parts with no other entry between them are left out: {joining.sum():,}"
        return replace(self.without(joining), warnings=(*self.warnings, note))

    def csr(self) -> sp.csr_array:
        """Both triangles and the diagonal, all of it stored."""
        i, j = self.edges.astype(np.int32).T
        own = np.arange(self.n, dtype=np.int32)
        entries = np.concatenate([self.entries, self.entries, self.diagonal])
        place = (np.concatenate([i, j, own]), np.concatenate([j, i, own]))
        return sp.coo_array((entries, place), shape=(self.n, self.n)).tocsr()


def row_sizes(n: int, edges: NDArray[np.int64], magnitudes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) largest magnitude on the edges at each vertex, zero where there is none."""
    size = np.zeros(n)
    np.maximum.at(size, edges[:, 0], magnitudes)
    np.maximum.at(size, edges[:, 1], magnitudes)
    return size
