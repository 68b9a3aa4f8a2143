"""Mesh formats by extension: what each can hold, and how meshio is told to write it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib.util import find_spec
from pathlib import PurePath
from typing import Any

from .errors import FormatError, OutputError

_FLAT = frozenset({"triangle", "quad"})
_SOLID = frozenset({"tetra", "hexahedron"})
_CELLS = _FLAT | _SOLID
_ALL = _CELLS | {"vertex"}
_HALFWAY = frozenset({"triangle6", "quad8", "tetra10", "hexahedron20"})
_QUADRATIC = _HALFWAY | {"quad9", "hexahedron27"}
_EVERY = _ALL | _QUADRATIC
_TRIANGLES = frozenset({"triangle"})
_LINES = frozenset({"line"})


@dataclass(frozen=True)
class MeshFormat:
    """How a mesh goes into one file format."""

    name: str  # in meshio; empty for our own ``.npz``
    dimension: int = 3  # coordinates of each point of a planar mesh: 2 where the format attaches meaning to it
    cells: frozenset[str] = _ALL  # kinds, by meshio's names, that it holds in meshio's hands; "vertex" for bare points
    polygons: bool = False  # whether it holds cells of any number of vertices
    data: str = "all"  # point data that it takes along; "none", or "boundary": one integer label, which marks that
    undetermined: bool = False  # whether it can hold NaN for coordinates: readers of text mostly do not know that word
    keeps_rows: bool = True  # whether points have numbers at all; otherwise each triangle repeats its corners
    digits: int | None = None  # significant ones that coordinates keep, None for all
    options: Mapping[str, Any] = field(default_factory=dict)  # for meshio's writer
    needs: str = ""  # a package that meshio needs for it and does not bring along
    cannot: str = ""  # why the format can hold no mesh of ours


_NOT_COMPRESSED = "meshio writes it without compressing: write {} and compress that"
_SVG_OPTIONS = {"float_fmt": ".12g", "image_width": None}

FORMATS: Mapping[str, MeshFormat] = {
    ".npz": MeshFormat("", dimension=2, undetermined=True),
    ".avs": MeshFormat("avsucd", cells=_ALL | _LINES),
    # Eleven significant digits are what the sixteen columns of a field hold at any sign and exponent.
    **dict.fromkeys(
        (".bdf", ".fem", ".nas"),
        MeshFormat("nastran", cells=_ALL | _HALFWAY | _LINES | {"quad9"}, data="none", digits=11),
    ),
    ".cgns": MeshFormat("cgns", cells=frozenset({"tetra"}), data="none", needs="h5py"),
    **dict.fromkeys((".dat", ".tec"), MeshFormat("tecplot", dimension=2, cells=_CELLS)),
    # meshio turns the nodes of quadratic cells when it writes this one, and not when it reads.
    **dict.fromkeys((".dato", ".post"), MeshFormat("permas", cells=_ALL | _LINES, data="none")),
    **{f"{one}.gz": MeshFormat("permas", cannot=_NOT_COMPRESSED.format(one)) for one in (".dato", ".post")},
    **dict.fromkeys(
        (".e", ".ex2", ".exo"),
        MeshFormat("exodus", cells=_EVERY | _LINES, dimension=2, undetermined=True, needs="netCDF4"),
    ),
    **dict.fromkeys((".ele", ".node"), MeshFormat("tetgen", cannot="it is two files that belong together")),
    ".f3grid": MeshFormat("flac3d", cells=_SOLID, data="none"),
    ".h5m": MeshFormat("h5m", cells=frozenset({"triangle", "tetra"}), undetermined=True, needs="h5py"),
    ".hmf": MeshFormat("hmf", cells=_EVERY | _LINES, undetermined=True, needs="h5py"),
    ".inp": MeshFormat("abaqus", cells=_CELLS | _HALFWAY | _LINES | {"quad9"}, data="none"),
    ".mdpa": MeshFormat("mdpa", cells=_EVERY | _LINES, data="none"),
    ".med": MeshFormat("med", cells=_ALL | _HALFWAY | _LINES, dimension=2, undetermined=True, needs="h5py"),
    ".mesh": MeshFormat("medit", dimension=2, cells=_CELLS | _LINES, data="boundary"),
    ".meshb": MeshFormat("medit", dimension=2, cells=_CELLS | _LINES, data="boundary", undetermined=True),
    ".msh": MeshFormat("gmsh", cells=_EVERY, undetermined=True),  # Gmsh, not ANSYS, which shares the extension
    ".obj": MeshFormat("obj", cells=_FLAT, data="none"),
    ".off": MeshFormat("off", cells=_TRIANGLES, data="none"),
    ".ply": MeshFormat("ply", cells=_FLAT | _LINES | {"vertex"}, undetermined=True),
    ".stl": MeshFormat("stl", cells=_TRIANGLES, data="none", keeps_rows=False),
    ".su2": MeshFormat("su2", dimension=2, cells=_CELLS, data="none"),
    ".svg": MeshFormat("svg", dimension=2, cells=_FLAT, data="none", keeps_rows=False, options=_SVG_OPTIONS),
    ".ugrid": MeshFormat("ugrid", cells=_CELLS, data="none", digits=7),
    # Binary variants are told by a second extension: byte order, Fortran records, size of numbers.
    **dict.fromkeys(
        (".b8l.ugrid", ".b8.ugrid", ".lb8l.ugrid", ".lb8.ugrid", ".r8.ugrid", ".lr8.ugrid"),
        MeshFormat("ugrid", cells=_CELLS, data="none", undetermined=True),
    ),
    **dict.fromkeys(
        (".b4.ugrid", ".lb4.ugrid", ".r4.ugrid", ".lr4.ugrid"),
        MeshFormat("ugrid", cells=_CELLS, data="none", undetermined=True, digits=7),
    ),
    **dict.fromkeys((".vol", ".vol.gz"), MeshFormat("netgen", cells=_ALL | _HALFWAY | _LINES, data="none")),
    ".vtk": MeshFormat("vtk", cells=_EVERY | _LINES, undetermined=True),
    ".vtu": MeshFormat("vtu", cells=_EVERY | _LINES, polygons=True, undetermined=True),
    ".wkt": MeshFormat("wkt", cells=_TRIANGLES, data="none", keeps_rows=False),
    # XML inside the one file: heavy data in a side file could not be renamed into place together with it.
    # (meshio imports h5py even then.)
    **dict.fromkeys(
        (".xdmf", ".xmf"),
        MeshFormat("xdmf", cells=_EVERY | _LINES, undetermined=True, options={"data_format": "XML"}, needs="h5py"),
    ),
    ".xml": MeshFormat("dolfin-xml", dimension=2, cells=frozenset({"triangle", "tetra"}), data="none"),
}


def format_of(path: str | os.PathLike[str]) -> tuple[str, MeshFormat]:
    """Extension and format that a file name asks for; upper and lower case are alike.

    Raises OutputError if the extension is unknown, or its writer not installed; FormatError if the format has no place
    for any mesh of ours.
    """
    name = PurePath(path).name.lower()
    fitting = [suffix for suffix in FORMATS if name.endswith(suffix) and name != suffix]
    if not fitting:
        suffix = PurePath(path).suffix.lower()
        what = f"no mesh format has the extension {suffix!r}" if suffix else "it has no extension, to name the format"
        near = [known for known in get_close_matches(suffix, FORMATS, n=3, cutoff=0.7) if not FORMATS[known].cannot]
        which = f"did you mean {' or '.join(near)}?" if near else "use .npz, .vtu, .msh, .obj or .stl, for instance"
        raise OutputError(
            f"cannot write {os.fspath(path)!r}: {what}; {which} (the list is on the page 'Command line and files' of "
            "the manual)"
        )
    suffix = max(fitting, key=len)
    mesh_format = FORMATS[suffix]
    if mesh_format.cannot:
        raise FormatError(f"the format {suffix} cannot hold a mesh: {mesh_format.cannot} (.vtu, for one, can)")
    if mesh_format.needs and find_spec(mesh_format.needs) is None:
        raise OutputError(f"the format {suffix} needs the package {mesh_format.needs}: pip install {mesh_format.needs}")
    return suffix, mesh_format


def lacks_worth(path: str | os.PathLike[str]) -> str:
    """What a list of files that were written ends with where the mesh's can say nothing of its worth; else empty."""
    suffix, mesh_format = format_of(path)
    holds = not mesh_format.name or mesh_format.data == "all"
    return "" if holds else f"; {suffix} has no place for status, uniqueness, backward error and scale"
