"""Both triangles of a matrix become one weighted graph, or the pair that forbids it is named."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixError
from ..tolerances import MOST, ROUNDED, SIGMAS, SUMMED
from ..words import count_of
from .canonical import entry_rows
from .operator import row_sizes


@dataclass(frozen=True, eq=False)
class Triangles:
    """Both triangles of a matrix on one pattern."""

    edges: NDArray[np.int64]  # (e, 2) pairs i < j with A_ij or A_ji stored, in lexicographic order
    # (e,) each: A_ij and A_ji; zero where only the other one is stored
    upper: NDArray[np.float64]
    lower: NDArray[np.float64]
    one_sided: int  # number of pairs of which only one entry is stored


def triangles(A: sp.csr_array) -> Triangles:
    """Pair every stored entry with its transpose."""
    n_stored, T = A.nnz, A.T.tocsr()
    if not (np.array_equal(A.indptr, T.indptr) and np.array_equal(A.indices, T.indices)):
        # Addition of sparse matrices would drop the zeros: summing duplicate coordinates does not.
        rows, data = entry_rows(A), np.concatenate([A.data, np.zeros(A.nnz)])
        places = np.concatenate([rows, A.indices]), np.concatenate([A.indices, rows])
        A = sp.coo_array((data, places), shape=A.shape).tocsr()
        T = A.T.tocsr()
    rows = entry_rows(A)
    above = A.indices > rows
    edges = np.column_stack([rows[above], A.indices[above]]).astype(np.int64)
    return Triangles(edges, A.data[above], T.data[above], A.nnz - n_stored)


def from_columns(diagonal: NDArray, pairs: Triangles) -> tuple[Triangles, NDArray[np.bool_] | None, tuple[str, ...]]:
    """Entries of rows without any off the diagonal, which is not zero, taken from their columns where these were kept.

    Returns `replaced` (n,): such rows, those too that have such neighbours only; None where no column is left.
    """
    row, column = np.zeros(len(diagonal)), np.zeros(len(diagonal))
    for end, own, other in ((0, pairs.upper, pairs.lower), (1, pairs.lower, pairs.upper)):
        np.maximum.at(row, pairs.edges[:, end], np.abs(own))
        np.maximum.at(column, pairs.edges[:, end], np.abs(other))
    replaced = (row == 0) & (diagonal != 0) & (np.bincount(pairs.edges.ravel(), minlength=len(row)) > 0)
    if not (column[replaced] > 0).any():
        return pairs, None, ()
    first, second = replaced[pairs.edges].T
    rest = ~(first | second)
    size = np.maximum(row, column).max()
    if not pairs.upper[rest].any() or (np.abs(pairs.upper - pairs.lower)[rest] > SUMMED * size).any():
        return pairs, None, ()  # not symmetric for other reasons
    upper, lower = np.where(first, pairs.lower, pairs.upper), np.where(second, pairs.upper, pairs.lower)
    warning = (
        f"{count_of(int(replaced.sum()), 'row has', 'rows have')} nothing off the diagonal while the columns have, as "
        "where a boundary condition was put in: entries were taken from the columns"
    )
    return replace(pairs, upper=upper, lower=lower, one_sided=0), replaced, (warning,)


def symmetric_entries(
    A: sp.csr_array, pairs: Triangles, noise: float | None
) -> tuple[NDArray[np.float64], float, tuple[str, ...]]:
    """Average both triangles where they differ at rounding level, or by a convection.

    Returns (e,) entries; the largest difference relative to the largest off-diagonal entry of the two rows; and in
    sentences what was added or averaged, but for differences as rounding leaves them in nearly every matrix.

    Raises MatrixError naming the pair that differs most.
    """
    warnings: tuple[str, ...] = ()
    if pairs.one_sided:
        some = count_of(pairs.one_sided, "entry is", "entries are")
        warnings = (f"{some} stored on one side of the diagonal only; places on the other were added to the structure",)
    differing = np.flatnonzero(pairs.upper != pairs.lower)
    if not len(differing):
        return pairs.upper, 0.0, warnings
    i, j = pairs.edges[differing].T
    upper, lower = pairs.upper[differing], pairs.lower[differing]
    row = row_sizes(A.shape[0], pairs.edges, np.maximum(np.abs(pairs.upper), np.abs(pairs.lower)))
    size = np.maximum(row[i], row[j])
    with np.errstate(over="ignore", under="ignore"):  # an infinite difference is one too large
        difference = np.abs(upper - lower)
        tolerance = np.maximum(SUMMED * size, SIGMAS * (noise or 0.0))
        relative = difference / size
    if (difference > tolerance).any():
        if not _turns(A.shape[0], pairs):
            worst = int(np.argmax(np.where(difference > tolerance, difference, -1.0)))
            raise _not_symmetric(A, pairs, int(i[worst]), int(j[worst]), noise)
        turning = (
            "the matrix is not symmetric, and its symmetric part was taken: the rows of the antisymmetric part add up "
            "to zero, as those of a convection do"
        )
        return 0.5 * pairs.upper + 0.5 * pairs.lower, 0.0, (*warnings, turning)
    entries = pairs.upper.copy()
    entries[differing] += 0.5 * (lower - upper)
    worst = int(np.argmax(relative))
    if relative[worst] > ROUNDED:
        warnings += (
            f"{count_of(len(differing), 'entry was', 'entries were')} averaged with the transpose: they differ by up "
            f"to {relative[worst]:.1e} of the largest off-diagonal entry of the rows ({i[worst]} and {j[worst]})",
        )
    return entries, float(relative[worst]), warnings


def _turns(n: int, pairs: Triangles) -> bool:
    """Whether the antisymmetric part is a convection without flow through the boundary.

    Its rows then add up to zero, since constants are not carried anywhere, and the symmetric part is the rest of the
    operator: int v b . grad(u) changes its sign as u and v change places.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        part = 0.5 * pairs.upper - 0.5 * pairs.lower
        i, j = pairs.edges.T
        sums = np.bincount(i, part, n) - np.bincount(j, part, n)
        size = row_sizes(n, pairs.edges, np.abs(part))
        return not pairs.one_sided and bool((np.abs(sums) <= SUMMED * np.maximum(size, ROUNDED * size.max())).all())


