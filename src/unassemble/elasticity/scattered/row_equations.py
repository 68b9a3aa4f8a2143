"""Which identities hold for rows whose directions are known, whichever of them are one node's."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodal import NodalMatrix
from ..nullspace.planes import with_planes
from ..rows.constants import least_sums, row_sizes, with_penalty
from .patterns import by_direction, with_patterns


class Sums(NamedTuple):
    """What sums over directions say of rows, whichever of them are one node's.

    Attributes
    ----------
    whole : (N, d) bool
        Rows that hold every coefficient in the columns of a direction.
    gone : (N, d) bool
        Directions that were taken out of all nodes of the row's pattern.
    surrounded : (N,) bool
        Rows whose neighbours are all there, in some direction at least.
    """

    whole: NDArray[np.bool_]
    gone: NDArray[np.bool_]
    surrounded: NDArray[np.bool_]


def sums_of(
    matrix: sp.csr_array, live: NDArray[np.bool_], group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> Sums:
    """Rows are whole where all of their pattern annihilate constants, and nothing near is known to lack the direction.

    What was taken out leaves a trace: some row next to it does not add up to zero. Rows that touch nothing lacking some
    direction show that no node near them is missing altogether.
    """
    label = np.eye(d)[direction] * live[:, None]
    size = row_sizes(matrix)
    least = least_sums(size)
    excused = (label > 0) & with_penalty(matrix, size)[:, None]
    missing = (np.abs(matrix @ label) > least[:, None]) & ~excused
    failing = np.zeros((int(group.max()) + 1, d))
    np.add.at(failing, group, missing)
    count = by_direction(group, direction, d)
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    lacking = pattern @ ((count < count.max(axis=1, keepdims=True))[group] & live[:, None]).astype(float) > 0
    adding: NDArray[np.bool_] = failing[group] == 0
    gone = (count[group] == 0) & (pattern @ missing.astype(float) > 0)
    surrounded = (adding | lacking).all(axis=1) & (adding & ~lacking).any(axis=1)
    return Sums(adding & ~excused & ~lacking & live[:, None], gone & live[:, None], surrounded & live)


def equations(
    nodal: NodalMatrix,
    sums: Sums,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
) -> tuple[NodalMatrix, NDArray[np.bool_]]:
    """Those of rows, of patterns, and of planes that rollers hold, whichever rows are one node's."""
    valid: NDArray[np.bool_] = sums.whole[nodal.row_of] & (nodal.row_of >= 0)[:, :, None]
    extended, full = with_patterns(nodal, valid, group, node, direction, sums.whole)
    row = np.zeros(nodal.n, dtype=np.int64)
    row[node] = np.arange(len(node))  # any row of the node: all have the same pattern
    completed = with_planes(nodal, valid, sums.gone[row], sums.surrounded[row])
    if completed is not None:
        extended = replace(extended, data=np.concatenate([completed[0].data, extended.data[len(nodal.data) :]]))
        full[: nodal.n] |= completed[1]
    return extended, full
