"""What the lengths of a surface are worth: whether they fit, whether others do, and what shows a Laplacian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from ..certificate import Findings, MetricCertificate, chi_square_verdict
from ..linalg.responses import SamplingOptions, noise_blocks
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..tolerances import CERTIFIED, CONFIDENCE, LARGEST_NOISE, PLACED
from ..topology.manifold import Cycles
from ..words import Reason, words_of
from .heron import areas_cotangents, blocks_of, summed
from .mesh import SurfaceMesh
from .program import Normal

READINGS = 16  # as many choices of triangles as are tried one by one
VARYING = (
    "that the coefficient is constant is assumed, and the matrix does not show it: with a coefficient of its own in "
    "each triangle, surfaces of other lengths have the same entries"
)


@dataclass(frozen=True, eq=False)
class Found:
    """A surface with lengths, in the numbering of the matrix."""

    mesh: SurfaceMesh
    squared: NDArray[np.float64]
    scale: NDArray[np.float64]
    certificate: MetricCertificate
    failures: tuple[str, ...]
    sums: dict[str, float] | None = None

    @property
    def fits(self) -> bool:
        """Whether every entry is given back."""
        held = self.certificate.entries
        return not self.failures and held.backward_error <= CERTIFIED and not len(held.flipped)

    @property
    def constant(self) -> bool:
        """Whether something beside the lengths shows that the coefficient is constant.

        There are as many lengths as entries, so that with a coefficient of its own in each triangle nearly any entries
        are those of some surface, whose rows sum to zero as well. But then its vertices inside are not flat, nor are
        row sums in proportion to the areas that the lengths give.
        """
        if self.certificate.diagonal == "areas":
            return True
        inside = np.ones(self.mesh.n, dtype=bool)
        inside[self.mesh.edges[self.mesh.boundary]] = False
        curvature = self.mesh.curvature(self.squared)
        flat = inside & (np.abs(curvature) <= PLACED)
        checked = np.unique(self.mesh.piece[flat[self.mesh.triangles].any(axis=1)])
        return bool((flat == (inside & np.isfinite(curvature))).all() and len(checked) == self.mesh.n_pieces)

    def without_last(self, gone: int) -> Found:
        """What is left without the last vertices, none of which are neighbours."""
        mesh, n = self.mesh, self.mesh.n - gone
        kept = (mesh.edges < n).all(axis=1)
        rows = (mesh.triangles < n).all(axis=1)
        place = np.cumsum(kept) - 1
        left = SurfaceMesh.of(Cycles(n, mesh.edges[kept], mesh.triangles[rows], place[mesh.opposite[rows]]))
        length = np.sqrt(self.squared[kept])
        piece = left.piece_of_edge
        mean = np.bincount(piece, length) / np.bincount(piece)
        return replace(self, mesh=left, squared=(length / mean[piece]) ** 2)


def findings(
    found: Found, fitting: int, readings: int, solid: NDArray, options: ScalarOptions, n_cycles: int
) -> Findings:
    """Certified is a surface whose matrix is the given one, diagonal or known scale included, and the only one.

    There are as many edges as unknown lengths and scale: nearly every matrix with such a graph belongs to some surface.
    That this one is a Laplacian has to show elsewhere: in rows that sum to zero, or as a multiple of the identity or of
    a lumped mass matrix makes them; or in a scale that was given. Rows next to others that were taken out do not.
    """
    fits = "the lengths give every entry back, and no others do on these triangles"
    about = Findings(fits=(fits,), error=found.certificate.entries.backward_error, unique="searched")
    against = tuple(_misfits(found, options))
    if against:
        return replace(about, objections=against)
    if n_cycles == len(found.mesh.triangles) and (options.scale is not None or found.constant):
        about = replace(about, unique="proved")
    bare = np.bincount(found.mesh.piece_of_edge, ~solid) == 0
    if bare.any():
        row = int(found.mesh.triangles[found.mesh.piece == np.argmax(bare)].min())
        reason = f"in the piece of row {row} every edge belongs to four rows that are all coupled, as in a solid"
        return replace(about, another=Reason(f"{reason}: tetrahedra fit as well"))
    if fitting > 1 or readings > READINGS:
        return replace(about, another=Reason("other choices of triangles have lengths that fit as well"))
    shown, against = _laplacian(found, fits, options)
    return replace(about, fits=(fits, shown), objections=against)


def _misfits(found: Found, options: ScalarOptions) -> Iterator[Reason]:
    """Why lengths do not give the entries back."""
    held = found.certificate.entries
    if found.failures:
        yield Reason(found.failures[0])
    elif len(held.flipped):
        triangle = found.mesh.triangles[held.flipped[0]]
        yield Reason(f"the sides of the triangle of rows {words_of(triangle)} do not meet")
    elif not found.fits:
        i, j = held.pairs[np.argmax(held.misfits)]
        known = "" if options.scale is None else f" with c = {options.scale:g}"
        much = f"up to {held.backward_error:.1e} (relative) only, worst in rows {i} and {j}"
        yield Reason(f"lengths{known} give the entries back {much}")


def _laplacian(found: Found, fits: str, options: ScalarOptions) -> tuple[str, tuple[Reason, ...]]:
    """What shows that this is a Laplacian; and what speaks against it, where nothing does."""
    if options.noise is not None:
        return _with_noise(found, options.noise, options.scale)
    if options.scale is not None:
        return "the scale is the given one", ()
    off = found.certificate.row_misfits > CERTIFIED
    inside = np.bincount(found.mesh.edges[found.mesh.boundary].ravel(), minlength=found.mesh.n) == 0
    if not off.any() and (found.certificate.diagonal == "zero" or inside.any()):
        return _SUMS[found.certificate.diagonal], ()
    row = int(np.argmax(off))
    reason = (
        f"{fits}, but there are as many unknowns as entries, and that this is a surface with all its rows does not "
        f"show: rows do not sum to zero, row {row} for one"
    )
    return "", (Reason(reason, "a known scale would tell"),)


def _with_noise(found: Found, sigma: float, scale: float | None) -> tuple[str, tuple[Reason, ...]]:
    """Lengths fit noisy entries as well as exact ones: what is tested is the row sums, or the scale."""
    if sigma > LARGEST_NOISE * np.abs(found.scale).min():
        return "", (Reason("the noise is too large: angles are known to no more than a few degrees"),)
    if scale is not None:
        error = [sigma * scale_deviation(found.squared[rows], place) for rows, place in found.mesh.pieces()]
        off = float((np.abs(found.scale - scale) / error).max())
        if 2 * ndtr(-off) >= CONFIDENCE:
            return "the scale is the given one up to noise", ()
        return "", (Reason(f"the entries tell another scale, off by {off:.1f} standard deviations"),)
    test = found.sums or {}
    if min(test["p_value"], test["largest_p_value"]) >= CONFIDENCE:
        return "rows sum to zero up to noise", ()
    return "", (Reason("rows do not sum to zero, by more than noise, and no entries are to spare"),)


_SUMS = {
    "zero": "rows sum to zero",
    "constant": "rows sum to one number",
    "areas": "rows sum to a multiple of the areas about their vertices",
}


def row_sum_test(matrix: OperatorMatrix, sigma: float) -> dict[str, float]:
    """Whether rows sum to zero but for errors of standard deviation `sigma` in the entries, the diagonal's included.

    The sums of rows with k and l entries have the correlation 1 / sqrt(k l) if these share one: of as many sums, the
    squares vary as those of tr(R^2) / n times fewer independent ones (Satterthwaite).
    """
    count = np.bincount(matrix.edges.ravel(), minlength=matrix.n) + 1
    used = count > 1
    shared = 2 * float((1 / count[matrix.edges].prod(axis=1)).sum())
    return chi_square_verdict(
        (matrix.row_sums / (sigma * np.sqrt(count)))[used],
        int(used.sum()),
        sigma,
        repeats=1 + shared / float(used.sum()),
    )


def scale_deviation(squared: NDArray, opposite: NDArray) -> float:
    """Standard deviation of c for errors of standard deviation 1 in the entries: |u| / F(u)."""
    area, _ = areas_cotangents(squared[opposite])
    return float(np.linalg.norm(squared) / (2 * area.sum()))


def length_deviations(
    squared: NDArray, opposite: NDArray, options: SamplingOptions | None = None
) -> NDArray[np.float64]:
    """Standard deviations (e,) of edge lengths of mean 1, for errors of standard deviation 1 in the weights A_ij / c.

    Of one piece, from the squared lengths (e,) and the edge that faces each corner (m, 3).

    With F twice the area and w = F', errors a in the weights change u by the solution d of F'' d = a - w (a.u) / (w.u),
    which fixes the change of c, and lengths by d / 2 l, without a change of their mean.
    """
    sides = squared[opposite]
    area, cotangents = areas_cotangents(sides)
    weights = summed(opposite, cotangents / 2, len(squared))
    ones = np.ones(len(area))
    normal = Normal(opposite, len(squared))
    factor = normal.factorised(2 * blocks_of(sides, area, cotangents, ones, -ones), 1e-10)
    length = np.sqrt(squared)
    total = np.zeros(len(squared))
    for noise in noise_blocks(len(squared), options or SamplingOptions()):
        told = noise - weights[:, None] * (squared @ noise) / (weights @ squared)
        change = factor.solve(told * squared[:, None]) * (length / 2)[:, None]
        change -= length[:, None] * change.mean(axis=0) / length.mean()
        total += (change**2).sum(axis=1)
    return np.sqrt(total)
