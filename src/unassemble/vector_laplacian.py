"""Vector Laplacians: directions that are not coupled, each a scalar matrix."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .errors import RecoveryError
from .matrix import OperatorMatrix, check_matrix
from .nodes.anchoring import checked_anchors
from .nodes.nodal import NodalMatrix
from .nodes.numbering import Numbering
from .recovery import ConformingMesh, PlanarMesh
from .tolerances import ROUNDED

Scalar = Callable[[OperatorMatrix, Sequence[Any]], PlanarMesh]


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


def parts_of(matrix: sp.csr_array, nodal: NodalMatrix, numbering: Numbering) -> ScalarParts:
    """The scalar matrices of uncoupled directions."""
    nodes = tuple(np.flatnonzero(nodal.row_of[:, a] >= 0) for a in range(nodal.dim))
    rows = [nodal.row_of[here, a] for a, here in enumerate(nodes)]
    return ScalarParts(tuple(sp.csr_array(matrix[r][:, r]) for r in rows), nodes, numbering)


def recover_directions(
    parts: ScalarParts, matrix: OperatorMatrix, anchors: Sequence[Any] | None, scalar: Scalar
) -> PlanarMesh:
    """Recover each direction as the scalar matrix that it is; the mesh is that of the direction with most nodes.

    Parameters
    ----------
    parts : ScalarParts
    matrix : OperatorMatrix
        The whole, for its warnings.
    anchors : sequence of (row, x, y), optional
    scalar : callable
        Recovers a scalar matrix with anchors.

    Raises
    ------
    RecoveryError
        If a direction has no mesh.
    """
    numbering = parts.numbering
    lead = int(np.argmax([len(nodes) for nodes in parts.nodes]))
    nodes = parts.nodes[lead]
    place = np.full(numbering.n_nodes, -1)
    place[nodes] = np.arange(len(nodes))
    anchor_nodes, where = checked_anchors(anchors, numbering.node_of_row, 2)
    here = place[anchor_nodes] >= 0
    known = [(int(k), *xy) for k, xy in zip(place[anchor_nodes[here]], where[here].tolist(), strict=True)]
    try:
        mesh = scalar(check_matrix(parts.matrices[lead]), known)
        others = [
            scalar(check_matrix(part), ())
            for k, part in enumerate(parts.matrices)
            if k != lead and not _same(part, parts.matrices[lead])
        ]
    except RecoveryError as error:
        raise type(error)(f"the directions are not coupled (a vector Laplacian), and of one: {error}") from error
    worst = max([mesh, *others], key=lambda one: (not one.certified, one.backward_error))
    notes = ["the directions are not coupled: each was treated as a scalar matrix"]
    if others:
        notes.append("the directions have different matrices: the mesh is that of the one with most nodes")
    return replace(
        _among_all_nodes(mesh, nodes, _rows_of(parts, lead), numbering.n_nodes),
        status=worst.status,
        uniqueness=worst.uniqueness,
        reason=worst.reason,
        advice=worst.advice,
        backward_error=worst.backward_error,
        operator="vector laplacian",
        warnings=(*matrix.warnings, *mesh.warnings, *notes),
        node_of_row=numbering.node_of_row,
        direction_of_row=numbering.direction_of_row,
        numbering=numbering.kind,
    )


def _among_all_nodes(mesh: PlanarMesh, nodes: NDArray[np.int64], rows: NDArray[np.int64], n: int) -> PlanarMesh:
    """The mesh of one direction with the numbers of all n nodes, and entries with those of the rows of the matrix.

    Its point k is node ``nodes[k]`` and has the row ``rows[k]``.
    """
    points, component, status = np.full((n, 2), np.nan), np.full(n, -1), np.ones(n, np.int8)
    points[nodes], component[nodes], status[nodes] = mesh.points, mesh.component, mesh.node_status
    if isinstance(mesh, ConformingMesh):
        mesh = replace(mesh, quads=nodes[mesh.quads], mid_nodes=nodes[mesh.mid_nodes])
    return replace(
        mesh,
        points=points,
        component=component,
        node_status=status,
        triangles=nodes[mesh.triangles],
        polygons_data=nodes[mesh.polygons_data],
        hinges=nodes[mesh.hinges],
        boundary=nodes[mesh.boundary],
        alternatives=tuple(one.renumbered(nodes) for one in mesh.alternatives),
        worst_entries=rows[mesh.worst_entries],
        suspects=rows[mesh.suspects],
    )


def _rows_of(parts: ScalarParts, direction: int) -> NDArray[np.int64]:
    """Matrix row of each row of a direction's scalar matrix."""
    numbering = parts.numbering
    row_of = np.full(numbering.n_nodes, -1)
    rows = np.flatnonzero((numbering.direction_of_row == direction) & ~numbering.identity_row)
    row_of[numbering.node_of_row[rows]] = rows
    return row_of[parts.nodes[direction]]


def _same(one: sp.csr_array, other: sp.csr_array) -> bool:
    return one.shape == other.shape and bool(abs(one - other).max() <= ROUNDED * abs(other).max())