def _not_symmetric(A: sp.csr_array, pairs: Triangles, i: int, j: int, noise: float | None) -> MatrixError:
    if pairs.one_sided == len(pairs.edges):
        return MatrixError(
            "the matrix is not symmetric, because of all entries only those on one side of the diagonal are stored: "
            "store the others as well, or write 'symmetric' in the first line of a Matrix Market file"
        )
    with np.errstate(over="ignore"):
        unlike = np.abs(pairs.upper - pairs.lower) > SUMMED * np.maximum(np.abs(pairs.upper), np.abs(pairs.lower))
    here, there = _shown(A, i, j), _shown(A, j, i)
    if unlike.mean() > MOST and not pairs.one_sided:
        return MatrixError(
            f"the matrix is not symmetric: {unlike.mean():.0%} of all entries differ from their transposes, as where "
            f"convection or another first derivative was added (row {i}, column {j} is {here}, and row {j}, column "
            f"{i} is {there}). Assemble the matrix without that term"
        )
    remedy = "" if noise is not None else " (if the entries are measured, give their `noise`)"
    return MatrixError(
        f"the matrix is not symmetric, most at row {i}, column {j}: that entry is {here} and its transpose, row {j}, "
        f"column {i}, is {there}. Both must be the same number{remedy}, or differ by a convection, whose rows add up "
        "to zero"
    )


def _shown(A: sp.csr_array, i: int, j: int) -> str:
    stored = j in A.indices[A.indptr[i] : A.indptr[i + 1]]
    return repr(float(A[i, j])) if stored else "not stored"
