"""Extreme eigenpair of the conformal pencil by Krylov steps with shifted factorisations."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle
from .pencil import ConformalPencil

_log = logging.getLogger(__name__)


class ShiftedSearch:
    """Shift-and-invert Krylov steps on the pencil, in units in which c is near 1.

    `analyse`: makes a factorisation from the pencil's pattern; called once; `most_steps`: most solves with one
    factorisation.
    """

    def __init__(
        self,
        pencil: ConformalPencil,
        analyse: Callable[[UpperTriangle], Factorisation],
        most_steps: int,
    ):
        self._pencil = pencil
        self._analyse = analyse
        self._most_steps = most_steps
        self._factor: Factorisation | None = None
        self.factorisations = 0
        self.solves = 0

    def at(self, shift: float, z: NDArray, steps: int | None = None) -> tuple[NDArray, float, float]:
        """Rayleigh-Ritz over the Krylov space of M(shift)^-1 T from z.

        Returns `z` (n,); `spread`: relative change of c in the last step.
        """
        matrix = self._pencil.matrix(shift)
        factor = self._factor = self._factor or self._analyse(matrix)
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
            size = _norm(z)
            for _ in range(2):
                z = z - _combination(basis[:k], _products(basis[:k], z))
            left = _norm(z)
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
        residual = self._pencil.energy_form(z) - c * self._pencil.area_form(z)
        assert self._factor is not None
        self.solves += 1
        return z - np.append(self._factor.solve(residual[:-1]), 0)


def _products(basis: NDArray, z: NDArray) -> NDArray:
    """u* z of each row u of a basis (k, n)."""
    # No BLAS here: its threads would compete with those of the solver, which stay awake for a while.
    return np.einsum("kn,n->k", basis, z.conj()).conj()


def _norm(z: NDArray) -> float:
    return float(np.sqrt(_products(z[None], z)[0].real))


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
