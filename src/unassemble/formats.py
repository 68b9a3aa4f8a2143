"""Mesh formats by extension: what each can hold, and how meshio is told to write it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import PurePath
from typing import Any

from .errors import FormatError, OutputError


@dataclass(frozen=True)
class MeshFormat:
    """How a planar mesh of triangles goes into one file format.

    Attributes
    ----------
    name : str
        The format's name in meshio; empty for our own ``.npz``.
    dimension : {2, 3}
        Coordinates of each point. Where the format attaches meaning to it, a planar mesh has 2.
    data : {"all", "boundary", "none"}
        Point data that it takes along; ``"boundary"``: one integer label, which marks the boundary.
    undetermined : bool
        Whether it can hold points without coordinates (NaN). Readers of text formats mostly do not know that word.
    keeps_rows : bool
        Whether points have numbers at all; otherwise each triangle repeats its corners.
    digits : int or None
        Significant digits that coordinates keep, None for all.
    options : mapping
        For meshio's writer.
    needs : str
        A package that meshio needs for it and does not bring along.
    cannot : str
        Why the format cannot hold a planar mesh; empty where it can.
    """

    name: str
    dimension: int = 3
    data: str = "all"
    undetermined: bool = False
    keeps_rows: bool = True
    digits: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    needs: str = ""
    cannot: str = ""


_NO_TRIANGLES = "meshio writes only {} to it, and the mesh is made of triangles"
_NOT_COMPRESSED = "meshio writes it without compressing: write {} and compress that"

# XML inside the one file: heavy data in a side file could not be renamed into place together with it.
# (meshio imports h5py even then.)
_XDMF = MeshFormat("xdmf", undetermined=True, options={"data_format": "XML"}, needs="h5py")
_EXODUS = MeshFormat("exodus", dimension=2, undetermined=True, needs="netCDF4")
# Eleven significant digits are what the sixteen columns of a field hold at any sign and exponent.
_NASTRAN = MeshFormat("nastran", data="none", digits=11)
_PERMAS = MeshFormat("permas", data="none")
_NETGEN = MeshFormat("netgen", data="none")
_TECPLOT = MeshFormat("tecplot", dimension=2)
_TETGEN = MeshFormat("tetgen", cannot=_NO_TRIANGLES.format("tetrahedra"))
_UGRID = MeshFormat("ugrid", data="none", undetermined=True)
_UGRID_SINGLE = MeshFormat("ugrid", data="none", undetermined=True, digits=7)

FORMATS: Mapping[str, MeshFormat] = {
    ".npz": MeshFormat("", dimension=2, undetermined=True),
    ".avs": MeshFormat("avsucd"),
    ".bdf": _NASTRAN,
    ".cgns": MeshFormat("cgns", cannot=_NO_TRIANGLES.format("tetrahedra")),
    ".dat": _TECPLOT,
    ".dato": _PERMAS,
    ".dato.gz": MeshFormat("permas", cannot=_NOT_COMPRESSED.format(".dato")),
    ".e": _EXODUS,
    ".ele": _TETGEN,
    ".ex2": _EXODUS,
    ".exo": _EXODUS,
    ".f3grid": MeshFormat("flac3d", cannot=_NO_TRIANGLES.format("cells with a volume")),
    ".fem": _NASTRAN,
    ".h5m": MeshFormat("h5m", undetermined=True, needs="h5py"),
    ".hmf": MeshFormat("hmf", undetermined=True, needs="h5py"),
    ".inp": MeshFormat("abaqus", data="none"),
    ".mdpa": MeshFormat("mdpa", data="none"),
    ".med": MeshFormat("med", dimension=2, undetermined=True, needs="h5py"),
    ".mesh": MeshFormat("medit", dimension=2, data="boundary"),
    ".meshb": MeshFormat("medit", dimension=2, data="boundary", undetermined=True),
    ".msh": MeshFormat("gmsh", undetermined=True),  # Gmsh, not ANSYS, which shares the extension
    ".nas": _NASTRAN,
    ".node": _TETGEN,
    ".obj": MeshFormat("obj", data="none"),
    ".off": MeshFormat("off", data="none"),
    ".ply": MeshFormat("ply", undetermined=True),
    ".post": _PERMAS,
    ".post.gz": MeshFormat("permas", cannot=_NOT_COMPRESSED.format(".post")),
    ".stl": MeshFormat("stl", data="none", keeps_rows=False),
    ".su2": MeshFormat("su2", dimension=2, data="none"),
    ".svg": MeshFormat(
        "svg", dimension=2, data="none", keeps_rows=False, options={"float_fmt": ".12g", "image_width": None}
    ),
    ".tec": _TECPLOT,
    ".ugrid": MeshFormat("ugrid", data="none", digits=7),
    # Binary variants of UGRID are told by a second extension: byte order, Fortran records, size of numbers.
    **{f".{kind}.ugrid": _UGRID for kind in ("b8l", "b8", "lb8l", "lb8", "r8", "lr8")},
    **{f".{kind}.ugrid": _UGRID_SINGLE for kind in ("b4", "lb4", "r4", "lr4")},
    ".vol": _NETGEN,
    ".vol.gz": _NETGEN,
    ".vtk": MeshFormat("vtk", undetermined=True),
    ".vtu": MeshFormat("vtu", undetermined=True),
    ".wkt": MeshFormat("wkt", data="none", keeps_rows=False),
    ".xdmf": _XDMF,
    ".xml": MeshFormat("dolfin-xml", dimension=2, data="none"),
    ".xmf": _XDMF,
}


def format_of(path: str | os.PathLike[str]) -> tuple[str, MeshFormat]:
    """Extension and format that a file name asks for; upper and lower case are alike.

    Raises
    ------
    OutputError
        If the extension is unknown, or its writer not installed.
    FormatError
        If the format has no place for planar triangles.
    """
    name = PurePath(path).name.lower()
    fitting = [suffix for suffix in FORMATS if name.endswith(suffix) and name != suffix]
    if not fitting:
        raise OutputError(
            f"cannot tell the format of {os.fspath(path)!r} from its extension: known are {', '.join(sorted(FORMATS))}"
        )
    suffix = max(fitting, key=len)
    mesh_format = FORMATS[suffix]
    if mesh_format.cannot:
        raise FormatError(f"the format {suffix} cannot hold the mesh: {mesh_format.cannot} (.vtu, for one, holds it)")
    if mesh_format.needs and find_spec(mesh_format.needs) is None:
        raise OutputError(f"the format {suffix} needs the package {mesh_format.needs}: pip install {mesh_format.needs}")
    return suffix, mesh_format
