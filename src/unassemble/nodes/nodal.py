"""A vector-valued matrix seen node by node, and which of its rows still say something about positions."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CANCELLED, PENALTY
from .numbering import NodeNumbering


@dataclass(frozen=True, eq=False)
class NodalMatrix:
    """Square blocks of order d, one per pair of coupled nodes, in CSR form: columns increase, each node is its own.

    A diagonal entry with a penalty is replaced by what makes its row annihilate constants, which is what assembly put
    there if the row is whole.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    data: NDArray[np.float64]  # (nnz, d, d), ``data[k, c, b]`` is A^{cb}_ij; zero where the matrix lacks unknowns
    row_of: NDArray[np.int64]  # (n, d) of the matrix, -1 where there is none
    size: NDArray[np.float64]  # (n,) mean absolute sum of a node's off-diagonal blocks, the unit of its equations
    penalised: NDArray[np.bool_]  # (n, d) unknowns with a penalty on the diagonal
    # (n,) nodes that lack a direction and have a row that may be another node's: none says that others lack it
    doubtful: NDArray[np.bool_]

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.indptr) - 1

    @property
    def dim(self) -> int:
        """Order of the blocks, which is the dimension of space."""
        return self.data.shape[1]

    @property
    def node(self) -> NDArray[np.int32]:
        """(nnz,) the node to whose rows each block belongs."""
        return np.repeat(np.arange(self.n, dtype=np.int32), np.diff(self.indptr))

    @property
    def graph(self) -> sp.csr_array:
        """(n, n) ones where there are blocks."""
        return sp.csr_array((np.ones(len(self.indices)), self.indices, self.indptr), shape=(self.n, self.n))

    def row_sums(self) -> NDArray:
        """(n, ...) sums over each node's blocks."""
        return np.add.reduceat(self.data, self.indptr[:-1], axis=0)  # no node is empty


def nodal_matrix(matrix: sp.csr_array, numbering: NodeNumbering) -> NodalMatrix:
    """Gather the unknowns of each node into blocks; those of rows of the identity are left out, as if eliminated."""
    n, d = numbering.n_nodes, numbering.block_size
    place = numbering.node_of_row * d + numbering.direction_of_row
    row_of = np.full(n * d, -1, dtype=np.int64)
    live = ~numbering.identity_row
    row_of[place[live]] = np.flatnonzero(live)
    coo = matrix.tocoo()
    keep = live[coo.row] & live[coo.col]
    diagonal = np.arange(n) * d  # so that every node is coupled to itself
    ends = np.concatenate([place[coo.row[keep]], diagonal]), np.concatenate([place[coo.col[keep]], diagonal])
    entries = sp.coo_array((np.concatenate([coo.data[keep], np.zeros(n)]), ends), shape=(n * d, n * d))
    blocks = entries.tocsr().tobsr(blocksize=(d, d))
    blocks.sort_indices()
    indptr = blocks.indptr.astype(np.int32)
    indices, data = blocks.indices[: indptr[-1]].astype(np.int32), blocks.data[: indptr[-1]].copy()
    own = np.repeat(np.arange(n), np.diff(indptr)) == indices
    off = np.abs(data).sum(axis=(1, 2)) / d**2
    off[own] = 0
    size = np.add.reduceat(off, indptr[:-1])
    penalised = (np.abs(np.diagonal(data, axis1=1, axis2=2)[own]) > PENALTY * size[:, None]) & (size > 0)[:, None]
    node, direction = np.nonzero(penalised)
    at = np.flatnonzero(own)[node]
    data[at, direction, direction] = 0  # before the rest is added up: it would be lost beside the penalty
    data[at, direction, direction] = -np.add.reduceat(data, indptr[:-1])[node, direction, direction]
    rows, doubtful = row_of.reshape(n, d), np.zeros(n, dtype=bool)
    if numbering.open_row is not None:
        doubtful[numbering.node_of_row[numbering.open_row]] = True
        doubtful &= (rows < 0).any(axis=1)
    return NodalMatrix(indptr, indices, data, rows, size, penalised, doubtful)


def valid_pairs(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n, d, d) rows of blocks that hold every coefficient that assembly gave them, by components of row and columns.

    Row i of A^{cb} annihilates constants, unless a coupled unknown of component b was taken away or the
    diagonal was changed. The converse fails on regular meshes, where what is missing can add up to zero (two
    eliminated nodes opposite each other). So it is asked of all rows of a node at once: they couple to
    the same unknowns, and a neighbour that is known to lack the direction spoils it. So does what they miss of another
    direction, if no neighbour is known to lack that: a whole node was taken away, whose entries add up to zero in
    meshes that are the same all along an axis. A penalty on the diagonal explains itself and spoils its own row only.
    """
    present: NDArray[np.bool_] = nodal.row_of >= 0
    zero, penalty = annihilating(nodal), nodal.penalised[:, None, :] & np.eye(nodal.dim, dtype=bool)
    valid = np.asarray(zero & ~penalty & present[:, :, None] & present[:, None, :] & (nodal.size > 0)[:, None, None])
    whole: NDArray[np.bool_] = np.asarray((zero | ~present[:, :, None]).all(axis=1))
    lacking = nodal.graph @ eliminated(nodal).astype(float)
    lost = (~whole & (lacking == 0)).any(axis=1, keepdims=True)
    sure: NDArray[np.bool_] = whole & (lacking == 0) & ~lost
    return np.asarray(valid & sure[:, None, :])


def eliminated(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n, d) unknowns that were taken out of nodes of which others are left."""
    present = nodal.row_of >= 0
    return ~present & ~without_trace(nodal) & np.asarray(present.any(axis=1))[:, None]


def surrounded(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes whose neighbours are all there, though some may lack a direction; by :func:`valid_pairs`.

    The rows show it in those directions that none of them lacks; there has to be one.
    """
    present = nodal.row_of >= 0
    lacking = nodal.graph @ eliminated(nodal).astype(float) > 0
    whole: NDArray[np.bool_] = np.asarray((valid | ~present[:, :, None]).all(axis=1))
    return np.asarray((whole | lacking | ~present).all(axis=1) & (whole & present & ~lacking).any(axis=1))


def without_trace(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n, d) unknowns that are not there, although no row coupled to the node misses anything.

    What was eliminated leaves a trace in the rows next to it. Where there is none, the unknown stands
    somewhere else: the node's rows were not recognised as those of one node.
    """
    present = nodal.row_of >= 0
    missing = (~annihilating(nodal) & present[:, :, None]).any(axis=1)
    some = np.asarray(present.any(axis=1))
    return ~present & (nodal.graph @ missing.astype(float) == 0) & some[:, None]


def annihilating(nodal: NodalMatrix) -> NDArray[np.bool_]:
    """(n, d, d) rows of blocks that annihilate constants."""
    size = np.where(nodal.size > 0, nodal.size, np.inf)[:, None, None]
    return np.asarray(np.abs(nodal.row_sums()) <= CANCELLED * size)


def uncoupled(nodal: NodalMatrix) -> bool:
    """Whether no component is coupled to another: as of a vector Laplacian."""
    off = np.abs(nodal.data[:, ~np.eye(nodal.dim, dtype=bool)])
    return bool(off.max(initial=0) <= 1e-12 * np.median(nodal.size[nodal.size > 0])) if nodal.size.any() else True


def determined(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) nodes that have coordinates."""
    return np.asarray(np.isfinite(points).all(axis=1))
