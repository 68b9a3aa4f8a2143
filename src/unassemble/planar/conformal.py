"""Positions and scale of a planar piece from one sparse eigenproblem (theory: conformal energy).

The scale c is the least value of E(z) / a(z) over maps of positive area, and the mesh is the map
that attains it: the extreme eigenpair of the pencil (c L / 2, T). Holomorphic maps of the mesh come
close: their quotients exceed c by O(1/n) relatively. So the search has two parts. From a distance
all of the cluster looks alike, and a few Krylov steps give c to O(1/n); with the shift moved
to just below that, the cluster comes apart, and a few more steps give c and z to working accuracy.
The pattern is ordered once for all shifts.

References
----------
Levy, Petitjean, Ray, Maillot, "Least squares conformal maps", ACM TOG 21, 2002.
Mullen, Tong, Alliez, Desbrun, "Spectral conformal parameterization", CGF 27, 2008.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..errors import GeometryError
from ..linalg import Factorisation, factorisation
from ..topology import Piece
from .pencil import ConformalPencil

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ConformalOptions:
    """Settings of the search; the defaults serve every matrix that we know.

    Attributes
    ----------
    krylov_steps : int
        Most solves with one factorisation.
    max_factorisations : int
        Factorisations before giving up.
    first_shift : float
        Relative to the estimate of c; any value well inside (0, 1) will do.
    margin : float
        Distance of the last shift below c, relative. Nearer, M would be singular to working accuracy.
    """

    krylov_steps: int = 8
    max_factorisations: int = 8
    first_shift: float = 0.7
    margin: float = 1e-11


@dataclass(frozen=True, eq=False)
class ConformalMap:
    """Result of :func:`conformal_map`.

    Attributes
    ----------
    z : (n,) complex128
        Positions x + iy, in no particular gauge.
    scale : float
        c, with its sign.
    factorisations, solves : int
        What it cost.
    converged : bool
        Whether position changes fell to the level that the conditioning allows.
    """

    z: NDArray[np.complex128]
    scale: float
    factorisations: int
    solves: int
    converged: bool


def estimate_scale(piece: Piece, weights: NDArray) -> float:
    """A guess of c, right to some ten per cent on meshes of decent triangles.

    The halves g = cot / 2 of a triangle's three weights satisfy g1 g2 + g2 g3 + g3 g1 = 1/4. Sharing
    each weight equally between its two triangles gives one value of c from each triangle; the median counts.

    Raises
    ------
    GeometryError
        If the weights add up to zero.
    """
    sign = np.sign(weights.sum())
    if not sign:
        raise GeometryError("the off-diagonal entries add up to zero, those of a Laplacian cannot")
    largest = float(np.abs(weights).max())  # taken out, so that no square overflows
    share = weights / largest / np.where(piece.facing[:, 1] >= 0, 2, 1)
    a, b, c = share[piece.opposite].T
    form = a * b + b * c + c * a
    form = form[form > 0]
    size = 2 * np.sqrt(np.median(form)) if len(form) else np.sqrt(3) * np.abs(weights / largest).mean()
    return float(sign * size * largest)


def conformal_map(
    piece: Piece,
    weights: NDArray,
    *,
    scale: float | None = None,
    sharp: bool = True,
    options: ConformalOptions | None = None,
) -> ConformalMap:
    """Positions and scale of one piece.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij = c w_ij of each edge.
    scale : float, optional
        c, where it is known. Otherwise c = 1 is tried first if the estimate allows it.
    sharp : bool
        Go on until z, not only c, has converged. A polish does not need that.
    options : ConformalOptions, optional

    Raises
    ------
    GeometryError
        If no map of positive area is found.
    """
    options = options or ConformalOptions()
    unit = estimate_scale(piece, weights)
    with np.errstate(over="ignore"):
        relative = weights / unit if unit else np.full_like(weights, np.inf)
    if not np.isfinite(relative).all() or (scale is not None and not 1e-6 < abs(scale / unit) < 1e6):
        raise GeometryError(
            "the entries of a piece, or they and the given scale, differ by so many orders of magnitude "
            "that no triangles could have them"
        )
    search = _Search(ConformalPencil(piece, relative), options)
    z = _smooth_start(piece)
    known = scale if scale is not None else 1.0
    if scale is not None or abs(known / unit - 1) < 0.3:
        z, c, _ = search.near(known / unit, z)
        # The quotient is stationary, and accurate to some hundred roundings at any size.
        if scale is not None or abs(c * unit / known - 1) < 1e-13:
            return ConformalMap(z, known, search.factorisations, search.solves, True)
        spread = 1e-2 if c * unit / known > 1 else None  # beyond c the quotients tell nothing
    else:
        spread = None
    if spread is None:
        z, c, spread = search.at(options.first_shift, _smooth_start(piece))
    converged = False
    while search.factorisations < options.max_factorisations:
        distance = min(max(4 * spread, options.margin), 0.3)
        z, c, spread = search.at(c * (1 - distance), z)
        converged = distance <= (1e-9 if sharp else 1e-5) and spread < 1e-12
        if converged:
            break
    _log.debug("scale %.16g after %d factorisations, %d solves", c * unit, search.factorisations, search.solves)
    return ConformalMap(z, float(c * unit), search.factorisations, search.solves, converged)


class _Search:
    """Shift-and-invert Krylov steps on the pencil, in units in which c is near 1."""

    def __init__(self, pencil: ConformalPencil, options: ConformalOptions):
        self._pencil = pencil
        self._options = options
        self._factor: Factorisation | None = None
        self.factorisations = 0
        self.solves = 0

    def near(self, scale: float, z: NDArray) -> tuple[NDArray, float, float]:
        """From a shift just below a value that may be c itself."""
        return self.at(scale * (1 - self._options.margin), z, steps=2)

    def at(self, shift: float, z: NDArray, steps: int | None = None) -> tuple[NDArray, float, float]:
        """Rayleigh-Ritz over the Krylov space of M(shift)^-1 T from z.

        Returns
        -------
        z : (n,) complex128
        c : float
        spread : float
            Relative change of c in the last step.
        """
        matrix = self._pencil.matrix(shift)
        factor = self._factor = self._factor or factorisation(matrix)
        factor.factorise(matrix)
        self.factorisations += 1
        basis: list[NDArray] = []
        energy_images: list[NDArray] = []
        area_images: list[NDArray] = []
        c, spread = np.inf, 1.0
        for _ in range(steps or self._options.krylov_steps):
            z = np.append(factor.solve(self._pencil.area_form(z)[:-1]), 0)
            self.solves += 1
            size = np.linalg.norm(z)
            for _ in range(2):
                for u in basis:
                    z = z - np.vdot(u, z) * u
            left = np.linalg.norm(z)
            if not left > 1e-13 * size:  # the space is invariant
                spread = 0.0
                break
            z = z / left
            basis.append(z)
            energy_images.append(self._pencil.energy_form(z))
            area_images.append(self._pencil.area_form(z))
            previous, (c, y) = c, _ritz(basis, energy_images, area_images)
            spread = abs(previous / c - 1) if np.isfinite(previous) else 1.0
            if spread < 1e-15:
                break
        if not basis:
            raise GeometryError("no map has positive area: the entries, or the given scale, fit no mesh on this graph")
        z = sum(coefficient * u for coefficient, u in zip(y, basis, strict=True))
        _log.debug("shift %.12g: c = %.16g, last change %.1e", shift, c, spread)
        return z, c, spread


def _ritz(basis: list[NDArray], energy_images: list[NDArray], area_images: list[NDArray]) -> tuple[float, NDArray]:
    """Least quotient energy / area, over positive areas, in the span of a basis."""
    w = np.array(basis)
    energy = w.conj() @ np.array(energy_images).T
    area = w.conj() @ np.array(area_images).T
    # With its indefinite side on the left the pencil is regular: 1/c is the greatest eigenvalue.
    try:
        inverse, vectors = scipy.linalg.eigh((area + area.conj().T) / 2, (energy + energy.conj().T) / 2)
    except (np.linalg.LinAlgError, ValueError) as error:
        # Not positive definite, or not even finite: the Dirichlet energy of a mesh is neither.
        raise GeometryError("the entries do not make a positive energy: they belong to no planar mesh") from error
    if inverse[-1] <= 0:
        raise GeometryError("no map has positive area: the entries, or the given scale, fit no mesh on this graph")
    return float(1 / inverse[-1]), vectors[:, -1]


def _smooth_start(piece: Piece) -> NDArray:
    """An ellipse on each boundary loop, smooth and of positive area, and a little noise everywhere.

    An ellipse has both senses of rotation: which one belongs to the mesh depends on whether the loop is the outer one
    or a hole. Without the ellipses on other loops than the longest, the inversion of a ring would hide the ring from
    the Krylov space. The noise breaks symmetries that would hide the answer from every such space.
    """
    z = 0.01 * np.random.default_rng(0).standard_normal((piece.n_vertices, 2)).view(np.complex128).ravel()
    length = np.diff(piece.loop_offsets)
    place = np.arange(len(piece.boundary)) - np.repeat(piece.loop_offsets[:-1], length)
    angle = 2 * np.pi * place / np.repeat(length, length)
    size = np.repeat(length / length.max(), length)
    np.add.at(z, piece.boundary[:, 0], size * (np.exp(1j * angle) + 0.5 * np.exp(-1j * angle)))
    return z
