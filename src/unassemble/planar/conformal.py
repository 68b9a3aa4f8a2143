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

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError
from ..tolerances import ALIKE, ROUNDED, SUMMED
from ..topology import Piece
from ..topology.keys import runs
from .pencil import ConformalPencil, ShiftedSearch

_log = logging.getLogger(__name__)


_STEPS = 8  # most solves with one factorisation
_MARGIN = 1e-11  # distance of the last shift below c, relative; nearer, M would be singular to working accuracy


@dataclass(frozen=True, eq=False)
class ConformalMap:
    """Result of :func:`conformal_map`."""

    z: NDArray[np.complex128]  # (n,) positions x + iy, in no particular gauge
    scale: float  # c, with its sign
    # what it cost
    factorisations: int
    solves: int
    converged: bool  # whether position changes fell to the level that the conditioning allows


def estimate_scale(piece: Piece, weights: NDArray) -> float:
    """A guess of c.

    The halves g = cot / 2 of a triangle's three weights satisfy g1 g2 + g2 g3 + g3 g1 = 1/4. Sharing
    each weight equally between its two triangles gives one value of c from each triangle; the median is right to some
    ten per cent on meshes of decent triangles. Raises GeometryError if the weights add up to zero.
    """
    sign = np.sign(weights.sum())
    if not sign:
        raise GeometryError("the off-diagonal entries add up to zero, those of a Laplacian cannot")
    largest = float(np.abs(weights).max())  # taken out, so that no square overflows
    a, b, c = (weights / largest / np.where(piece.inner, 2, 1))[piece.opposite].T
    form = a * b + b * c + c * a
    sizes = 2 * np.sqrt(form[form > 0])  # of triangles of which the three shares belong to a triangle at all
    size = np.median(sizes) if len(sizes) else np.sqrt(3) * np.abs(weights / largest).mean()
    return float(sign * size * largest)


def conformal_map(
    piece: Piece,
    weights: NDArray,
    *,
    scale: float | None = None,
    unit: float | None = None,
    sharp: bool = True,
    first_shift: float = 0.7,
    most: int = 8,
) -> ConformalMap:
    """Positions and scale of one piece.

    `weights` (e,): -A_ij = c w_ij of each edge; `scale`: c, where it is known. Otherwise c = 1 is tried first if the
    median of what triangles say allows it. `unit`: a guess of c, where weights are not those of the piece's triangles;
    c = 1 is then tried once that is near. `sharp`: go on until z, not only c, has converged, which a polish does not
    need. `first_shift`: relative to the guess of c, well inside (0, 1) or 0; `most`: factorisations before giving up.

    Raises GeometryError if no map of positive area is found.
    """
    likely, whole = None, 1 / unit if unit else np.inf
    if unit is None:
        unit = estimate_scale(piece, weights)
        likely = 1.0 if abs(unit - 1) < 0.3 * unit else None
    with np.errstate(over="ignore"):
        relative = weights / unit if unit else np.full_like(weights, np.inf)
    if not np.abs(relative).max() < 1 / ROUNDED or (scale is not None and not ALIKE < abs(scale / unit) < 1 / ALIKE):
        raise GeometryError(
            "the entries of a piece, or they and the given scale, differ by so many orders of magnitude "
            "that no triangles could have them"
        )
    sums = np.bincount(piece.edges.ravel(), np.repeat(relative, 2), piece.n_vertices)
    if not (sums > SUMMED).all():  # at a corner the sum is half its angle
        # The energy of a hat function; without it the pencil may be singular, which PARDISO does not survive.
        row = int(piece.vertices[np.argmin(sums)])
        raise GeometryError(f"the entries do not make a positive energy in row {row}: they belong to no planar mesh")
    pencil = ConformalPencil(piece.n_vertices, piece.edges, piece.boundary, relative)
    search = ShiftedSearch(pencil, _STEPS)
    z = start = _smooth_start(piece)
    known = scale if scale is not None else likely
    spread = None
    if known is not None:
        z, c, _ = search.at(known / unit * (1 - _MARGIN), z, steps=2)
        # The quotient is stationary, and accurate to some hundred roundings at any size.
        if scale is not None or abs(c * unit / known - 1) < 1e-13:
            z = search.corrected(z, c)
            return ConformalMap(z, known, search.factorisations, search.solves, True)
        spread = 1e-2 if c * unit / known > 1 else None  # beyond c the quotients tell nothing
    if spread is None:
        z, c, spread = search.at(first_shift, start)
        if c < ALIKE:
            raise GeometryError("some maps of positive area have no energy: the entries belong to no planar mesh")
    converged = near = False
    while search.factorisations < most:
        distance = min(max(4 * spread, _MARGIN), 0.3)
        one = abs(c / whole - 1) <= distance
        z, c, spread = search.at(whole * (1 - _MARGIN) if one else c * (1 - distance), z)
        near, whole = one or distance <= 1e-9, np.inf if one else whole
        converged = (near or (distance <= 1e-5 and not sharp)) and spread < 1e-12
        if converged:
            break
    if near:
        z = search.corrected(z, c)
    _log.debug("scale %.16g after %d factorisations", c * unit, search.factorisations)
    return ConformalMap(z, float(c * unit), search.factorisations, search.solves, converged)


def _smooth_start(piece: Piece) -> NDArray[np.complex128]:
    """An ellipse on each boundary loop, smooth and of positive area, and a little noise everywhere.

    An ellipse has both senses of rotation: which one belongs to the mesh depends on whether the loop is the outer one
    or a hole. Without the ellipses on other loops than the longest, the inversion of a ring would hide the ring from
    the Krylov space. The noise breaks symmetries that would hide the answer from every such space.
    """
    z = 0.01 * np.random.default_rng(0).standard_normal((piece.n_vertices, 2)).view(np.complex128).ravel()
    length = np.diff(piece.loop_offsets)
    loop, place = runs(length)
    angle, size = 2 * np.pi * place / length[loop], (length / length.max())[loop]
    np.add.at(z, piece.boundary[:, 0], size * (np.exp(1j * angle) + 0.5 * np.exp(-1j * angle)))
    return z
