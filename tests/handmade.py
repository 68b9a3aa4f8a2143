"""Recoveries made by hand, for tests of what happens to a result."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from meshes import edge_list, random_mesh
from unassemble import Body, PlanarMesh, Recovery
from unassemble.certificate import Findings, Verdict, judge
from unassemble.elements import KINDS, reference_nodes
from unassemble.topology import surfaces
from unassemble.words import Reason


def verdict(status: str = "certified", reason: str = "it fits", advice: str = "") -> Verdict:
    """A verdict of each status."""
    why = Reason(reason, advice=advice)
    return judge(
        Findings(
            (reason,),
            error=1e-15,
            objections=(why,) if status == "uncertified" else (),
            another=why if status == "ambiguous" else None,
        )
    )


def recovery_of(points: np.ndarray, triangles: np.ndarray) -> PlanarMesh:
    """A certified result with this mesh, whose triangles may have any orientation and one piece only."""
    piece = surfaces(len(points), edge_list(triangles)).pieces[0]
    a, b, c = (points[piece.vertices[corner]] @ [1, 1j] for corner in piece.triangles.T)
    mirrored = np.sum(np.imag(np.conj(b - a) * (c - a))) < 0
    boundary, offsets = piece.vertices[piece.boundary], piece.loop_offsets
    if mirrored:
        boundary, offsets = boundary[::-1, ::-1], offsets[-1] - offsets[::-1]
    return PlanarMesh(
        points=np.asarray(points, dtype=np.float64),
        triangles=piece.vertices[piece.triangles[:, [0, 2, 1]] if mirrored else piece.triangles],
        component=np.zeros(len(points), dtype=np.int64),
        hinges=np.empty(0, dtype=np.int64),
        scale=np.array([2.5]),
        boundary=boundary,
        boundary_offsets=offsets,
        node_status=np.zeros(len(points), dtype=np.int8),
        verdict=judge(Findings(("the operator re-assembled on this mesh gives the matrix back to 1.0e-15",), 1e-15)),
        operator="laplacian",
        backward_error=1e-15,
        n_holes=piece.n_loops - 1,
        timings={"topology": 0.25, "polish": 1.0},
    )


def lake(n: int = 250, **changes: Any) -> PlanarMesh:
    """A mesh with two holes."""
    return replace(recovery_of(*random_mesh(n, seed=3)), **changes)


def with_loose_row(recovery: Recovery) -> Recovery:
    """The same with one more row, of which the matrix determines nothing."""
    return replace(
        recovery,
        points=np.vstack([recovery.points, [[np.nan, np.nan]]]),
        component=np.append(recovery.component, -1),
        node_status=np.append(recovery.node_status, 1).astype(np.int8),
    )


def two_pieces(apart: float = 0.0) -> PlanarMesh:
    """The lake twice, the second shifted along x."""
    one = lake()
    n = one.n_points
    return replace(
        one,
        points=np.vstack([one.points, one.points + [apart, 0]]),
        triangles=np.vstack([one.triangles, one.triangles + n]),
        component=np.repeat([0, 1], n),
        scale=np.array([2.5, -1.0]),
        boundary=np.vstack([one.boundary, one.boundary + n]),
        boundary_offsets=np.append(one.boundary_offsets, one.boundary_offsets[1:] + len(one.boundary)),
        node_status=np.zeros(2 * n, dtype=np.int8),
        n_holes=4,
    )


_FIELDS = {"triangle": "triangles", "quad": "quads", "tetra": "tetrahedra", "hexahedron": "hexahedra"}


def solid(kind: str) -> Body:
    """Two cells, or one, of any kind on the corners of a box or of two squares, as of an elasticity matrix."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
    flat = np.vstack([square, square + [2, 0.5]])
    box = np.column_stack([np.vstack([square, square]), np.repeat([0.0, 1.25], 4)])
    cells = {
        "triangle": [[0, 1, 2], [4, 6, 7]],
        "quad": [[0, 1, 2, 3], [4, 5, 6, 7]],
        "tetra": [[0, 1, 3, 4], [1, 2, 3, 6]],
        "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
    }
    points = flat if kind in ("triangle", "quad") else box
    d = points.shape[1]
    fields: dict[str, Any] = {"triangles": np.empty((0, 3), np.int64), _FIELDS[kind]: np.array(cells[kind])}
    return Body(
        **fields,
        points=points,
        component=np.zeros(8, np.int64),
        hinges=np.empty(0, np.int64),
        scale=np.array([0.5]),
        boundary=np.empty((0, 2), np.int64),
        boundary_offsets=np.zeros(1, np.int64),
        node_status=np.zeros(8, np.int8),
        verdict=judge(Findings(("the matrix re-assembled on the elements is the given one",), 1e-15)),
        operator="elasticity",
        backward_error=1e-15,
        node_of_row=np.repeat(np.arange(8), d),
        direction_of_row=np.tile(np.arange(d), 8),
        numbering="interleaved",
        poisson_ratio=0.25,
    )


def quadratic(kind: str) -> Body:
    """One quadratic cell of any kind, as of an elasticity matrix."""
    shape = KINDS[kind]
    n, d = shape.nodes, shape.dim
    nodes = np.arange(n)[None]
    return replace(
        solid(shape.base),
        points=1.25 * reference_nodes(shape),
        **{_FIELDS[shape.base]: nodes[:, : shape.corners]},
        mid_nodes=nodes[:, shape.corners :],
        component=np.zeros(n, np.int64),
        node_status=np.zeros(n, np.int8),
        node_of_row=np.repeat(np.arange(n), d),
        direction_of_row=np.tile(np.arange(d), n),
    )
