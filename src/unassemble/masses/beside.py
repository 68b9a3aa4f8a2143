"""A mass matrix beside the stiffness matrix: the size of the mesh, or its density.

The stiffness matrix of the plane does not change with the size of the mesh, and that of a body in space only together
with its modulus. The mass matrix int rho phi_i phi_j does: on a mesh t times as large it is t^d times as large. So it
tells rho where the size is known (by anchors), and the size where rho is: 1, as of programs that know no density. It is
assembled here on the mesh as written and held against the matrix as given.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import Terms, certify_body, certify_mesh
from ..elements import KINDS
from ..errors import GeometryError, InputError, MatrixError, RecoveryError
from ..matrix import as_csr, check_matrix, is_file, read_matrix
from ..matrix.digits import Digits
from ..recovery import Body, PlanarMesh, Recovery
from ..tolerances import AGREED, ALIKE, CERTIFIED, HARDLY_ANY, SUMMED
from .cells import mass_matrix, weights_at


def weighed(
    recover: Callable[[Any], Recovery],
    stiffness: Any,
    masses: Any,
    anchors: Sequence[tuple[Any, ...]],
    tensor: tuple[float, float, float] | None = None,
) -> Recovery:
    """The mesh of a stiffness matrix, by `recover`, with its density, or in the size in which the density is 1.

    The mass matrix is consistent, or lumped: each diagonal entry the sum of a row of the consistent one. Of anchors two
    and more tell the size; one stays where it is. `tensor`: (kxx, kxy, kyy) of the stiffness matrix. A mesh that is put
    in another size is held against the stiffness matrix again.

    InputError if the matrices differ in size, MatrixError if one is no square matrix of finite numbers, GeometryError
    if this is not the mass matrix of the mesh with one density, masses of such meshes are not read, or the mesh in its
    size is too far from the origin for its digits, RecoveryError as of `recover`.
    """
    A, given = as_csr(stiffness), read_matrix(masses) if is_file(masses) else masses
    try:
        M = as_csr(given)
    except MatrixError as error:
        raise MatrixError(f"`mass`: {error}") from error
    if A.shape != M.shape:
        sizes = " and ".join(f"{one.shape[0]} by {one.shape[1]}" for one in (A, M))
        raise InputError(f"the matrix and its mass matrix differ in size: they are {sizes}")
    if not (np.isrealobj(M.data) and (M.diagonal() > 0).all()):
        raise GeometryError("`mass` is no mass matrix: not all of its diagonal entries are positive numbers")
    one, other = A.tocoo(), M.tocoo()
    place = np.concatenate([one.row, other.row]), np.concatenate([one.col, other.col])
    found: Recovery | None
    try:  # with zeros for sides of triangles that face right angles, which have an entry in M only
        found = recover(sp.csr_array((np.concatenate([one.data, 0 * other.data]), place), shape=A.shape))
    except RecoveryError:
        found = None
    if found is None or not found.certified:
        found = recover(stiffness)
    if not found.certified:
        note = "the mass matrix was not looked at, for the mesh is not certified"
        return replace(found, warnings=(*found.warnings, note))
    if found.reaction:
        raise GeometryError("the matrix has a mass term of its own: give the stiffness matrix alone beside `mass`")
    lumped = M.count_nonzero() == M.shape[0]
    unit = _assembled(found, lumped).diagonal()
    whole = _whole(A, found) & (unit > 0)  # nodes beside supports may be in no cell
    piece = found.component if found.node_of_row is None else found.component[found.node_of_row]
    own = [whole & (piece == k) for k in range(found.n_components)]
    if not all(rows.any() for rows in own):
        raise GeometryError(
            "in some piece the cells about no node are all determined, so that nothing can be held against `mass`. The "
            "mesh of the stiffness matrix alone is certified"
        )
    factors = np.array([np.median(M.diagonal()[rows] / unit[rows]) for rows in own])
    sized, also = len(anchors) > 1, ""
    if not sized:
        centre = np.array(anchors[0][1:] if anchors else [0.0] * found.dim)[: found.dim]
        first, found = found, _enlarged(found, factors ** (1 / found.dim), centre)
        before, after = (_stiffness_error(A, first, mesh, tensor) for mesh in (first, found))
        if not after <= (CERTIFIED if before <= CERTIFIED else 2 * before):  # of few digits both have errors
            raise _too_far(found)
        if before <= CERTIFIED:
            found = replace(found, backward_error=max(found.backward_error, after))
        also = f", and in this size the stiffness matrix to {after:.1e}" if after else ""
    density = float(factors[0]) if sized else 1.0
    misfit = _misfit(density * _assembled(found, lumped), M, whole)
    off = found.position_error if isinstance(found, Body) else None  # a diameter is no longer than all edges
    allowed = CERTIFIED if found.backward_error <= CERTIFIED else max(ALIKE, (off or 0.0) * found.n_points)
    if not misfit <= allowed:
        if _digits_lost(found):
            raise _too_far(found)
        raise GeometryError(
            f"`mass` is not the mass matrix of this mesh with one density: entries differ by up to {misfit:.1e} of the "
            "diagonals of their rows. The mesh of the stiffness matrix alone is certified"
        )
    said = f"the mass matrix assembled on it again is the one given to {misfit:.1e}"
    said += "" if whole.all() else f", in the {whole.mean():.0%} of its rows all cells of which are determined"
    said += also
    notes = found.warnings
    if not sized:
        root = "sqrt(rho)" if found.dim == 2 else "the cube root of rho"
        notes += (f"the mesh has the size of density 1: if that is rho, lengths are those given here over {root}",)
    verdict = found.verdict.explained(found.verdict.reasons[0], said)
    return replace(found, density=density, warnings=notes, verdict=verdict)


def _whole(A: sp.csr_array, found: Recovery) -> NDArray[np.bool_]:
    """(N,) rows of nodes all of whose cells the mesh has, with positions that are determined.

    They annihilate constants; where hardly any row does so, as with an unknown diagonal, that is not asked for.
    """
    if found.node_of_row is None or found.direction_of_row is None:
        node, direction = np.arange(A.shape[0]), np.zeros(A.shape[0], dtype=np.int64)
    else:
        node, direction = found.node_of_row, found.direction_of_row
    labels = (direction[:, None] == np.arange(direction.max() + 1)).astype(float)
    still = np.asarray((np.abs(A @ labels) <= SUMMED * (abs(A) @ labels)).all(axis=1))
    loose = (found.node_status[node] != 0) | (direction < 0)
    determined = ~loose & (abs(A) @ loose.astype(float) == 0)
    return determined & still if still.mean() > HARDLY_ANY else determined


def _assembled(found: Recovery, lumped: bool) -> sp.csr_array:
    """(N, N) mass matrix of the mesh with density 1."""
    cells = found.cells
    if found.n_polygons:
        raise GeometryError(
            "the stiffness matrix leaves cells undivided, and `mass` does not tell into which triangles: it is lumped, "
            "or that of another mesh"
        )
    other = [kind for kind in cells if KINDS[kind].quadratic] if isinstance(found, PlanarMesh | Body) else []
    if other or not (cells and isinstance(found, PlanarMesh | Body)):
        raise GeometryError(
            f"mass matrices are read beside those of linear elements on cells that are known, not of {found.operator}"
            + (f" on cells of the kind {other[0]}" if other else "")
        )
    n, blocks = found.n_points, {KINDS[kind]: nodes for kind, nodes in cells.items()}
    scalar = mass_matrix(n, blocks, weights_at(found.points, blocks))
    if lumped:
        scalar = sp.csr_array(sp.diags_array(scalar.sum(axis=1)))
    if found.node_of_row is None or found.direction_of_row is None:
        return scalar
    N, alike = len(found.node_of_row), found.direction_of_row[:, None] == np.arange(found.dim)
    node = sp.csr_array((np.ones(N), (np.arange(N), np.maximum(found.node_of_row, 0))), shape=(N, n))
    chosen = [sp.diags_array(own.astype(float)) @ node for own in alike.T]
    return sp.csr_array(sum(one @ scalar @ one.T for one in chosen))


def _misfit(again: sp.csr_array, M: sp.csr_array, whole: NDArray[np.bool_]) -> float:
    """Largest difference in whole rows, less what rounding to few digits explains, relative to the diagonals."""
    digits = Digits.of(M.data)
    rounding = sp.csr_array((np.zeros(M.nnz) if digits is None else digits.unit, M.indices, M.indptr), shape=M.shape)
    over = (abs(again - M) - rounding).tocoo()
    root = np.sqrt(M.diagonal())
    some = whole[over.row]
    return float((over.data[some] / (root[over.row] * root[over.col])[some]).max(initial=0.0))


def _stiffness_error(
    A: sp.csr_array, first: Recovery, mesh: Recovery, tensor: tuple[float, float, float] | None
) -> float:
    """The largest misfit of a mesh among the entries that it gave back in the size in which it was found, `first`.

    Entries beside supports, or with terms of their own, are none of these. Zero where there are none.
    """
    if isinstance(mesh, PlanarMesh) and isinstance(first, PlanarMesh):
        matrix = check_matrix(0.5 * (A + A.T))  # with noise both triangles may differ
        terms = None if mesh.row_scaling is None else Terms(matrix.diagonal, scaling=mesh.row_scaling)
        known, again = (certify_mesh(matrix, one, tensor, terms) for one in (first, mesh))
        given_back = known.misfits <= max(CERTIFIED, first.backward_error)
        return float(again.misfits[given_back].max(initial=0.0))
    if isinstance(mesh, Body) and len(mesh.lame) and mesh.node_of_row is not None and mesh.direction_of_row is not None:
        body = certify_body(A, mesh.node_of_row, mesh.direction_of_row, mesh.points, mesh.cells, mesh.lame)
        return 0.0 if np.isnan(body.backward_error) else body.backward_error
    return 0.0


def _edge(found: Recovery) -> float:
    """About the length of an edge."""
    ends = np.concatenate([cells[:, :2] for cells in found.cells.values()])
    return float(np.nanmean(np.linalg.norm(found.points[ends[:, 1]] - found.points[ends[:, 0]], axis=1)))


def _digits_lost(found: Recovery) -> bool:
    """Whether coordinates are rounded to more than what counts as given back, relative to edges."""
    return bool(np.nanmax(np.abs(found.points)) * np.finfo(float).eps > CERTIFIED * _edge(found))


def _too_far(found: Recovery) -> GeometryError:
    """That coordinates have too few digits in the size that the mass matrix tells."""
    place = ", ".join(f"{x:.6g}" for x in np.nanmean(found.points, axis=0))
    return GeometryError(
        f"in the size that `mass` tells, edges are about {_edge(found):.1e} long, and coordinates have too few digits "
        f"that far from the origin: subtract a point near ({place}) from `anchors`. The mesh of the stiffness matrix "
        "alone is certified"
    )


def _enlarged(found: Recovery, times: NDArray[np.float64], centre: NDArray[np.float64]) -> Recovery:
    """The mesh with each piece so many times as large, from a point (d,), or one for each node, and its moduli too."""
    if len(found.hinges) and np.ptp(times) > AGREED * times.max():
        raise GeometryError(
            "pieces that meet in single vertices are of different sizes, by `mass`: that is not read yet"
        )
    of_node = np.where(found.component < 0, np.nan, times[found.component])[:, None]
    more: dict[str, Any] = {}
    if isinstance(found, PlanarMesh):
        if found.standard_deviations is not None:
            more["standard_deviations"] = found.standard_deviations * of_node
        if len(found.eliminated_points):
            more["eliminated_points"] = centre + (found.eliminated_points - centre) * times[0]
    if isinstance(found, Body):
        more["scale"] = found.scale / times ** (found.dim - 2)
        if len(found.lame):  # of few digits, cells without moduli
            first = np.concatenate([cells[:, 0] for cells in found.cells.values()])
            more["lame"] = found.lame / of_node[first] ** (found.dim - 2)
    return replace(found, points=centre + (found.points - centre) * of_node, **more)
