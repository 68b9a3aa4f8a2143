"""The conformal pencil of a piece, half the Dirichlet energy against the signed area, and its extreme eigenpair.

For a map z = x + iy of the mesh into the plane, E(z) = z* L z / 2 is its Dirichlet energy and
a(z) = z* T z its signed area, with T_ab = 1/(4i), T_ba = -1/(4i) for each boundary edge a -> b that
has the mesh on its left. For A = c L + D the matrix c L is known (its rows sum to zero), and

    M(s) = c L / 2 - s T

is positive semidefinite for 0 <= s <= c; M(c) z = 0 exactly for similarities of the true mesh.
"""

import logging

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle, factorisation, upper_from_edges
from ..topology.keys import contains, pair_keys

_log = logging.getLogger(__name__)


class ConformalPencil:
    """M(s) with the last vertex pinned at zero, which removes the constants from its null space.

    Of n vertices; `edges` (e, 2): pairs i < j in lexicographic order; `boundary` (b, 2): directed edges with the mesh
    on their left; `weights` (e,): c w = -A_ij of each edge; `strength` (b,): factors of the boundary edges, such that
    those that enter a vertex add up to those that leave it; 1 by default.
    """

    def __init__(self, n: int, edges: NDArray, boundary: NDArray, weights: NDArray, strength: NDArray | None = None):
        self.n = n
        self._strength = np.ones(len(boundary)) if strength is None else strength
        self.tail, self.head = boundary.T
        # An edge without weight has no entries, unless it lies on the boundary: diagonals of undivided cells.
        used = weights != 0
        if not used.all():
            used |= contains(np.sort(pair_keys(n, *boundary.T)), pair_keys(n, *edges.T))
        edges, weights = edges[used], weights[used]
        self._low, self._high = (np.ascontiguousarray(end) for end in edges.T)
        self._half_weights = weights / 2
        diagonal = np.bincount(edges.ravel(), np.repeat(weights, 2), self.n)
        kept = edges[:, 1] < self.n - 1  # the pinned vertex is the higher end of all its edges
        edges = edges[kept]
        self._energy = upper_from_edges(self.n - 1, edges, -weights[kept] / 2, diagonal[:-1] / 2)
        # Places of the boundary edges there, and the sign of T at them (times -i/4).
        inside = (boundary < self.n - 1).all(axis=1)
        low, high = np.sort(boundary[inside], axis=1).T
        key = edges[:, 0] * self.n + edges[:, 1]
        # Row i of the triangle starts with its diagonal: i + 1 of those come before an entry of row i.
        self._place = np.searchsorted(key, low * self.n + high) + low + 1
        self._sign = self._strength[inside] * np.where(self.tail[inside] < self.head[inside], 1.0, -1.0)

    def matrix(self, shift: float) -> UpperTriangle:
        """M(shift) without the pinned row and column."""
        data = self._energy.data.astype(np.complex128)
        data[self._place] += 0.25j * shift * self._sign
        return self._energy.with_data(data)

    def energy_form(self, z: NDArray) -> NDArray:
        """c L z / 2 for z (n,) complex.

        From differences along edges: its error is rounding relative to an edge's length, not to the mesh's extent.
        """
        flow = self._half_weights * (z[self._low] - z[self._high])
        parts = [np.bincount(self._low, f, self.n) - np.bincount(self._high, f, self.n) for f in (flow.real, flow.imag)]
        return parts[0] + 1j * parts[1]

    def area_form(self, z: NDArray) -> NDArray:
        """T z for z (n,) complex."""
        forward = np.zeros(self.n, dtype=np.complex128)
        # As many boundary edges enter a vertex as leave it, so that differences give the same sum.
        side = -0.25j * self._strength * (z[self.head] - z[self.tail])
        # Each vertex of a boundary that touches itself occurs more than once: accumulate.
        np.add.at(forward, self.tail, side)
        np.add.at(forward, self.head, side)
        return forward


