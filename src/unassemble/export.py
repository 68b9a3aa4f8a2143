"""Write a recovered mesh: ``.npz`` for programs, or any format of meshio."""

from __future__ import annotations

import io
import logging
import os
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .elements.surface import outer_nodes
from .errors import FormatError, OutputError
from .files import check_target, whole_file
from .formats import MeshFormat, format_of
from .recovery import PlanarMesh, Recovery, Surface
from .structures.layouts import layout_named

if TYPE_CHECKING:
    import meshio

_log = logging.getLogger(__name__)

STATUS = ("certified", "ambiguous", "uncertified")
UNIQUENESS = ("proved", "searched", "ambiguous", None)
"""Words that are numbers in point data, by their place."""


def check_output(path: str | os.PathLike[str]) -> None:
    """Raise OutputError, before long work, where a file cannot be written, or FormatError where it can hold no mesh."""
    if os.path.isdir(path):  # noqa: PTH112 - which takes any name, however long
        raise OutputError(f"cannot write {os.fspath(path)!r}: it is a folder, so name a file in it, such as mesh.vtu")
    format_of(path)
    check_target(path)


def save(recovery: Recovery, path: str | os.PathLike[str]) -> None:
    """Write a recovered mesh, whole or not at all; the extension names the format.

    ``.npz`` holds coordinates or lengths, cells, pieces, factors, what rows belong to, and what the mesh is worth, by
    the keys that the manual lists. Other formats are those of meshio (:mod:`unassemble.formats`); of these ``.vtu``
    holds polygons, the others get them divided into triangles. Those that hold point data have what the mesh is worth
    as such, see :func:`to_meshio`; the rest have no place for it, which :func:`unassemble.formats.lacks_worth` says. An
    old file is replaced.

    Raises
    ------
    OutputError
        If the file cannot be written; an old one is then as it was.
    FormatError
        If the format cannot hold this mesh.
    """
    suffix, mesh_format = format_of(path)
    _check_content(recovery, suffix, mesh_format)
    with whole_file(path, suffix) as draft:
        if mesh_format.name:
            _write_by_meshio(_mesh_for(recovery, mesh_format), draft, suffix, mesh_format)
        else:
            np.savez(draft, **arrays(recovery))


def arrays(recovery: Recovery) -> dict[str, Any]:
    """What the ``.npz`` holds, by key; what there is nothing of has no key."""
    content: dict[str, Any] = {} if without_points(recovery) else {"points": recovery.points}
    for name in ("triangles", "quads", "tetrahedra", "hexahedra", "mid_nodes", "lines", "eliminated_points", "region"):
        found = getattr(recovery, name, None)  # each kind of result has its own
        if found is not None and found.size:
            content[name] = found
    if recovery.n_polygons:
        content |= {name: getattr(recovery, name) for name in ("polygons_offsets", "polygons_data")}
    names = ["row_scaling", "areas", "edges", "edge_lengths", "curvature", "length_deviations", "component", "hinges"]
    names += ["scale", "node_status", "node_of_row", "direction_of_row"]
    content |= {name: found for name in names if (found := getattr(recovery, name, None)) is not None}
    worth = {
        "status": recovery.status,
        "uniqueness": recovery.uniqueness or "",
        "backward_error": recovery.backward_error,
    }
    return content | worth


def without_points(recovery: Recovery) -> bool:
    """Whether there are edge lengths only, or areas, which no format but ``.npz`` holds."""
    if isinstance(recovery, Surface):
        return not np.isfinite(recovery.points).any()
    return isinstance(recovery, PlanarMesh) and recovery.areas is not None


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
    return _mesh_for(recovery, MeshFormat("", polygons=True))


def _cells(recovery: Recovery) -> dict[str, NDArray[np.int64]]:
    """Cells by kind, polygons divided; where the elements of a vector-valued matrix are not known, its nodes."""
    if isinstance(recovery, PlanarMesh) and recovery.n_polygons:
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
        names = "xyz" if layout is None else layout.names
        data = {f"row_{name}": row for name, row in zip(names, rows, strict=False)}
    data |= {"component": recovery.component, "boundary": _boundary_flag(recovery)}
    if recovery.node_status.any():
        data["node_status"] = recovery.node_status.astype(np.int64)
    if isinstance(recovery, PlanarMesh) and recovery.standard_deviations is not None:
        for name, column in zip("xyz", recovery.standard_deviations.T, strict=False):
            data[f"standard_deviation_{name}"] = np.ascontiguousarray(column)
    if isinstance(recovery, Surface):
        data["curvature"] = recovery.curvature
    worth = {
        "status": STATUS.index(recovery.status),
        "uniqueness": UNIQUENESS.index(recovery.uniqueness),
        "backward_error": float(recovery.backward_error),
    }
    data |= {name: np.full(recovery.n_points, value) for name, value in worth.items()}
    if isinstance(recovery, PlanarMesh) and recovery.region is not None:
        return data  # each cell has a factor, points have none
    return data | {"scale": np.append(recovery.scale, np.nan)[recovery.component]}


