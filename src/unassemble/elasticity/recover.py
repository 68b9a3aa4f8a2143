"""Coordinates from an elasticity matrix, and nothing else: the whole room on one page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError, MatrixError
from .atlas import NullFields, null_fields
from .cells import Cells, no_cells, recognise_cells
from .certificate import largest_residual
from .material import poisson_ratio
from .modes import rigid_body_modes
from .nodal import NodalMatrix, nodal_matrix, uncoupled, valid_pairs
from .shape import Shape, in_gauge, shape
from .unknowns import Numbering, find_numbering

CERTIFIED = 1e-9


@dataclass(frozen=True)
class Evidence:
    """How uniquely the matrix determines a piece.

    Attributes
    ----------
    null_dimension : int
        Independent fields that satisfy all valid identities, nodes that stay loose left out. 4 in space, 3 in the plane: translations and scale.
    residual : float
        Singular value of the coordinates: norm of the residual over the norm of the centred field.
    gap : float
        Singular value of the best field that is none of these; an upper bound on large bodies.
    rows : int
        Nodes with valid identities.
    """

    null_dimension: int
    residual: float
    gap: float
    rows: int


@dataclass(frozen=True, eq=False)
class ElasticityRecovery:
    """Nodes and directions of a vector-valued matrix, and their positions.

    Attributes
    ----------
    points : (n, d) float64
        Row i belongs to node i; NaN where the matrix does not determine it. Axes are those of the matrix; per piece the
        centroid is the origin and the mean edge length of the graph 1. The sign (a point reflection) is free.
    node_of_row, direction_of_row : (N,) int64
    node_status : (n,) int8
        0 determined, 1 not.
    component : (n,) int64
        Piece of each node, -1 for nodes without one.
    evidence : tuple of Evidence
        One per piece.
    poisson_ratio : float or None
        Where it is one number; plane strain in the plane.
    cells : Cells
        Elements, where they are recognised.
    backward_error : float
        Largest residual of a valid identity; or of the re-assembled matrix where `cells` hold.
    status : {"certified", "uncertified"}
    reason : str
    numbering : str
        How the unknowns are numbered: ``"interleaved"``, ``"by component"`` or ``"pattern"``.
    warnings : tuple of str
    timings : mapping of str to float
        Seconds by stage.
    """

    points: NDArray[np.float64]
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    node_status: NDArray[np.int8]
    component: NDArray[np.int64]
    evidence: tuple[Evidence, ...]
    poisson_ratio: float | None
    cells: Cells
    backward_error: float
    status: str
    reason: str
    numbering: str
    warnings: tuple[str, ...] = ()
    timings: Mapping[str, float] = field(default_factory=dict)

    @property
    def certified(self) -> bool:
        """Whether the coordinates satisfy the matrix to rounding, and nothing else does."""
        return self.status == "certified"

    def rigid_body_modes(self) -> NDArray[np.float64]:
        """(N, 3) or (N, 6) near-null space in PyAMG's layout; see :func:`.modes.rigid_body_modes`."""
        return rigid_body_modes(self.points, self.node_of_row, self.direction_of_row)


@dataclass(frozen=True, eq=False)
class ScalarParts:
    """A vector-valued matrix whose directions do not know of each other.

    Attributes
    ----------
    matrices : tuple of (n_k, n_k) sparse
        One scalar matrix per direction, over the nodes that have that direction.
    nodes : tuple of (n_k,) int64
        Node of each row of these matrices.
    numbering : Numbering
    """

    matrices: tuple[sp.csr_array, ...]
    nodes: tuple[NDArray[np.int64], ...]
    numbering: Numbering


def scalar_parts(matrix: sp.csr_array, *, block_size: int | None = None) -> ScalarParts | None:
    """Take a vector Laplacian apart; None for matrices that couple directions or have no nodes of several unknowns."""
    numbering = find_numbering(sp.csr_array(matrix), block_size)
    nodal = nodal_matrix(sp.csr_array(matrix), numbering)
    if not uncoupled(nodal):
        return None
    nodes = tuple(np.flatnonzero(nodal.row_of[:, a] >= 0) for a in range(nodal.dim))
    rows = [nodal.row_of[here, a] for a, here in enumerate(nodes)]
    return ScalarParts(tuple(sp.csr_array(matrix)[r][:, r] for r in rows), nodes, numbering)


