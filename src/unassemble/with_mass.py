"""Scalar matrices that have a mass term: A = c L + s M, M consistent or lumped.

Areas are taken off the matrix, what is left is a Laplacian and recovered as one, and the whole is assembled again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .certify import Certificate, Mass, certify
from .clock import Clock
from .errors import RecoveryError
from .linalg import factorisation
from .matrix import OperatorMatrix
from .planar.conformal import conformal_map
from .planar.cotangent import edge_weights
from .reaction import MetricFit, Skeleton, fit_metric
from .recovery import PlanarMesh
from .tolerances import CERTIFIED, ROUNDED, SIGMAS
from .topology import Topology, surfaces

Plain = Callable[..., PlanarMesh]

_ALIKE = 1e-6
"""Relative difference up to which row sums are areas, and entries those of a Laplacian, at first sight."""


def recover_with_mass(
    matrix: OperatorMatrix,
    plain: Plain,
    clock: Clock,
    tensor: tuple[float, float, float] | None = None,
) -> PlanarMesh:
    """The mesh of a scalar matrix, with what its row sums tell of a mass term.

    Parameters
    ----------
    matrix : OperatorMatrix
    plain : callable
        Recovers a matrix c L + D; knows relative sizes of its pieces if told the squared lengths of edges.
    clock : Clock
    tensor : (kxx, kxy, kyy), optional
    """
    sums = _Sums.of(matrix)
    if not sums.sign:
        return plain(matrix)
    with clock("topology"):
        topology = surfaces(matrix.n, matrix.edges)
    if not topology.pieces or len(topology.bare_edges) or not topology.multiplicity.all():
        return plain(matrix)
    with clock("conformal"):
        laplacian = _is_laplacian(matrix, topology)
    if laplacian:
        return _with_lumped_mass(matrix, plain(matrix), sums.values, tensor)
    with clock("metric"):
        skeleton = Skeleton.of(matrix.n, matrix.edges, topology.pieces)
        fit = fit_metric(skeleton, sums.sign * matrix.entries, sums.positive(), sums.trust())
    if fit is None or not fit.residual < _ALIKE:
        return plain(matrix)
    try:
        found = plain(_without_mass(matrix, sums.sign, fit), fit.metric.u)
    except RecoveryError:
        return plain(matrix)
    total = sums.sign * float(fit.metric.areas.sum())
    with clock("certify"):
        mass = Mass(total / _area(found), matrix.diagonal)
        certificate = _certificate(matrix, found, mass, tensor)
    return _certified_again(found, mass, certificate)


@dataclass(frozen=True, eq=False)
class _Sums:
    """Row sums, the integrals of s times the basis functions.

    Attributes
    ----------
    values : (n,) float64
        A 1.
    rounding : (n,) float64
        About their errors.
    """

    values: NDArray[np.float64]
    rounding: NDArray[np.float64]

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> _Sums:
        def summed(diagonal: NDArray, entries: NDArray) -> NDArray:
            return diagonal + sum(np.bincount(end, entries, matrix.n) for end in matrix.edges.T)

        total = summed(np.abs(matrix.diagonal), np.abs(matrix.entries))
        return cls(summed(matrix.diagonal, matrix.entries), 4 * np.finfo(float).eps * total)

    @property
    def sign(self) -> int:
        """Of all that are beyond rounding, if these are the most and have one sign; else 0.

        Small triangles of graded meshes have integrals that may be lost.
        """
        there = np.abs(self.values) > SIGMAS * self.rounding
        signs = np.sign(self.values[there])
        return int(signs[0]) if 2 * there.sum() > len(there) and np.ptp(signs) == 0 else 0

    def positive(self) -> NDArray[np.float64]:
        """(n,) their sizes, at least those of rounding."""
        return np.maximum(np.abs(self.values), self.rounding)

    def trust(self) -> NDArray[np.float64]:
        """(n,) weights that make rounding alike."""
        return np.minimum(1.0, CERTIFIED * self.positive() / self.rounding)


def _is_laplacian(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether the conformal map fits all entries off the diagonal, whatever stands on it."""
    for piece in topology.pieces:
        weights = -matrix.entries[piece.edge_rows]
        try:
            found = conformal_map(piece, weights, sharp=False, analyse=factorisation)
        except RecoveryError:
            return False
        with np.errstate(all="ignore"):
            left = np.abs(weights - found.scale * edge_weights(piece, found.z))
        if not np.median(left) <= _ALIKE * np.median(np.abs(weights)):
            return False
    return True


def _without_mass(matrix: OperatorMatrix, sign: float, fit: MetricFit) -> OperatorMatrix:
    """The Laplacian that is left."""
    skeleton, areas = fit.metric.skeleton, sign * fit.metric.areas
    return replace(
        matrix,
        entries=matrix.entries - skeleton.at_edges @ areas / 12,
        diagonal=matrix.diagonal - skeleton.at_vertices @ areas / 6,
    )


def _with_lumped_mass(
    matrix: OperatorMatrix, found: PlanarMesh, sums: NDArray, tensor: tuple[float, float, float] | None
) -> PlanarMesh:
    """A mesh of c L + D; if D is proportional to the areas about its vertices that is a lumped mass matrix."""
    if not found.certified or found.n_polygons:
        return found
    reaction = float(sums.sum()) / _area(found)
    share = np.zeros(matrix.n)
    np.add.at(share, found.triangles, _areas(found)[:, None] / 3)
    mass = Mass(reaction, matrix.diagonal, lumped=True)
    if not np.abs(sums - reaction * share).max() <= _ALIKE * np.abs(reaction * share).min():
        return found
    certificate = _certificate(matrix, found, mass, tensor)
    return _certified_again(found, mass, certificate) if certificate.backward_error <= CERTIFIED else found


def _areas(mesh: PlanarMesh) -> NDArray[np.float64]:
    a, b, c = mesh.points[mesh.triangles].transpose(1, 2, 0)
    (ux, uy), (wx, wy) = b - a, c - a
    return np.asarray((ux * wy - uy * wx) / 2)


def _area(mesh: PlanarMesh) -> float:
    return float(_areas(mesh).sum())


def _certificate(
    matrix: OperatorMatrix, mesh: PlanarMesh, mass: Mass, tensor: tuple[float, float, float] | None
) -> Certificate:
    factor = mesh.scale[mesh.component[mesh.triangles].max(axis=1)]
    return certify(matrix.edges, matrix.entries, mesh.points, mesh.triangles, factor, tensor, mass)


def _certified_again(found: PlanarMesh, mass: Mass, certificate: Certificate) -> PlanarMesh:
    """The mesh of the Laplacian as that of the whole matrix, its mass included."""
    error = certificate.backward_error
    good = error <= CERTIFIED and not len(certificate.flipped)
    kind = "lumped" if mass.lumped else "consistent"
    fits = f"c L + s M, M the {kind} mass matrix, re-assembled on this mesh gives the matrix back to {error:.1e}"
    size = (
        f"the mesh has a size: if the factor of the mass matrix is s, lengths are those given here times "
        f"sqrt({mass.reaction:.12g} / s)"
    )
    worst, misfits = certificate.worst(0 if good else 10)
    return replace(
        found,
        reaction=mass.reaction,
        status=found.status if good else "uncertified",
        uniqueness=found.uniqueness if good else None,
        reason=(fits if found.certified else f"{fits}, but {found.reason}") if good else f"{fits} only",
        backward_error=error,
        warnings=(*found.warnings, size),
        worst_entries=worst,
        worst_misfits=misfits,
    )