class ShiftedSearch:
    """Shift-and-invert Krylov steps on the pencil, in units in which c is near 1; the pattern is ordered once.

    `most_steps`: most solves with one factorisation.
    """

    def __init__(self, pencil: ConformalPencil, most_steps: int):
        self._pencil = pencil
        self._most_steps = most_steps
        self._factor: Factorisation | None = None
        self.factorisations = self.solves = 0

    def at(self, shift: float, z: NDArray, steps: int | None = None) -> tuple[NDArray, float, float]:
        """Rayleigh-Ritz over the Krylov space of M(shift)^-1 T from z.

        Returns `z` (n,); `spread`: relative change of c in the last step.
        """
        matrix = self._pencil.matrix(shift)
        factor = self._factor = self._factor or factorisation(matrix)
        factor.factorise(matrix)
        self.factorisations += 1
        n_steps = steps or self._most_steps
        basis = np.empty((n_steps, len(z)), dtype=np.complex128)
        energy, area = np.zeros((2, n_steps, n_steps), dtype=np.complex128)  # the forms on the basis, upper triangles
        y = np.empty(0)
        c, spread = np.inf, 1.0
        for k in range(n_steps):
            z = np.append(factor.solve(self._pencil.area_form(z)[:-1]), 0)
            self.solves += 1
            size = np.sqrt(_products(z[None], z)[0].real)
            for _ in range(2):
                z = z - _combination(basis[:k], _products(basis[:k], z))
            left = np.sqrt(_products(z[None], z)[0].real)
            if not left > 1e-13 * size:  # the space is invariant
                spread = 0.0
                break
            basis[k] = z = z / left
            m = k + 1
            energy[:m, k] = _products(basis[:m], self._pencil.energy_form(z))
            area[:m, k] = _products(basis[:m], self._pencil.area_form(z))
            previous, found = c, _ritz(energy[:m, :m], area[:m, :m])
            if found is None:  # the map that is sought has a part in the next vectors only
                continue
            c, y = found
            spread = abs(previous / c - 1) if np.isfinite(previous) else 1.0
            if spread < 1e-15:
                break
        if not len(y):
            raise GeometryError("no map has positive area: the entries, or the given scale, fit no mesh on this graph")
        _log.debug("shift %.12g: c = %.16g, last change %.1e", shift, c, spread)
        return _combination(basis[: len(y)], y), c, spread

    def corrected(self, z: NDArray, c: float) -> NDArray:
        """One step of inverse iteration on a correction of z, with the last factorisation.

        The solves round relative to the extent of the mesh, and all that they round adds up in the row of the pinned
        vertex, which they leave out. The residual is accurate relative to edges, and so is what this leaves.
        """
        assert self._factor is not None
        self.solves += 1
        residual = self._pencil.energy_form(z) - c * self._pencil.area_form(z)
        return z - np.append(self._factor.solve(residual[:-1]), 0)


def _products(basis: NDArray, z: NDArray) -> NDArray:
    """u* z of each row u of a basis (k, n)."""
    # No BLAS here: its threads would compete with those of the solver, which stay awake for a while.
    return np.einsum("kn,n->k", basis, z.conj()).conj()


def _combination(basis: NDArray, coefficients: NDArray) -> NDArray:
    """Sum of the rows of a basis times coefficients."""
    return np.einsum("kn,k->n", basis, coefficients)


def _ritz(energy: NDArray, area: NDArray) -> tuple[float, NDArray] | None:
    """Least quotient energy / area for the upper triangles of Hermitian (k, k) forms; None if no area is positive."""
    # With its indefinite side on the left the pencil is regular: 1/c is the greatest eigenvalue.
    try:
        inverse, vectors = scipy.linalg.eigh(area, energy, lower=False)
    except (np.linalg.LinAlgError, ValueError) as error:
        # Not positive definite, or not even finite: the Dirichlet energy of a mesh is neither.
        raise GeometryError("the entries do not make a positive energy: they belong to no planar mesh") from error
    if inverse[-1] <= 0:
        return None
    return float(1 / inverse[-1]), vectors[:, -1]