def recover_elasticity(
    matrix: sp.csr_array,
    *,
    block_size: int | None = None,
    numbering: Numbering | None = None,
    cells: bool = True,
    patch: int | None = None,
) -> ElasticityRecovery:
    """Recover node positions from the stiffness matrix of isotropic linear elasticity.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric; unknowns may be eliminated, replaced by identity rows, or penalised.
    block_size : int, optional
        2 or 3; found where it is not given.
    numbering : Numbering, optional
        Where it is known; see :func:`.unknowns.given_numbering`.
    cells : bool
        Look for elements too.
    patch : int, optional
        Most nodes per chart; see :mod:`.atlas`.

    Raises
    ------
    MatrixError
        If the matrix is not symmetric.
    RecoveryError
        If it is no elasticity matrix, or determines nothing.
    """
    clock = _Clock()
    matrix = sp.csr_array(matrix, dtype=np.float64)
    _check(matrix)
    numbering = numbering or find_numbering(matrix, block_size)
    nodal = nodal_matrix(matrix, numbering)
    if uncoupled(nodal):
        raise GeometryError(
            "the directions are not coupled: these are scalar matrices side by side; recover one of them by itself"
        )
    clock.lap("numbering")
    solution = _solve(nodal, patch)
    clock.lap("null space")
    return _describe(nodal, numbering, solution, clock, cells)


@dataclass(frozen=True, eq=False)
class _Solution:
    valid: NDArray[np.bool_]
    component: NDArray[np.int64]
    points: NDArray[np.float64]
    evidence: tuple[Evidence, ...]
    freedoms: tuple[str, ...]
    exact: bool
    warnings: tuple[str, ...]
    ratio: float | None = None
    strict: bool = True

    @property
    def whole(self) -> bool:
        """Whether every node is determined, up to translation and scale of its piece."""
        return self.exact and not any(self.freedoms) and bool(np.isfinite(self.points).all())

    @property
    def rank(self) -> tuple[bool, bool, int]:
        """For comparison of solutions: exact, unique, and how many coordinates are determined."""
        return self.exact, not any(self.freedoms), int(np.isfinite(self.points).sum())


def _solve(nodal: NodalMatrix, patch: int | None) -> _Solution:
    """Read validity strictly, and only where that determines nothing leniently."""
    best: _Solution | None = None
    failure: GeometryError | None = None
    for strict in (True, False):
        valid = valid_pairs(nodal, strict=strict)
        try:
            found = _positions(nodal, valid, patch)
            found = replace(_with_ratio(nodal, found, patch), strict=strict)
        except GeometryError as error:
            failure = failure or error
            continue
        if found.exact and not any(found.freedoms):
            return found
        best = best or found
    if best is None:
        raise failure or GeometryError("no positions fit the valid rows")
    return best


def _with_ratio(nodal: NodalMatrix, found: _Solution, patch: int | None) -> _Solution:
    """Once more with Poisson's ratio, if it is one number and nodes were left loose."""
    if found.whole or not found.exact:
        return found
    nu = poisson_ratio(nodal, found.valid, found.points)
    if nu is None:
        return found
    try:
        other = _positions(nodal, found.valid, patch, 2 * nu / (1 - 2 * nu))
    except GeometryError:
        return found
    return other if other.rank > found.rank else found


