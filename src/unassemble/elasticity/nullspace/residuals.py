"""What the found positions leave of the identities, written out one by one.

The solver eliminates p and q by a projection; here they are eliminated by taking differences of equations that contain
the same one. These numbers tell how good a fit is. What a body is worth is decided by :mod:`unassemble.certificate`.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...nodes.nodal import NodalMatrix, determined


def residuals(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) misfits of valid identities, relative to the size of a row times the mean distance of coupled nodes.

    Those that touch nodes without coordinates are skipped.
    """
    d = nodal.dim
    known = determined(points)
    x = np.where(known[:, None], points, 0.0)
    blind = sp.csr_array(
        (np.abs(nodal.data).max(axis=(1, 2)), nodal.indices, nodal.indptr), shape=(nodal.n, nodal.n)
    ) @ (~known).astype(float)
    usable = valid & (blind == 0)[:, None, None]
    off = nodal.node < nodal.indices
    length = np.linalg.norm(points[nodal.node[off]] - points[nodal.indices[off]], axis=1)
    mean = float(np.nanmean(length)) if np.isfinite(length).any() else 1.0
    size = np.where(nodal.size > 0, nodal.size, 1.0) * mean
    value = np.empty((d, d, d, nodal.n))
    for c, b in product(range(d), repeat=2):
        entries = np.ascontiguousarray(nodal.data[:, c, b])
        block = sp.csr_array((entries, nodal.indices, nodal.indptr), shape=(nodal.n, nodal.n))
        value[c, b] = (block @ x).T / size
    return np.concatenate([misfit[needed] for misfit, needed in _differences(value, usable, d)])


def _differences(value: NDArray, usable: NDArray[np.bool_], d: int) -> Iterator[tuple[NDArray, NDArray]]:
    """Pairs of misfit and mask, (n,) each; value[c, b, a] is A^{cb} x_a."""
    for c, b, a in product(range(d), repeat=3):
        if len({a, b, c}) == 3:  # A^{cb} x_a = 0
            yield value[c, b, a], usable[:, c, b]
    for a, b, c in product(range(d), repeat=3):
        if a != b and c != b:  # A^{ab} x_a = q_b = A^{cc} x_b
            yield value[a, b, a] - value[c, c, b], usable[:, a, b] & usable[:, c, c]
        if a != b and c not in (a, b):  # A^{ba} x_a = p_b = A^{bc} x_c
            yield value[b, a, a] - value[b, c, c], usable[:, b, a] & usable[:, b, c]
    for a, b in product(range(d), repeat=2):
        if a != b:  # A^{bb} x_b = p_b + 2 q_b
            misfit = value[b, b, b] - value[b, a, a] - 2 * value[a, b, a]
            yield misfit, usable[:, b, b] & usable[:, b, a] & usable[:, a, b]
