"""A recovered mesh as meshio has one: points in space, blocks of cells, and what the mesh is worth as point data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .formats import MeshFormat
from .recovery import Recovery
from .structures.layouts import layout_named

if TYPE_CHECKING:
    import meshio

STATUS = ("certified", "ambiguous", "uncertified")
UNIQUENESS = ("proved", "searched", "ambiguous", None, "conventional")
"""Words that are numbers in point data, by their place, which none of them ever changes."""


def to_meshio(recovery: Recovery) -> meshio.Mesh:
    """The mesh for meshio, in space (z = 0), since most formats know no other points.

    Point data, all scalar: ``row`` of the matrix, ``component``, ``boundary`` (1 on the outside of the mesh, else 0),
    and where present ``node_status`` and ``standard_deviation_x`` and so on. Of vector-valued matrices there are
    ``row_x``, ``row_y``, ``row_z``, and of rotations ``row_rx`` and so on, instead of ``row``, with -1 for unknowns
    that the matrix lacks. The same at every point, since meshio's writers have no place for what belongs to a mesh as a
    whole: ``status`` and ``uniqueness``, by their place in `STATUS` and `UNIQUENESS`, ``backward_error``, and
    ``scale``, that of the point's piece. Nodes without cells are cells of kind ``vertex``, so that they show. Undivided
    cells are blocks of kind ``polygon``, one for each number of vertices.
    """
    return mesh_for(recovery, MeshFormat("", polygons=True))


def cells_of(recovery: Recovery) -> dict[str, NDArray[np.int64]]:
    """Cells by kind, polygons divided; where the elements of a vector-valued matrix are not known, its nodes."""
    if recovery.n_polygons:
        return {"triangle": recovery.divided()[0]}
    if recovery.n_cells or not recovery.vector_valued:
        return recovery.cells or {"triangle": recovery.triangles}
    return {"vertex": np.flatnonzero(recovery.node_status == 0)[:, None]}


def _point_data(recovery: Recovery) -> dict[str, NDArray]:
    data: dict[str, NDArray] = {"row": np.arange(recovery.n_points)}
    node, direction = recovery.node_of_row, recovery.direction_of_row
    if node is not None and direction is not None:  # by direction, since a node has several rows
        rows = np.full((direction.max() + 1, recovery.n_points), -1)
        told = direction >= 0
        rows[direction[told], node[told]] = np.flatnonzero(told)
        layout = layout_named(recovery.operator)
        data = {f"row_{name}": row for name, row in zip("xyz" if layout is None else layout.names, rows, strict=False)}
    data |= {"component": recovery.component, "boundary": recovery.boundary_flag()}
    if recovery.node_status.any():
        data["node_status"] = recovery.node_status.astype(np.int64)
    data |= recovery.point_data()
    worth = {
        "status": STATUS.index(recovery.status),
        "uniqueness": UNIQUENESS.index(recovery.uniqueness),
        "backward_error": float(recovery.backward_error),
    }
    data |= {name: np.full(recovery.n_points, value) for name, value in worth.items()}
    scale = recovery.scale_at_points()
    return data if scale is None else data | {"scale": scale}


def mesh_for(recovery: Recovery, mesh_format: MeshFormat) -> meshio.Mesh:
    """The mesh with exactly what the format can hold, so that meshio has nothing to drop."""
    import meshio

    data = _point_data(recovery) if mesh_format.data == "all" else {}
    if mesh_format.data == "boundary":
        data = {f"{mesh_format.name}:ref": recovery.boundary_flag()}
    points = np.zeros((recovery.n_points, max(mesh_format.dimension, recovery.dim)))
    points[:, : recovery.points.shape[1]] = recovery.points
    blocks = list(cells_of(recovery).items())
    if mesh_format.polygons and recovery.n_polygons:
        blocks = [*recovery.cells.items(), *(("polygon", cells) for cells in recovery.polygons_by_size())]
    mesh = meshio.Mesh(points, blocks, point_data=data)
    if not mesh_format.keeps_rows:  # points of no triangle have no place, and NaN would spoil bounding boxes
        mesh.points[np.isnan(mesh.points)] = 0
    if mesh_format.name == "nastran":
        mesh.points = _rounded(mesh.points, mesh_format.digits or 16)
    if mesh_format.name == "ply":  # readers other than meshio's know integers of at most 32 bits
        data = mesh.point_data
        mesh.point_data = {k: v.astype(np.int32) if v.dtype.kind == "i" else v for k, v in data.items()}
        for block in mesh.cells:
            block.data = block.data.astype(np.int32)
    return mesh


def _rounded(points: NDArray, digits: int) -> NDArray:
    """To significant digits, fewer where the exponent takes up two or three columns."""
    with np.errstate(divide="ignore"):
        exponent = np.abs(np.floor(np.log10(np.abs(points))))
    fraction = digits - 1 - (exponent >= 10) - ((exponent >= 100) & np.isfinite(exponent))
    return np.char.mod(np.array([f"%.{k}e" for k in range(digits)])[fraction], points).astype(np.float64)
