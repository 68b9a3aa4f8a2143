"""Which rows of a matrix belong to one node and to which direction each of them, and how much speaks for it."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import HARDLY_ANY, MOST, NEARLY_ALL
from .constants import annihilated_share, row_sizes, unaccounted
from .grouping import coupled_in_common
from .orders import ORDERS, Reading


@dataclass(frozen=True, eq=False)
class Rows:
    """Nodes and directions of the N rows of a vector-valued matrix."""

    node_of_row: NDArray[np.int64]  # numbered by their first row
    direction_of_row: NDArray[np.int64]  # -1 where it is not known
    kind: str  # "interleaved", "by component", "pattern" or "given"
    share: float  # of the pairs (row, direction) whose entries add up to zero, among rows that couple

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self.node_of_row.max()) + 1


@dataclass(frozen=True, eq=False)
class NodeNumbering(Rows):
    """Those of a solid, and what speaks for them."""

    block_size: int
    identity_row: NDArray[np.bool_]  # those that couple to nothing: unknowns replaced by the identity
    common: float  # how far the rows of a node couple to the same nodes: 1 if all do
    # nodes that lack a direction without a trace; in an order without gaps, those whose rows cannot be one node's
    odd: int = 0
    open_row: NDArray[np.bool_] | None = None  # by component: rows of which neither pattern nor order tells the node
    unnamed: NDArray[np.bool_] | None = None  # rows whose direction nothing proves

    @property
    def incomplete(self) -> bool:
        """Whether some node lacks rows."""
        return len(self.node_of_row) != self.block_size * self.n_nodes

    @property
    def inferred(self) -> bool:
        """Whether it was inferred which rows belong to one node: some are missing, or couple to different unknowns."""
        return self.kind != "given" and (self.incomplete or self.common < 1)

    @property
    def likely(self) -> bool:
        """Whether rows of different patterns were joined where some are missing: only elements show that this is so."""
        return self.kind != "given" and self.incomplete and self.common < 1

    @property
    def quality(self) -> float:
        """Rows add up to zero, those of a node couple to the same nodes, and most nodes have all their directions."""
        if int(np.bincount(self.node_of_row).max()) < self.block_size:  # no node has a row for every direction
            return 0.0
        filled = len(self.node_of_row) / (self.n_nodes * self.block_size)
        return self.share * self.common * filled * (1 - self.odd / self.n_nodes)

    @property
    def clear(self) -> bool:
        """Whether the unknowns stand in one of the usual orders, with no gaps: nothing else need be tried."""
        alike = self.kind != "by component" or self.common >= NEARLY_ALL
        whole = self.incomplete or not self.odd
        return self.kind in ORDERS and self.share >= MOST and alike and whole

    @property
    def sound(self) -> bool:
        """Whether its nodes look like nodes, however few of their rows annihilate constants."""
        return self.share > HARDLY_ANY and self.quality > MOST * self.share


def measured(matrix: sp.csr_array, reading: Reading, d: int, kind: str, *, searched: bool = True) -> NodeNumbering:
    """A numbering and what speaks for it; of one that was `searched` for more is asked."""
    node, direction = reading.node, reading.direction
    share = annihilated_share(matrix, direction, d, searched=searched)
    common = coupled_in_common(matrix, node)
    odd = int(unaccounted(matrix, node, direction, d).any(axis=1).sum()) if searched else 0
    identity = row_sizes(matrix) == 0
    return NodeNumbering(node, direction, kind, share, d, identity, common, odd, reading.open_row, reading.unnamed)
