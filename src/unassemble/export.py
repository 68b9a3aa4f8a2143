"""Write a recovered mesh: ``.npz`` for programs, or any format of meshio."""

from __future__ import annotations

import io
import logging
import os
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import FormatError
from .exchange import cells_of, mesh_for
from .files import check_target, whole_file
from .formats import MeshFormat, format_of
from .recovery import Recovery

if TYPE_CHECKING:
    import meshio

_log = logging.getLogger(__name__)


def check_output(path: str | os.PathLike[str]) -> None:
    """Raise OutputError, before long work, where a file cannot be written, or FormatError where it can hold no mesh."""
    check_target(path)
    format_of(path)


def save(recovery: Recovery, path: str | os.PathLike[str]) -> None:
    """Write a recovered mesh, whole or not at all; the extension names the format.

    ``.npz`` holds coordinates or lengths, cells, pieces, factors, what rows belong to, and what the mesh is worth, by
    the keys that the manual lists. Other formats are those of meshio (:mod:`unassemble.formats`); of these ``.vtu``
    holds polygons, the others get them divided into triangles. Those that hold point data have what the mesh is worth
    as such, see :func:`to_meshio`; the rest have no place for it, which :func:`unassemble.formats.lacks_worth` says. An
    old file is replaced.

    Raises OutputError if the file cannot be written, and an old one is then as it was; FormatError if the format cannot
    hold this mesh.
    """
    suffix, mesh_format = format_of(path)
    _check_content(recovery, suffix, mesh_format)
    with whole_file(path, suffix) as draft:
        if mesh_format.name:
            _write_by_meshio(mesh_for(recovery, mesh_format), draft, suffix, mesh_format)
        else:
            np.savez(draft, **arrays(recovery))


def arrays(recovery: Recovery) -> dict[str, Any]:
    """What the ``.npz`` holds, by key; what there is nothing of has no key."""
    content: dict[str, Any] = {} if recovery.shapeless else {"points": recovery.points}
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


def _check_content(recovery: Recovery, suffix: str, mesh_format: MeshFormat) -> None:
    if not mesh_format.name:
        return
    if recovery.shapeless:
        raise FormatError(
            f"the format {suffix} holds coordinates, and {recovery.shapeless}: write .npz{recovery.instead}"
        )
    kinds = set(cells_of(recovery)) - mesh_format.cells
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
