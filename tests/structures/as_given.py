"""Matrices of structures as people have them: few digits, supports of all kinds, condensed rotations."""

import numpy as np
import scipy.sparse as sp
from built import rows_per_node


def lowest(given):
    """Rows of displacements of the nodes at one end, and all rows of these."""
    axis = given.points.shape[1] - 1
    held = np.flatnonzero(given.points[:, axis] < given.points[:, axis].min() + 0.9)
    rows = given.block * held[:, None] + np.arange(given.block)
    moves = {6: 3, 3: 1 if given.unknowns[0] == 2 else 2}[given.block]
    return rows[:, :moves].ravel(), rows.ravel()


def written(matrix, digits):
    """Entries with so many digits."""
    matrix = sp.csr_array(matrix)
    data = np.array([float(f"{x:.{digits - 1}e}") for x in matrix.data])
    return sp.csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def supported(given, how):
    """The matrix with supports, and where the nodes of its rows are."""
    moves, every = lowest(given)
    true, order = rows_per_node(given), np.arange(given.matrix.shape[0])
    if how == "removed":
        kept = np.setdiff1d(order, moves)
        return given.matrix[kept][:, kept], true[kept]
    if how == "identity":
        free = sp.diags_array((~np.isin(order, every)).astype(float))
        return free @ given.matrix @ free + sp.diags_array(np.isin(order, every).astype(float)), true
    if how == "penalty":
        stiff = np.where(np.isin(order, every), 1e7 * given.matrix.diagonal().max(), 0.0)
        return given.matrix + sp.diags_array(stiff), true
    turning = np.setdiff1d(every, moves)
    kept = np.setdiff1d(order, every)
    matrix, left = given.condensed(turning)
    inner = np.isin(left, kept)
    return (matrix[inner][:, inner], true[left][inner]) if how == "condensed" else (given.matrix, true)
