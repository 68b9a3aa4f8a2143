"""The checks at the door: any matrix in, a clean symmetric operator or one clear sentence out."""

from numbers import Real
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import InputError, MatrixError
from ..words import count_of
from .canonical import as_csr, place
from .operator import OperatorMatrix, row_sizes
from .symmetry import from_columns, symmetric_entries, triangles


def check_matrix(A: Any, *, drop_zeros: float | None = None, noise: float | None = None) -> OperatorMatrix:
    """Check that a matrix has what every supported operator has, and store it as a weighted graph.

    `A` (n, n): sparse, or array_like; explicit zeros are structure, see `canonical`. `drop_zeros`: forget stored
    off-diagonal entries of at most this, 0 or more and below 1, times the largest off-diagonal entry of their row and
    of their transpose's. `noise`: standard deviation of independent errors in the entries; both triangles may then
    differ by ten times as much. Returns the mean of both triangles, of complex matrices of their real part; its
    ``warnings`` tell what was changed.

    Raises InputError if `drop_zeros` is out of range; MatrixError if the matrix is not square, empty,
    without numbers, not finite, diagonal, dense, not symmetric, or has far more rows than entries, entries whose
    products overflow, or connected rows out of all proportion. Both triangles may differ by 1e-10 of the largest
    off-diagonal entry of the two rows, or by a convection: an antisymmetric part whose rows add up to zero.
    """
    number = isinstance(drop_zeros, Real) and not isinstance(drop_zeros, bool)
    if drop_zeros is not None and not (number and 0 <= drop_zeros < 1):
        raise InputError(f"`drop_zeros` is a relative tolerance, at least 0 and below 1 (say 1e-12), not {drop_zeros}")
    csr, warnings = _real(as_csr(A))
    pairs, n, diagonal = triangles(csr), csr.shape[0], csr.diagonal()
    if not len(pairs.edges):
        raise MatrixError(
            "the matrix is diagonal, as a lumped mass matrix is: it tells how much mass each unknown has, and no mesh "
            "edge. Pass the stiffness matrix of the same mesh"
        )
    pairs, replaced, kept = from_columns(diagonal, pairs)
    entries, asymmetry, changed = symmetric_entries(csr, pairs, noise)
    edges, warnings = pairs.edges, (*warnings, *changed, *kept)
    if not entries.any():
        raise MatrixError("every stored off-diagonal entry is zero: the matrix says nothing about the shape of a mesh")
    if drop_zeros is not None:
        size = row_sizes(n, edges, np.abs(entries))
        with np.errstate(under="ignore"):
            keep = np.abs(entries) > drop_zeros * np.minimum(size[edges[:, 0]], size[edges[:, 1]])
        if dropped := len(edges) - np.count_nonzero(keep):
            said = (
                f"{dropped} of {count_of(len(edges), 'stored pair')} of off-diagonal entries forgotten: at most "
                f"{drop_zeros:g} times the largest off-diagonal entry of their row and of their transpose's"
            )
            edges, entries, warnings = edges[keep], entries[keep], (*warnings, said)
    _check_sizes(n, edges, entries, diagonal)
    return OperatorMatrix(n, edges, entries, diagonal, asymmetry, warnings, replaced=replaced)


def _real(csr: sp.csr_array) -> tuple[sp.csr_array, tuple[str, ...]]:
    """The real part of a matrix, and that others were left out: absorption, say, or the frequency's part."""
    if csr.dtype.kind != "c":
        return csr, ()
    imaginary = csr.data.imag != 0
    real = sp.csr_array((csr.data.real.copy(), csr.indices, csr.indptr), shape=csr.shape)
    if not imaginary.any():
        return real, ()
    i, j = place(csr, int(np.argmax(imaginary)))
    return real, (
        f"the matrix is complex, and its real part was taken: row {i}, column {j}, for one, is {csr[i, j]:.6g}",
    )


def _check_sizes(n: int, edges: NDArray[np.int64], entries: NDArray[np.float64], diagonal: NDArray[np.float64]) -> None:
    """Refuse what no finite elements in any units leave.

    Dense matrices, as those of condensation and of boundary elements: none of the elements that are read fills rows
    more, in the mean, than triquadratic hexahedra. Entries of which products, of a few as everything here takes,
    overflow. Connected rows next to which others vanish even when squared, so that quotients would overflow.
    """
    fullest = 3 * 5**3 - 1  # off-diagonal entries in a row of triquadratic hexahedra, with three unknowns to a node
    if 2 * len(edges) > fullest * n:
        raise MatrixError(
            f"the matrix is dense: a row has {2 * len(edges) / n:.0f} off-diagonal entries in the mean, and no finite "
            f"element matrix that is read has more than {fullest}"
        )
    largest, own, limit = np.abs(entries).max(), np.abs(diagonal).max(), np.finfo(float).eps ** -4
    if not (1 / limit < largest < limit and own < limit):
        raise MatrixError(
            f"the largest entries are {largest if largest <= 1 / limit else max(largest, own):.3g}, too far from 1 for "
            f"products of them: multiply the matrix by a number that brings them between {1 / limit:.0e} and "
            f"{limit:.0e}"
        )
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
