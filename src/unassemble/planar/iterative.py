"""Normal equations by conjugate gradients, preconditioned by a conformal energy.

The direct factor of J'J has about ten times the entries of the conformal one. Where that is too
much memory, this serves: J'J measures how angles change, the conformal energy how far a displacement is from being
conformal, triangle by triangle. With triangles weighted so that both agree on each of them the two are close
to spectrally equivalent on irregular meshes (a displacement that is nearly conformal is nearly in both null
spaces), and the energy is Hermitian with one complex unknown a vertex. On lattices they are not: the steps needed grow
with the size.
"""

import logging

import numpy as np
from numpy.typing import NDArray

from ..linalg import UpperTriangle, factorisation
from ..tolerances import SINGULAR
from ..topology import Piece
from .cotangent import corner_gradients, corner_sides, cotangent
from .normal import Jacobian, NormalEquations, WeightJacobian
from .pencil import ConformalPencil

_log = logging.getLogger(__name__)


class IterativeNormalEquations(NormalEquations):
    """The same in linear memory, of triangles counter-clockwise; solutions have no component along similarities."""

    def __init__(self, jacobian: WeightJacobian):
        self.renew(jacobian)

    def renew(self, jacobian: Jacobian) -> None:
        """For other positions."""
        assert isinstance(jacobian, WeightJacobian)
        self._forward, z = jacobian.matrix.tocsr(), jacobian.z
        self._gauge = np.linalg.qr(np.column_stack([np.ones(len(z)), z - z.mean()]))[0]
        energy = _weighted_energy(jacobian.piece, z, jacobian.spread)
        self._factor = factorisation(energy)
        self._factor.factorise(energy)

    def solve(self, rhs: NDArray) -> NDArray:
        """Displacement d (n,) complex with J'J d = rhs."""
        x = np.zeros_like(rhs)
        residual = self._project(rhs)
        direction = y = self._precondition(residual)
        size = first = np.vdot(residual, y).real
        iterations = 0
        while size > 1e-10 * first and iterations < 400:  # the energy norm of the error falls by 1e-5
            image = self._forward.T @ (self._forward @ direction.view(np.float64))
            image = self._project(image.view(np.complex128))
            step = size / np.vdot(direction, image).real
            x = x + step * direction
            residual = residual - step * image
            y = self._precondition(residual)
            previous, size = size, np.vdot(residual, y).real
            direction = y + (size / previous) * direction
            iterations += 1
        _log.debug("normal equations: %d iterations, reduction %.1e", iterations, np.sqrt(size / first) if first else 0)
        return x

    def _precondition(self, residual: NDArray) -> NDArray:
        return self._project(np.append(self._factor.solve(residual[:-1]), 0))

    def _project(self, d: NDArray) -> NDArray:
        return d - self._gauge @ (self._gauge.conj().T @ d)


def _weighted_energy(piece: Piece, z: NDArray, spread: NDArray) -> UpperTriangle:
    """Sum over triangles of a_t (L_t / 2 - T_t), without the last vertex's row and column.

    L_t and T_t are the triangle's Laplacian and signed area; a_t makes the trace of its term that of its share of J'J
    for complex-linear displacements.
    """
    u, w = corner_sides(piece.triangles, z)
    at_u, at_w, cotangents = *corner_gradients(u, w), cotangent(u, w)
    gradients = np.abs(at_u) ** 2 + np.abs(at_w) ** 2 + np.abs(at_u + at_w) ** 2
    weight = (gradients / spread[piece.opposite] ** 2).sum(axis=1) / cotangents.sum(axis=1)
    one, other = weight[piece.facing // 3].T
    strength = one - np.where(piece.inner, other, 0)  # each triangle runs along its edges, counter-clockwise
    weights = np.bincount(piece.opposite.ravel(), (weight[:, None] * cotangents / 2).ravel(), len(piece.edges))
    pencil = ConformalPencil(piece.n_vertices, piece.edges, piece.stencil[:2].T, weights, strength)
    return pencil.matrix(1 - SINGULAR)  # the similarity itself, which is projected out, would make it singular
