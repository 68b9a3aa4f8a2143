"""The checks at the door: any matrix in, a clean symmetric operator or one clear sentence out."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import InputError, MatrixError
from ..words import count_of
from .canonical import canonical, place, working_dtype
from .operator import OperatorMatrix, row_sizes
from .symmetry import from_columns, symmetric_entries, triangles


def check_matrix(A: Any, *, drop_zeros: float | None = None, noise: float | None = None) -> OperatorMatrix:
    """Check that a matrix has what every supported operator has, and store it as a weighted graph.

    Parameters
    ----------
    A : (n, n) scipy sparse matrix or array, or array_like
        Explicit zeros are structure, those in the blocks of ``bsr`` included (``drop_zeros=0`` forgets them);
        only zeros of the diagonal storage (``dia``), which cannot be told from padding, and of dense arrays
        are absent entries. Duplicates are summed. A is not changed.
    drop_zeros : float, optional
        Forget stored off-diagonal entries of at most this times the largest off-diagonal entry of their row
        and of their transpose's; at least 0 and below 1.
    noise : float, optional
        Standard deviation of independent errors in the entries: both triangles may then differ by ten
        times as much.

    Returns
    -------
    OperatorMatrix
        The mean of both triangles, of complex matrices of their real part; what was changed on the way is in its
        ``warnings``.

    Raises
    ------
    InputError
        If `drop_zeros` or `noise` is out of range.
    MatrixError
        If the matrix is not square, empty, without numbers, not finite, diagonal, dense, not symmetric, or has far
        more rows than entries, entries whose products overflow, or connected rows out of all proportion. Both
        triangles may differ by 1e-10 of the largest off-diagonal entry of the two rows, or by a convection: an
        antisymmetric part whose rows add up to zero.

    Examples
    --------
    >>> matrix = check_matrix([[2.0, -1.0], [-1.0, 2.0]])
    >>> matrix.n, matrix.edges.tolist(), matrix.entries.tolist()
    (2, [[0, 1]], [-1.0])
    """
    _check_options(drop_zeros, noise)
    csr, notes = _real(as_csr(A))
    pairs = triangles(csr)
    if not len(pairs.edges):
        raise MatrixError(_diagonal(csr.diagonal()))
    pairs, replaced, kept = from_columns(csr.diagonal(), pairs)
    entries, asymmetry, warnings = symmetric_entries(csr, pairs, noise)
    warnings += kept
    if not entries.any():
        raise MatrixError("every stored off-diagonal entry is zero: the matrix says nothing about the shape of a mesh")
    edges, warnings = pairs.edges, (*notes, *warnings)
    if drop_zeros is not None:
        edges, entries, dropped = _without_zeros(csr.shape[0], edges, entries, drop_zeros)
        warnings += dropped
    _check_density(csr.shape[0], edges)
    _check_size(csr.diagonal(), entries)
    _check_proportions(csr.shape[0], edges, entries)
    return OperatorMatrix(csr.shape[0], edges, entries, csr.diagonal(), asymmetry, warnings, replaced=replaced)


def _check_options(drop_zeros: float | None, noise: float | None) -> None:
    number = not isinstance(drop_zeros, bool) and isinstance(drop_zeros, (int, float, np.integer, np.floating))
    if drop_zeros is not None and not (number and 0 <= drop_zeros < 1):
        raise InputError(f"`drop_zeros` is a relative tolerance, at least 0 and below 1 (say 1e-12), not {drop_zeros}")
    if noise is not None and not (noise >= 0 and np.isfinite(noise)):
        raise InputError(f"`noise` is a standard deviation, finite and not negative, not {noise}")


def _diagonal(diagonal: NDArray[np.float64]) -> str:
    """What a matrix is that has nothing else: without negative entries, the masses of a lumped mass matrix."""
    if diagonal.any() and (diagonal >= 0).all():
        return (
            "the matrix is diagonal, as a lumped mass matrix is: it tells how much mass each unknown has, and no mesh "
            "edge. Pass the stiffness matrix of the same mesh"
        )
    return "the matrix is diagonal: it has no off-diagonal entry, and so no mesh edge"


def as_csr(A: Any) -> sp.csr_array:
    """A square matrix of finite numbers in compressed rows; see :func:`canonical`.

    Raises
    ------
    MatrixError
        If it is none.
    """
    A = _as_sparse(A)
    _check_shape(A.shape)
    csr = canonical(_with_numbers(A))
    _check_entries(csr)
    return csr


def _as_sparse(A: Any) -> Any:
    """A as a scipy sparse matrix of whatever format and type; zeros of a dense one are left out."""
    if sp.issparse(A):
        _check_dimensions(A.ndim)
        return A
    try:
        dense = np.asarray(A)
    except Exception as error:  # foreign types convert with any exception they like
        raise MatrixError(f"an object of type {type(A).__name__} cannot be taken for a matrix ({error})") from error
    if dense.dtype.kind not in "biufc":
        raise MatrixError(
            f"an object of type {type(A).__name__} (as an array: {dense.dtype}) is not a matrix of numbers: "
            "pass a scipy sparse matrix, a numpy array or a path"
        )
    _check_dimensions(dense.ndim)
    rows, columns = np.nonzero(dense)
    with np.errstate(over="ignore"):  # a long double beyond the range becomes infinite, and is found as such
        entries: NDArray = dense[rows, columns].astype(working_dtype(dense.dtype), copy=False)
    return sp.coo_array((entries, (rows, columns)), shape=dense.shape)


def _check_dimensions(ndim: int) -> None:
    if ndim != 2:
        raise MatrixError(f"a matrix has two dimensions, not {ndim}")


def _check_shape(shape: tuple[int, int]) -> None:
    rows, columns = shape
    if rows != columns:
        raise MatrixError(f"the matrix is not square: it has {count_of(rows, 'row')} and {count_of(columns, 'column')}")
    if rows == 0:
        raise MatrixError("the matrix is empty: it has 0 rows")


def _with_numbers(A: Any) -> Any:
    if A.dtype.kind == "b":
        raise MatrixError(
            "the matrix has a pattern only (its type is bool) and no numbers: the shape of the mesh is in the "
            "numbers, so pass the matrix with its values"
        )
    if A.dtype.kind not in "iufc":
        raise MatrixError(f"the entries of the matrix are of type {A.dtype}, not numbers: convert them to float64")
    return A


def _check_entries(csr: sp.csr_array) -> None:
    finite = np.isfinite(csr.data)
    if not finite.all():
        k = int(np.argmin(finite))
        i, j = place(csr, k)
        more = len(finite) - np.count_nonzero(finite) - 1
        others = f" (and {count_of(int(more), 'more entry is', 'more entries are')} not finite)" if more else ""
        raise MatrixError(
            f"the entry at row {i}, column {j} is {csr.data[k]}{others}: every entry must be a finite number"
        )


def _real(csr: sp.csr_array) -> tuple[sp.csr_array, tuple[str, ...]]:
    """The real part of a matrix, and that others were left out: absorption, say, or the frequency's part."""
    if csr.dtype.kind != "c":
        return csr, ()
    imaginary = csr.data.imag != 0
    real = sp.csr_array((csr.data.real.copy(), csr.indices, csr.indptr), shape=csr.shape)
    if not imaginary.any():
        return real, ()
    i, j = place(csr, int(np.argmax(imaginary)))
    note = f"the matrix is complex, and its real part was taken: row {i}, column {j}, for one, is {csr[i, j]:.6g}"
    return real, (note,)


