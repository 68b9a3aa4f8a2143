"""What a matrix that is neither a mesh nor nodes of several unknowns seems to be: definite or not, tied, uneven."""

import numpy as np

from ..matrix import OperatorMatrix
from ..operators import about_translations
from ..tolerances import LITTLE, SMALL
from ..words import GIVE_NUMBERING, count_of, words_of


def saddle_point(matrix: OperatorMatrix) -> str:
    """That coupled rows have diagonals of exactly zero, and others not; empty where none do."""
    coupled = np.zeros(matrix.n, dtype=bool)
    coupled[matrix.edges[matrix.entries != 0]] = True
    empty = coupled & (matrix.diagonal == 0)
    if not (empty.any() and matrix.diagonal.any()):  # or the diagonal was left out
        return ""
    rows = count_of(int(empty.sum()), "diagonal entry of coupled rows is", "diagonal entries of coupled rows are")
    return (
        f"{rows} zero (row {int(empty.argmax())}): a saddle point, as of pressures beside velocities, or of "
        "multipliers that hold constraints"
    )


def indefinite(matrix: OperatorMatrix) -> str:
    """That the matrix has eigenvalues of both signs, where two rows show it; empty where none do.

    A matrix without negative eigenvalues has no entry with a_ij^2 > a_ii a_jj, as every block of two rows is one.
    """
    i, j = matrix.edges.T
    own, size = matrix.diagonal, np.sqrt(np.abs(matrix.diagonal))
    over = np.flatnonzero((np.abs(matrix.entries) > (1 + SMALL) * size[i] * size[j]) | (own[i] * own[j] < 0))
    if not (len(over) and own.any()):
        return ""
    some = min(len(np.unique(i[over])), len(np.unique(j[over])))
    k = over[0]
    return saddle_point(matrix) or (
        f"the matrix has eigenvalues of both signs, as no stiffness matrix has: {count_of(some, 'row is', 'rows are')} "
        f"coupled to others by more than both diagonals allow, as rows {i[k]} and {j[k]}, so that entries are damaged, "
        "or those of initial stresses or of a saddle point were added"
    )


def seeming(matrix: OperatorMatrix) -> str:
    """What the matrix seems to be, and what is missing; empty where nothing shows."""
    if said := indefinite(matrix):
        return said
    if np.count_nonzero(matrix.entries) >= matrix.n * (matrix.n - 1) / 2:
        return (
            "every row is coupled to every other, as where other unknowns were condensed: each feels the supports "
            "then, so that rows do not annihilate translations, which is what tells positions"
        )
    if said := about_translations(matrix):
        return said
    degree = np.bincount(matrix.edges[matrix.entries != 0].ravel(), minlength=matrix.n)
    usual = int(max(np.median(degree), 1))
    hubs = np.flatnonzero(LITTLE * degree > usual)  # those of the widest nodes of meshes have three times as many
    if len(hubs):
        rows = words_of(hubs[:3].tolist()) + (", ..." if len(hubs) > 3 else "")
        return (
            f"{count_of(len(hubs), 'row is', 'rows are')} coupled to {degree[hubs].min()} others and more, and half of "
            f"all rows to {usual} at most (rows {rows}): constraints or rigid parts leave such"
        )
    positive = np.mean(matrix.entries[matrix.entries != 0] > 0) if matrix.entries.any() else 0.0
    own = matrix.diagonal[matrix.diagonal != 0]
    if len(own) and own.min() > 0 and LITTLE < positive < 1 - LITTLE and SMALL * own.max() > own.min():
        return (
            f"entries have both signs, and diagonals differ by a factor of {own.max() / own.min():.0e}, as where "
            "unknowns are displacements and rotations: perhaps a structure, of which it does not show which rows "
            f"belong to one node, so that you may {GIVE_NUMBERING}"
        )
    return ""