def _positions(
    nodal: NodalMatrix, valid: NDArray[np.bool_], patch: int | None, ratio: float | None = None
) -> _Solution:
    """Positions piece by piece."""
    component, n_pieces = _pieces(nodal, valid)
    graph = sp.csr_array((np.ones(len(nodal.indices)), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    points = np.full((nodal.n, nodal.dim), np.nan)
    evidence, freedoms, exact, warnings = [], [], [], []
    failure: GeometryError | None = None
    for piece in range(n_pieces):
        body = np.flatnonzero(component == piece)
        found = null_fields(nodal, valid, body, patch=patch, ratio=ratio)
        try:
            one = shape(found.fields, found.values)
        except GeometryError as error:
            failure = failure or error
            warnings.append(f"piece {piece} with node {body[0]}: {error}")
            evidence.append(Evidence(int((found.values < CERTIFIED).sum()), float("nan"), float("nan"), found.rows))
            continue
        points[found.nodes] = one.points
        points[body] = in_gauge(points[body], graph[body][:, body])
        evidence.append(_evidence(found, one))
        freedoms.append(one.freedom)
        exact.append(one.exact)
    if not exact:
        raise failure or GeometryError("no row annihilates constants: no node has a valid equation")
    component = np.where(np.isfinite(points).all(axis=1), component, -1)
    return _Solution(
        valid, component, points, tuple(evidence), tuple(freedoms), all(exact), tuple(warnings), ratio
    )


def _pieces(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> tuple[NDArray[np.int64], int]:
    """Pieces held together by valid identities; -1 for nodes that none of them touches."""
    live = (np.abs(nodal.data) * valid[nodal.node]).max(axis=(1, 2)) > 0
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    _, label = sp.csgraph.connected_components(link, directed=False)
    size = np.bincount(label)
    kept = np.flatnonzero(size > 1)
    order = np.full(len(size), -1)
    order[kept] = np.arange(len(kept))
    return order[label].astype(np.int64), len(kept)


def _evidence(found: NullFields, one: Shape) -> Evidence:
    d = found.fields.shape[1]
    null = max(int((found.values <= CERTIFIED).sum()), d + 1)
    gap = float(found.values[null]) if null < len(found.values) else float("inf")
    return Evidence(one.dimension, float(found.values[d]), gap, found.rows)


def _describe(
    nodal: NodalMatrix, numbering: Numbering, solution: _Solution, clock: _Clock, want_cells: bool
) -> ElasticityRecovery:
    """Certificate, material, cells and the sentences that go with them."""
    points = solution.points
    error = largest_residual(nodal, solution.valid, points, solution.ratio)
    ratio = poisson_ratio(nodal, solution.valid, points) if error < 1e-6 else None
    clock.lap("certificate")
    found = recognise_cells(nodal, points) if want_cells and error < 1e-6 else no_cells(nodal.dim)
    clock.lap("cells")
    backward = found.backward_error if found.recognised else error
    status, reason = _verdict(solution, error, found)
    loose = ~np.isfinite(points).all(axis=1)
    warnings = list(solution.warnings)
    if loose.any():
        warnings.append(f"{loose.sum()} of {nodal.n} nodes are tied to eliminated unknowns only and stay undetermined")
    if solution.ratio is not None:
        warnings.append("Poisson's ratio, read off the nodes that determine it, was used to determine others")
    return ElasticityRecovery(
        points, numbering.node_of_row, numbering.direction_of_row, loose.astype(np.int8), solution.component,
        solution.evidence, ratio, found, backward, status, reason, numbering.kind, tuple(warnings), clock.seconds,
    )  # fmt: skip


_FREEDOMS = {
    "axes": "each axis keeps a scale of its own",
    "affine": "an affine map stays free, since the material around every valid row is homogeneous",
}


def _verdict(solution: _Solution, error: float, found: Cells) -> tuple[str, str]:
    remaining = [_FREEDOMS[name] for name in solution.freedoms if name]
    if remaining:
        return "uncertified", f"the null space is larger than it should be: {remaining[0]}"
    if not solution.exact:
        worst = max(one.residual for one in solution.evidence)
        return "uncertified", (
            f"no exact null vector exists (singular value {worst:.1e}); the points are the best fit, as for materials "
            "that are not isotropic, or elements that do not reproduce linear functions"
        )
    if not solution.strict:
        return "uncertified", (
            "supports leave too few rows that are surely whole; rows whose entries add up to zero were taken for whole, "
            "which they need not be"
        )
    if found.recognised and found.backward_error <= CERTIFIED:
        return "certified", f"the matrix re-assembled on the {found.n_cells} elements is the given one"
    if error <= CERTIFIED:
        return "certified", "the valid identities hold to rounding, and only translations and scale satisfy them"
    return "uncertified", f"the largest residual of a valid identity is {error:.1e}"


def _check(matrix: sp.csr_array) -> None:
    if matrix.shape[0] != matrix.shape[1]:
        raise MatrixError(f"the matrix has {matrix.shape[0]} rows and {matrix.shape[1]} columns; it must be square")
    if not np.isfinite(matrix.data).all():
        raise MatrixError("the matrix has entries that are not finite")
    off = abs(matrix - matrix.T)
    scale = abs(matrix).max(axis=1).toarray().ravel()
    worst = off.tocoo()
    bad = np.flatnonzero(worst.data > 1e-8 * scale[worst.row])
    if len(bad):
        at = bad[0]
        raise MatrixError(f"entry ({worst.row[at]}, {worst.col[at]}) differs from its transpose's; it must be symmetric")


class _Clock:
    """Seconds by stage."""

    def __init__(self):
        self.seconds: dict[str, float] = {}
        self._last = perf_counter()

    def lap(self, name: str) -> None:
        now = perf_counter()
        self.seconds[name] = now - self._last
        self._last = now