def _check_density(n: int, edges: NDArray[np.int64]) -> None:
    """Refuse matrices that are dense, as those of condensation and of boundary elements are.

    None of the elements that are read fills rows more, in the mean, than triquadratic hexahedra.
    """
    fullest = 3 * 5**3 - 1  # off-diagonal entries in a row of triquadratic hexahedra, with three unknowns to a node
    if 2 * len(edges) > fullest * n:
        raise MatrixError(
            f"the matrix is dense: a row has {2 * len(edges) / n:.0f} off-diagonal entries in the mean, and no finite "
            f"element matrix that is read has more than {fullest}"
        )


def _check_size(diagonal: NDArray[np.float64], entries: NDArray[np.float64]) -> None:
    """Refuse entries that no units explain: products of a few of them, as everything here takes, would overflow."""
    largest, limit = np.abs(entries).max(), np.finfo(float).eps ** -4
    if not (1 / limit < largest < limit and np.abs(diagonal).max() < limit):
        beyond = max(largest, np.abs(diagonal).max()) if largest > 1 / limit else largest
        raise MatrixError(
            f"the largest entries are {beyond:.3g}, too far from 1 for products of them: multiply the matrix by a "
            f"number that brings them between {1 / limit:.0e} and {limit:.0e}"
        )


def _check_proportions(n: int, edges: NDArray[np.int64], entries: NDArray[np.float64]) -> None:
    """Refuse connected rows next to which others vanish even when squared: their quotients would overflow."""
    size = row_sizes(n, edges, np.abs(entries))
    rows, least = np.flatnonzero(size), np.full(n, np.inf)
    vanishing = np.finfo(float).eps ** 2
    with np.errstate(under="ignore"):
        if size.max(initial=0.0) * vanishing <= size[rows].min(initial=np.inf):
            return
        nonzero = entries != 0
        graph = sp.coo_array((entries[nonzero], edges[nonzero].T), shape=(n, n))
        label = csgraph.connected_components(graph, directed=False)[1]
        np.minimum.at(least, label[rows], size[rows])
        beside = rows[size[rows] * vanishing > least[label[rows]]]
    if len(beside):
        i = int(beside[0])
        j = int(rows[(label[rows] == label[i]) & (size[rows] == least[label[i]])][0])
        raise MatrixError(
            f"rows {i} and {j} are connected, but out of all proportion: their largest off-diagonal entries are "
            f"{size[i]:.3g} and {size[j]:.3g}"
        )


def _without_zeros(
    n: int, edges: NDArray, entries: NDArray, tolerance: float
) -> tuple[NDArray, NDArray, tuple[str, ...]]:
    """Forget the pairs that are small for both of their rows."""
    size = row_sizes(n, edges, np.abs(entries))
    with np.errstate(under="ignore"):
        keep = np.abs(entries) > tolerance * np.minimum(size[edges[:, 0]], size[edges[:, 1]])
    dropped = len(edges) - np.count_nonzero(keep)
    if not dropped:
        return edges, entries, ()
    sentence = (
        f"{dropped} of {count_of(len(edges), 'stored pair')} of off-diagonal entries forgotten: at most "
        f"{tolerance:g} times the largest off-diagonal entry of their row and of their transpose's"
    )
    return edges[keep], entries[keep], (sentence,)