def _boundary_flag(recovery: Recovery) -> NDArray[np.int64]:
    flag = np.zeros(recovery.n_points, dtype=np.int64)
    flag[recovery.boundary] = 1
    if recovery.dim == 3 and not isinstance(recovery, Surface):
        solid = dict(recovery.cells)
        flag[solid.pop("line", [])] = 1
        flag[outer_nodes(solid) if solid else []] = 1
    return flag


def _check_content(recovery: Recovery, suffix: str, mesh_format: MeshFormat) -> None:
    if not mesh_format.name:
        return
    if without_points(recovery):
        what = "the matrix of a surface tells edge lengths only: write .npz, or ask for coordinates with `realise=True`"
        if isinstance(recovery, PlanarMesh):
            what = "a mass matrix tells areas only: write .npz"
        raise FormatError(f"the format {suffix} holds coordinates, and {what}")
    kinds = set(_cells(recovery)) - mesh_format.cells
    if kinds:
        what = "nodes without cells" if kinds == {"vertex"} else f"cells of kind {', '.join(sorted(kinds))}"
        raise FormatError(f"the format {suffix} cannot hold {what}: write .npz or .vtu")
    missing = int(np.count_nonzero(recovery.node_status))
    if missing and mesh_format.keeps_rows and not mesh_format.undetermined:
        first = f"{'node' if recovery.vector_valued else 'row'} {int(np.argmax(recovery.node_status))}"
        raise FormatError(
            f"the format {suffix} cannot hold points without coordinates, of which there are {missing:,} ({first} for "
            "one): write .npz or .vtu"
        )
    if not (recovery.n_cells or mesh_format.keeps_rows):
        raise FormatError(f"the format {suffix} holds triangles only, and there are none")


def _mesh_for(recovery: Recovery, mesh_format: MeshFormat) -> meshio.Mesh:
    """The mesh with exactly what the format can hold, so that meshio has nothing to drop."""
    import meshio

    data: dict[str, NDArray] = {}
    if mesh_format.data == "all":
        data = _point_data(recovery)
    elif mesh_format.data == "boundary":
        data = {f"{mesh_format.name}:ref": _boundary_flag(recovery)}
    points = np.zeros((recovery.n_points, max(mesh_format.dimension, recovery.dim)))
    points[:, : recovery.points.shape[1]] = recovery.points
    blocks = list(_cells(recovery).items())
    if mesh_format.polygons and isinstance(recovery, PlanarMesh) and recovery.n_polygons:
        corners, start, size = (
            recovery.polygons_data,
            recovery.polygons_offsets[:-1],
            np.diff(recovery.polygons_offsets),
        )
        same = [("polygon", corners[start[size == k, None] + np.arange(k)]) for k in np.unique(size)]
        blocks = [*recovery.cells.items(), *same]
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
    formats = np.array([f"%.{k}e" for k in range(digits)])[fraction]
    return np.char.mod(formats, points).astype(np.float64)


def _write_by_meshio(mesh: meshio.Mesh, draft: Path, suffix: str, mesh_format: MeshFormat) -> None:
    import meshio

    said = io.StringIO()
    # Some of its writers print, and some print numbers as Python does: in the way that numpy 1 had.
    silenced = redirect_stdout(said), redirect_stderr(said)
    try:
        with silenced[0], silenced[1], np.printoptions(legacy="1.21"):
            meshio.write(draft, mesh, file_format=mesh_format.name, **mesh_format.options)
    except (OSError, MemoryError):
        raise
    except Exception as error:  # its writers raise whatever they like
        why = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        raise FormatError(f"the format {suffix} cannot hold this mesh, says meshio: {why}") from error
    finally:
        if said.getvalue():
            _log.debug("meshio: %s", " ".join(said.getvalue().split()))
