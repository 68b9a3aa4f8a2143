"""Planar meshes with terms on their boundary: Robin conditions, and flow of a constant field through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .comparison import Certificate, Terms, relative
from .planar import certify_mesh

if TYPE_CHECKING:
    from ..matrix import OperatorMatrix
    from ..recovery import PlanarMesh


@dataclass(frozen=True, eq=False)
class BoundaryCertificate:
    """How well a mesh explains a matrix together with the terms on its boundary."""

    #: Of all entries, those on the diagonal among them.
    entries: Certificate
    #: Edges of the boundary beyond as many as there are factors that they tell apart, one for each loop and two for a
    #: field. Without any, all terms are those of some factors.
    spare: int

    @property
    def backward_error(self) -> float:
        """The largest misfit, relative to the largest off-diagonal entry of its row."""
        return self.entries.backward_error

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, and their misfits."""
        return self.entries.worst(count)


def certify_with_boundary_terms(
    matrix: OperatorMatrix, mesh: PlanarMesh, tensor: tuple[float, float, float] | None = None
) -> BoundaryCertificate:
    """A planar mesh as it is written, with terms on its boundary, compared with all entries of its matrix.

    On a boundary edge ab the terms add m (1/3 1/6; 1/6 1/3) to the rows of a and b. There is one
    factor alpha for each loop, m = alpha |ab|, and half the flux of one constant field (u, v)
    through the edge, m = (u (y_b - y_a) - v (x_b - x_a)) / 2. These factors are fitted here, by
    least squares, to what the operator re-assembled on the mesh leaves of the entries on the
    boundary; nothing is taken from what found the mesh. `tensor` is kxx, kxy and kyy.
    """
    plain = certify_mesh(matrix, mesh, tensor, Terms(matrix.diagonal))
    n, ends = matrix.n, mesh.boundary
    design = _terms_by_factor(mesh.points, ends, mesh.boundary_offsets)
    key = plain.pairs @ [n, 1]  # ascending
    side = np.searchsorted(key, np.sort(ends, axis=1) @ [n, 1])
    own = np.searchsorted(key, ends * (n + 1))  # (b, 2) entries on the diagonal
    added = np.zeros((len(key), design.shape[1]))
    np.add.at(added, side, design / 6)
    for end in own.T:
        np.add.at(added, end, design / 3)
    size = matrix.row_size[plain.pairs].min(axis=1)
    there = added.any(axis=1) & (size > 0) & np.isfinite(plain.differences)
    weight = 1 / size[there]
    factors = np.linalg.lstsq(added[there] * weight[:, None], -plain.differences[there] * weight, rcond=None)[0]
    difference = plain.differences + added @ factors
    misfits = relative(difference, size)
    largest = float(misfits.max(initial=0.0))
    entries = replace(plain, backward_error=largest, misfits=misfits, differences=difference)
    return BoundaryCertificate(entries, len(ends) - int(np.linalg.matrix_rank(design)))


def _terms_by_factor(
    points: NDArray[np.float64], ends: NDArray[np.int64], offsets: Sequence[int] | NDArray[np.int64]
) -> NDArray[np.float64]:
    """(b, loops + 2) the m of each boundary edge for each factor by itself: those of loops, then the field's."""
    along = points[ends[:, 1]] - points[ends[:, 0]]
    loop = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    lengths = np.where(loop[:, None] == np.arange(len(offsets) - 1), np.linalg.norm(along, axis=1)[:, None], 0.0)
    return np.column_stack([lengths, along[:, 1] / 2, -along[:, 0] / 2])
