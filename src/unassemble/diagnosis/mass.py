"""Whether a matrix is a mass matrix, of whatever elements and unknowns: its eigenvalues and its couplings say so.

Scaled to identity blocks at its nodes, a consistent mass matrix has eigenvalues between bounds that depend on the
element alone, not on the mesh or on densities (Wathen 1987); those of a stiffness matrix come near to zero. And a rigid
translation feels all masses at once, so that the couplings of most unknowns add up in one vector, where those of
stiffnesses are against each other.

A. J. Wathen, Realistic eigenvalue bounds for the Galerkin mass matrix, IMA J. Numer. Anal. 7 (1987), 449-457.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from ..matrix import OperatorMatrix
from ..nodes.grouping import same_pattern
from ..structures.layouts import SPACE
from ..tolerances import LITTLE

_LEAST = 0.05
"""Eigenvalue that no stiffness matrix has: masses of beams have 0.08, hexahedra 1/8, squares 1/4, triangles 1/2."""

_TOGETHER = 0.98
"""Share of couplings that add up in one vector: of masses 0.99 and more, of a tenth of stiffness beside them 0.96."""

_PRECISE = 0.01
_RESTARTS = 20


def mass_bounds(matrix: OperatorMatrix) -> tuple[float, float] | None:
    """Least and largest eigenvalue of a mass matrix scaled to identity blocks; None for any other matrix.

    Rows of zeros, of unknowns without a mass, are left out.
    """
    used = matrix.diagonal != 0
    sign = np.sign(matrix.diagonal[used][0]) if used.any() else 0
    whole = sign * matrix.csr()
    whole.eliminate_zeros()
    if not (sign * matrix.diagonal >= 0).all() or whole.nnz != (M := whole[used][:, used]).nnz or M.shape[0] < 3:
        return None
    root = sp.diags_array(1 / np.sqrt(M.diagonal()))
    scaled = (root @ M @ root).tocsr()
    couplings = scaled - sp.eye_array(scaled.shape[0])
    if not couplings.maximum(0).sum() > LITTLE * abs(couplings).sum():
        return None  # on a graph with two colours, a grid's, the signs of one colour may be turned
    together, all_of_them = _extreme(couplings, "LA"), _extreme(abs(couplings), "LA")
    if together is None or all_of_them is None or together < _TOGETHER * all_of_them:
        return None
    least = _extreme(scaled, "SA", _blocks(scaled))
    return None if least is None or least < _LEAST else (least, 1 + together)


def _blocks(scaled: sp.csr_array) -> sp.csc_array:
    """The diagonal blocks of unknowns of one node, which are coupled to the same rows."""
    group = same_pattern(scaled)
    one = scaled.tocoo()
    few = np.bincount(group)[group] <= SPACE.block_size
    here = ((group[one.row] == group[one.col]) & few[one.row]) | (one.row == one.col)
    return sp.csc_array((one.data[here], (one.row[here], one.col[here])), shape=scaled.shape)


def _extreme(A: sp.csr_array, which: str, blocks: sp.csc_array | None = None) -> float | None:
    """The largest (``"LA"``) or least (``"SA"``) eigenvalue, relative to blocks; None where it does not show."""
    more: dict[str, object] = {}
    start: NDArray[np.float64] = np.random.default_rng(0).standard_normal(A.shape[0])
    try:
        if blocks is not None:
            more = {"M": blocks, "Minv": LinearOperator(A.shape, splu(blocks).solve)}
        found = eigsh(A, k=1, which=which, v0=start, tol=_PRECISE, maxiter=_RESTARTS, return_eigenvectors=False, **more)
    except (ArpackError, RuntimeError):  # no convergence, so no gap to zero; or singular blocks
        return None
    return float(found[0])
