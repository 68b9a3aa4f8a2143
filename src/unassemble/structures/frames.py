"""Coordinates from the matrix of a frame, shell or plate, in true units of length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..clock import Clock
from ..elasticity.anchoring import checked_anchors
from ..elasticity.nodal import determined
from ..elasticity.results import Evidence
from ..elasticity.rounded import with_exact_sums
from ..errors import GeometryError, RecoveryError
from ..linalg import blas_threads
from ..matrix import OperatorMatrix
from ..recovery import Recovery
from ..words import count_of
from .certificate import largest_force
from .equations import Equations, equations
from .members import members_and_cells
from .nodes import Nodes, nodes_of
from .positions import positions
from .recognise import StructuralNumbering

CERTIFIED = 1e-9
_SPREADS = 20  # times the rounding of the entries: what a sum of forces may be off by
_SURE = 1e-6  # of the diameter: how far off the points of a certified structure may be


def serve_structure(
    matrix: OperatorMatrix,
    numbering: StructuralNumbering,
    clock: Clock,
    *,
    anchors: Sequence[Any] | None,
    choice: str,
    cells: bool,
) -> Recovery:
    """Recover the coordinates of a structure whose nodes and directions are known, in true units of length.

    Parameters
    ----------
    matrix : OperatorMatrix
    numbering : StructuralNumbering
    clock : Clock
    anchors : sequence of (row, x, y) or (row, x, y, z), optional
        They move pieces; size and axes are the matrix's own.
    choice : str
        Why the matrix was taken for a structure's.
    cells : bool
        Look for members and shell cells too.

    Raises
    ------
    InputError
        For anchors that do not fit.
    RecoveryError
        If no node is determined.
    """
    layout = numbering.layout
    node, direction = numbering.node_of_row, numbering.direction_of_row
    known = checked_anchors(anchors, node, layout.dim)
    whole, rounding = with_exact_sums(matrix.csr())
    nodes = nodes_of(whole, layout, node, direction)
    valid = nodes.whole()
    with clock("solve"), blas_threads(1):
        found, springs = _best(nodes, valid)
    points, component, evidence, notes = found
    with clock("certify"):
        if springs:
            valid[:, len(layout.displacements) :] = False
        counted = np.zeros((len(node), len(layout.rotations)), dtype=bool)
        present = nodes.present
        counted[nodes.row_of[present]] = valid[present]
        error = largest_force(whole, layout, node, direction, points, counted)
    fields: dict[str, Any] = {"triangles": np.empty((0, 3), np.int64)}
    if cells and error < 1e-6:
        with clock("members"):
            fields = members_and_cells(nodes, points)
        notes.append("members and cells were read off the graph; what is certified is the coordinates")
    if springs:
        notes.append("moments do not balance alone: rotations are tied to the ground by springs, as against drilling")
    untold = np.unique(node[direction < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     "left out; give the numbering if it is known")  # fmt: skip
    loose = ~determined(points)
    if loose.any():
        notes.append(f"{loose.sum()} of {count_of(nodes.n, 'node')} cannot be determined: at supports, or tied to "
                     "these only")  # fmt: skip
    points, more = _moved(points, component, known)
    status, reason = _verdict(error, evidence, layout.dim, rounding)
    return Recovery(
        **fields,
        points=points,
        component=component,
        hinges=np.empty(0, np.int64),
        scale=np.full(len(evidence), np.nan),
        boundary=np.empty((0, 2), np.int64),
        boundary_offsets=np.zeros(1, np.int64),
        node_status=np.asarray(loose, dtype=np.int8),
        status=status,
        reason=reason,
        operator=layout.name,
        backward_error=error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes, *more),
        node_of_row=node,
        direction_of_row=direction,
        numbering=numbering.kind,
        choice=choice,
        evidence=evidence,
    )


_Found = tuple[NDArray[np.float64], NDArray[np.int64], tuple[Evidence, ...], list[str]]


def _best(nodes: Nodes, valid: NDArray[np.bool_]) -> tuple[_Found, bool]:
    """Positions from all rows; where these contradict each other, without what springs to the ground may spoil."""
    attempts: list[tuple[_Found, bool]] = []
    failure: RecoveryError | None = None
    for springs in (False, True):
        try:
            found = _pieces(nodes, equations(nodes, valid, springs=springs))
        except RecoveryError as error:
            failure = failure or error
            continue
        attempts.append((found, springs))
        if all(one.residual <= CERTIFIED for one in found[2]):
            break
    if not attempts:
        raise failure or GeometryError("no row annihilates translations: no node has a valid equation")
    return min(attempts, key=lambda one: max(part.residual for part in one[0][2]))


def _pieces(nodes: Nodes, given: Equations) -> _Found:
    """Positions piece by piece."""
    d = nodes.layout.dim
    node = given.operator.indices // d
    row = np.repeat(np.arange(len(given.right)), np.diff(given.operator.indptr))
    link = sp.csr_array((np.ones(len(node)), (row, node)), shape=(len(given.right), nodes.n))
    _, label = sp.csgraph.connected_components(sp.csr_array(link.T @ link), directed=False)
    touched = np.bincount(node, minlength=nodes.n) > 0
    points, component = np.full((nodes.n, d), np.nan), np.full(nodes.n, -1)
    evidence: list[Evidence] = []
    notes: list[str] = []
    failure: GeometryError | None = None
    for piece in np.unique(label[touched]):
        body = np.flatnonzero((label == piece) & touched)
        rows = np.flatnonzero(np.diff(link.indptr) > 0)
        rows = rows[label[link.indices[link.indptr[rows]]] == piece]
        columns = (body[:, None] * d + np.arange(d)).ravel()
        part = Equations(sp.csr_array(given.operator[rows][:, columns]), given.right[rows])
        edges = np.column_stack(sp.triu(nodes.graph[body][:, body], 1).nonzero())
        try:
            one = positions(part, d, edges)
        except GeometryError as error:
            failure = failure or error
            notes.append(f"the piece with node {body[0]}: {error}")
            continue
        points[body] = one.points
        component[body[determined(one.points)]] = len(evidence)
        evidence.append(Evidence(one.dimension, one.residual, one.gap, len(rows)))
    if not evidence:
        raise failure or GeometryError(
            "no row annihilates translations and couples to no support: no node has a valid equation"
        )
    return points, component, tuple(evidence), notes


def _moved(
    points: NDArray[np.float64], component: NDArray[np.int64], anchors: tuple[NDArray, NDArray]
) -> tuple[NDArray[np.float64], list[str]]:
    """Pieces moved to their anchors, and how far these are missed."""
    nodes, places = anchors
    points, notes = points.copy(), []
    lost = nodes[component[nodes] < 0]
    if len(lost):
        notes.append(f"the anchored nodes {', '.join(map(str, lost))} are not determined and were not used")
    for piece in np.unique(component[nodes][component[nodes] >= 0]):
        here = nodes[component[nodes] == piece]
        wanted = places[component[nodes] == piece]
        points[component == piece] += (wanted - points[here]).mean(axis=0)
        misfit = float(np.linalg.norm(points[here] - wanted, axis=1).max())
        if len(here) > 1 and misfit > 1e-6 * np.linalg.norm(wanted - wanted.mean(axis=0), axis=1).max():
            notes.append(f"the anchors do not fit the structure, whose size and axes the matrix knows: one is missed "
                         f"by {misfit:.3g}")  # fmt: skip
    return points, notes


def _verdict(error: float, evidence: tuple[Evidence, ...], d: int, rounding: float) -> tuple[str, str]:
    free = [one.null_dimension for one in evidence if one.null_dimension > d]
    if free:
        return "uncertified", (
            f"the null space has dimension {free[0]} where {d} translations are expected: supports leave too few whole "
            "rows"
        )
    if error < _SPREADS * rounding:
        return "uncertified", (
            f"the entries are rounded to {rounding:.0e} of themselves, and rigid rotations cause forces of {error:.1e} "
            "of those that make them up, which is what that leaves"
        )
    loosest = min((one.gap for one in evidence), default=np.inf)
    if error > _SURE * loosest:
        return "uncertified", (
            f"rigid rotations of the nodes cause forces of {error:.1e} of those that make them up, and another field, "
            f"no translation, only {loosest:.1e}: positions are known to about {error / loosest:.0e} of the size"
        )
    if error > CERTIFIED:
        return "uncertified", (
            f"no positions make rigid rotations free of forces: the largest is {error:.1e} of those that make it up; "
            "the points are the best fit"
        )
    return "certified", "rigid rotations of the nodes cause no forces, and only translations change nothing"
