"""What the misfit says about each candidate: one linear least-squares problem for positions and labels together.

With label s_k of each candidate the weights are w_e = 1/2 sum_k s_k cot_ke. At a solved reading the misfit r is
explained to first order by displacements d of the vertices, a change g of the scale and changes of the labels:

    minimise  | r - J d - g w - B ds |^2 + ridge^2 | ds |^2,        B_ek = 1/2 cot_ke,

each row divided by its weight. Displacements spread the misfit over the mesh, so that the largest
residuals need not surround the wrong cell; the labels that take part in the best explanation do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import SolverError
from ...linalg import solved
from ...planar.cotangent import edge_weights
from ...planar.normal import WeightJacobian, distant_pair
from ...planar.piece import PieceMesh
from ...topology import Piece
from ..candidates.candidates import FEW
from ..reading import FITS, Reading, fans_of

_SUSPECT = 0.3  # change of the label of a lone triangular hole: it was 0.4 or more in all that were tried
_RIDGE = 0.1
_FAR = 1e8
LONGEST = 40  # edges of a face that may be a cell
_STEEPEST = 20.0  # cotangents beyond belong to slivers of a wrong start


@dataclass(frozen=True, eq=False)
class Linear:
    """The misfit of one piece to first order, each row divided by its weight.

    Attributes
    ----------
    chosen : (cells,) bool
        Candidates within the piece.
    misfit : (m,) float64
        r; m edges, then diagonals of candidates that are no cells yet, where it is 0.
    motion : (m, p) sparse
        Of displacements, but for two fixed vertices, and of the scale where c is not known.
    cells : (m, k) sparse
        B of the chosen candidates.
    spread : (m,) float64
        What the rows are divided by.
    pairs : (m', 2) int64
        Vertices of the edges, which come first.
    """

    chosen: NDArray[np.bool_]
    misfit: NDArray[np.float64]
    motion: sp.csr_array
    cells: sp.csr_array
    spread: NDArray[np.float64]
    pairs: NDArray[np.int64]


def explanations(reading: Reading) -> Iterator[Linear]:
    """One for each piece that does not fit and has more weights than coordinates."""
    for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
        overdetermined = piece.redundancy > 0
        if mesh and overdetermined and (reading.misfit[piece.edge_rows] > FITS).any():
            linear = _linear(reading, piece, mesh)
            if linear is not None:
                yield linear


def label_changes(reading: Reading) -> NDArray[np.float64]:
    """(cells,) the change of each label that explains the misfit best; NaN where nothing can be said."""
    changes = np.full(reading.candidates.count, np.nan)
    for linear in explanations(reading):
        columns = sp.hstack([linear.motion, linear.cells]).tocsr()
        n_motion, n_labels = linear.motion.shape[1], linear.cells.shape[1]
        ridge = np.r_[np.zeros(n_motion), np.full(n_labels, _RIDGE**2)]
        normal = (columns.T @ columns + sp.diags_array(ridge)).tocsr()
        solution = solved_normal(normal, columns.T @ linear.misfit)
        if solution is not None:
            changes[linear.chosen] = solution[n_motion:]
    return changes


def entries_are_to_blame(reading: Reading) -> bool:
    """Whether triangles alone do not fit, and none of them is suspected of being a hole: no choice of cells helps."""
    candidates, labels = reading.candidates, reading.labels
    if (
        not reading.pieces
        or candidates.n_vertices < FEW
        or (labels & ((candidates.size > 3) | candidates.corner)).any()
    ):
        return False
    return float(np.nan_to_num(np.abs(label_changes(reading))).max(initial=0.0)) < _SUSPECT


def _linear(reading: Reading, piece: Piece, mesh: PieceMesh) -> Linear | None:
    """None where the mesh is too far off to say anything."""
    candidates = reading.candidates
    local = np.full(candidates.n_vertices, -1)
    local[piece.vertices] = np.arange(piece.n_vertices)
    inside = np.logical_and.reduceat(local[candidates.cells.vertices] >= 0, candidates.cells.offsets[:-1])
    chosen = inside & (candidates.size <= LONGEST)
    z = mesh.z - mesh.z.mean()
    z = z / np.abs(z).max()
    with np.errstate(all="ignore"):
        w = edge_weights(piece, z)
        misfit = reading.weights[piece.edge_rows] / (candidates.scale or mesh.scale) - w
        size = np.abs(w + misfit)
    comparable = _FAR * np.abs(w).max() > size.max(initial=0.0) > 0  # not where c is given and out of all proportion
    if not (np.isfinite(w).all() and np.isfinite(misfit).all() and chosen.any() and comparable):
        return None
    response = _response(reading, piece, z, local, chosen)
    extra = response.shape[0] - len(w)  # diagonals of candidates that are no cells yet
    typical = float(np.median(size[size > 0]))
    spread = np.r_[size + typical, np.full(extra, typical)]
    jacobian = WeightJacobian(piece, z, spread[: len(w)]).matrix.tocsr()
    jacobian.resize(response.shape[0], jacobian.shape[1])
    free = np.ones(2 * piece.n_vertices, dtype=bool)
    pins = distant_pair(z)
    free[np.r_[2 * pins, 2 * pins + 1]] = False
    motion = [jacobian[:, free]]
    if not candidates.scale:
        motion.append(sp.csr_array((np.append(w, np.zeros(extra)) / spread)[:, None]))
    return Linear(
        chosen,
        np.append(misfit, np.zeros(extra)) / spread,
        sp.hstack(motion).tocsr(),
        (sp.diags_array(1 / spread) @ response).tocsr(),
        spread,
        piece.vertices[piece.edges],
    )


def _response(reading: Reading, piece: Piece, z: NDArray, local: NDArray, chosen: NDArray[np.bool_]) -> sp.csr_array:
    """B: half the cotangents of each chosen candidate; further rows for diagonals that the piece does not have."""
    triangles, cell = fans_of(reading.candidates, chosen)
    at = z[local[triangles]]
    u, v = at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at
    product = np.conj(u) * v
    area = np.bincount(cell, product.imag[:, 0], len(chosen))
    with np.errstate(all="ignore"):
        cotangent = product.real / product.imag * np.sign(area)[cell][:, None]
    cotangent = np.clip(np.nan_to_num(cotangent, posinf=_STEEPEST, neginf=-_STEEPEST), -_STEEPEST, _STEEPEST)
    n = len(local)
    ends = triangles[:, [[1, 2], [2, 0], [0, 1]]]
    key = ends.min(axis=2) * n + ends.max(axis=2)
    pairs = piece.vertices[piece.edges]
    known = pairs.min(axis=1) * n + pairs.max(axis=1)
    rest = np.setdiff1d(key, known)
    all_keys = np.concatenate([known, rest])
    order = np.argsort(all_keys)
    row = order[np.searchsorted(all_keys[order], key)]
    number = np.cumsum(chosen) - 1
    return sp.csr_array(
        (cotangent.ravel() / 2, (row.ravel(), np.repeat(number[cell], 3))), shape=(len(all_keys), int(chosen.sum()))
    )


def solved_normal(normal: sp.csr_array, rhs: NDArray) -> NDArray | None:
    """Positive definite solve; None where the factorisation breaks down, as on flat triangles."""
    try:
        return solved(normal, rhs)
    except SolverError:
        return None
