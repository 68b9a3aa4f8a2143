"""Single vertices that were taken out of a surface, put back: what the rows around the hole lack is theirs."""

from dataclasses import replace

import numpy as np

from ..matrix import OperatorMatrix
from ..topology.cycles import three_cycles
from ..topology.keys import pair_keys
from ..topology.numbering import connected


def with_vertices_back(matrix: OperatorMatrix) -> OperatorMatrix | None:
    """The matrix with a last row for each hole that one vertex may have left; None where there is no such hole.

    Rows of a Laplacian add up to zero. If all of a boundary loop do not, and others do, they lack entries; and where a
    single vertex is gone these are its own. A loop with more rows than any other row has neighbours is not closed so.
    """
    n, edges, lacking = matrix.n, matrix.edges, matrix.incomplete_rows
    _, opposite = three_cycles(n, edges)
    rim = edges[lacking[edges].all(axis=1) & (np.bincount(opposite.ravel(), minlength=len(edges)) == 1)]
    loop = connected(n, *rim.T)[1]
    twice = np.bincount(rim.ravel(), minlength=n) == 2
    degree = np.bincount(edges.ravel(), minlength=n)
    closed = (np.bincount(loop, ~twice) == 0) & (np.bincount(loop) <= degree[~lacking].max(initial=0))
    rows = np.flatnonzero(closed[loop])
    if not len(rows):
        return None
    _, gone = np.unique(loop[rows], return_inverse=True)
    sums = matrix.row_sums[rows]
    more = np.column_stack([rows, n + gone])
    total = n + int(gone.max()) + 1
    order = np.argsort(pair_keys(total, *np.vstack([edges, more]).T))
    return replace(
        matrix,
        n=total,
        edges=np.vstack([edges, more])[order],
        entries=np.append(matrix.entries, -sums)[order],
        diagonal=np.append(matrix.diagonal, np.bincount(gone, sums)),
    )
