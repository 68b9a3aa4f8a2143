"""What there is to say about a recovery, for people: a few lines."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .recovery import Body, ConformingMesh, Mechanical, PlanarMesh, Recovery, Structure, Surface
from .tolerances import CERTIFIED, SUSPICIOUS
from .words import count_of, kind_text

_SHOWN = 3
_OTHERS = {"proved": "none fits", "searched": "none found that fits", "ambiguous": "another fits as well"}


def summary(recovery: Recovery) -> str:
    """A few aligned lines for a person."""
    lines = [f"{recovery.status}: {recovery.reason}"]
    lines += [f"  {name:<15} {value}" for name, value in _rows(recovery)]
    return "\n".join(lines)


def table(recovery: Recovery) -> list[tuple[str, str]]:
    """Names and values of what matters most: status, reason, what to do next, sizes."""
    rows = [("status", recovery.status), ("reason", recovery.reason)]
    rows += [("next", recovery.advice)] if recovery.advice else []
    return [*rows, *(row for row in _rows(recovery) if row[0] not in ("time", "note"))]


def three_lines(recovery: Recovery, files: str = "") -> str:
    """What fits, why that is not certified, and what to do next.

    Parameters
    ----------
    recovery : Recovery
        Ambiguous or uncertified.
    files : str
        Names of those that were written, the mesh first.
    """
    missing = int(np.count_nonzero(recovery.node_status))
    cells = f"{' and '.join(counted_cells(recovery))} on " if recovery.n_cells or not recovery.vector_valued else ""
    mesh = f"{cells}{count_of(recovery.n_points, 'point')}"
    mesh += f", {missing:,} of these without a position," if missing else ""
    fits = f"{mesh} give the matrix back to {recovery.backward_error:.1e} of each row's largest entry"
    if not cells or (isinstance(recovery, Structure) and recovery.operator != "truss"):  # which has no other members
        fits = f"{mesh} agree with all rows away from supports to {recovery.backward_error:.1e} (relative)"
    if isinstance(recovery, PlanarMesh) and 0 < recovery.n_fitting < recovery.n_entries:
        fits += f", and {recovery.n_fitting:,} of {recovery.n_entries:,} entries to {CERTIFIED:g} of it"
    written = f" (written: {files})" if files else ""
    after = recovery.advice or "see `report()` for all that is known"
    return f"{recovery.status}: {fits}{written}\n  why   {recovery.reason}\n  next  {after}"


def one_line(recovery: Recovery) -> str:
    """Kind, sizes, status and backward error, for a list or a prompt."""
    sizes = f"{_points(recovery, ' points')}, {', '.join(counted_cells(recovery))}"
    return (
        f"<{type(recovery).__name__}: {recovery.status}, {recovery.operator}, {sizes}, "
        f"backward error {recovery.backward_error:.1e}>"
    )


def _rows(recovery: Recovery) -> list[tuple[str, str]]:
    rows = [
        ("operator", _operator(recovery)),
        *([("chosen since", recovery.choice)] if recovery.choice else []),
        ("points", _points(recovery)),
        *_cell_rows(recovery),
        *_element_rows(recovery),
        ("pieces", _pieces(recovery)),
    ]
    if isinstance(recovery, PlanarMesh):
        rows += [("holes", f"{recovery.n_holes:,}"), ("scale c", scale_text(recovery))]
        rows += [("reaction s", f"{recovery.reaction:.10g}")] if recovery.reaction else []
    if isinstance(recovery, Surface):
        rows += _surface_rows(recovery)
    if isinstance(recovery, Mechanical):
        rows += _elastic_rows(recovery)
    rows += [("density", f"{recovery.density:.10g}")] if recovery.density is not None else []
    rows.append(("backward error", f"{recovery.backward_error:.1e} (relative)"))
    if recovery.uniqueness is not None:
        rows.append(("other meshes", _OTHERS[recovery.uniqueness]))
    if isinstance(recovery, PlanarMesh):
        rows += _noise_rows(recovery)
    if not recovery.certified and len(recovery.worst_entries):
        rows += _worst(recovery)
    if recovery.timings:
        rows.append(("time", _timings(recovery.timings)))
    return rows + [("note", warning) for warning in recovery.warnings]


def _operator(recovery: Recovery) -> str:
    if not recovery.vector_valued:
        return recovery.operator
    return f"{recovery.operator}, {recovery.block_size} unknowns per node, {numbering_text(recovery)}"


def numbering_text(recovery: Recovery) -> str:
    """How the unknowns of a vector-valued matrix stand, in words."""
    words = {"pattern": "in an order found by the pattern", "given": "in the given order"}
    return words.get(recovery.numbering, recovery.numbering)


_KINDS = {
    "line": ("member", "members"),
    "triangle": ("triangle", "triangles"),
    "quad": ("quadrilateral", "quadrilaterals"),
    "tetra": ("tetrahedron", "tetrahedra"),
    "hexahedron": ("hexahedron", "hexahedra"),
    "polygon": ("polygon", "polygons"),
    "": ("cell", "cells"),
}


def _cell_counts(recovery: Recovery) -> list[tuple[tuple[str, str], str, int]]:
    """One cell and several in words, what they have besides, and their number; triangles where there are none."""
    known = []
    for kind, cells in recovery.cells.items():
        base = kind.rstrip("0123456789")
        nodes = kind[len(base) :]  # of quadratic ones
        known.append((_KINDS[base], f" of {nodes} nodes" if nodes else "", len(cells)))
    if recovery.n_polygons:
        known.append((_KINDS["polygon"], "", recovery.n_polygons))
    return known or [(_KINDS["" if recovery.vector_valued else "triangle"], "", 0)]


def counted_cells(recovery: Recovery) -> list[str]:
    """Kinds of cells with their numbers; triangles, if there are none, of scalar matrices."""
    return [count_of(count, *kind) + more for kind, more, count in _cell_counts(recovery)]


def _cell_rows(recovery: Recovery) -> list[tuple[str, str]]:
    return [
        (several + more, f"{count:,}" if count or several != "cells" else "none recognised")
        for (_, several), more, count in _cell_counts(recovery)
    ]


def _element_rows(recovery: Recovery) -> list[tuple[str, str]]:
    if not isinstance(recovery, ConformingMesh):
        return []
    curved = "" if recovery.straight else ", with curved sides"
    return [("element", f"{recovery.element}{curved}"), ("quadrature", recovery.quadrature)]


def _noise_rows(mesh: PlanarMesh) -> list[tuple[str, str]]:
    rows = []
    if mesh.estimated_noise is not None and mesh.backward_error > SUSPICIOUS:
        rows.append(("noise", f"the misfit is that of a standard deviation of {mesh.estimated_noise:.1e} (absolute)"))
    if mesh.largest_deviation is not None:
        rows.append(("std deviation", f"at most {mesh.largest_deviation:.1e} in a coordinate (absolute)"))
    return rows


def _surface_rows(surface: Surface) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    pieces = zip(surface.euler, surface.orientable, surface.loops, strict=True)
    rows += [("surface", kind_text(*piece)) for piece in list(pieces)[:_SHOWN]]
    rows.append(("curvature", f"{np.nanmin(surface.curvature):.3g} to {np.nanmax(surface.curvature):.3g} at a vertex"))
    if surface.realisation is not None:
        text = f"edge lengths off by {surface.realisation['misfit']:.1e} (root mean square), one shape of possibly many"
        rows.append(("coordinates", text))
    rows.append(("scale c", scale_text(surface)))
    return rows


def _elastic_rows(recovery: Mechanical) -> list[tuple[str, str]]:
    rows = []
    if isinstance(recovery, Body) and recovery.poisson_ratio is not None:
        rows.append(("Poisson's ratio", f"{recovery.poisson_ratio:.10g}"))
    if np.isfinite(recovery.scale).any():
        rows.append(("shear modulus", scale_text(recovery)))
    for one in recovery.evidence[:_SHOWN]:
        text = f"dimension {one.null_dimension}, residual {one.residual:.1e}, next {one.gap:.1e}"
        rows.append(("null space", text))
    return rows


def _points(recovery: Recovery, noun: str = "") -> str:
    missing = int(np.count_nonzero(recovery.node_status))
    return f"{recovery.n_points:,}{noun}" + (f", of which {missing:,} not determined" if missing else "")


def _pieces(recovery: Recovery) -> str:
    hinges = len(recovery.hinges)
    return f"{recovery.n_components:,}" + (f", meeting in {count_of(hinges, 'hinge')}" if hinges else "")


def scale_text(recovery: Recovery, digits: int = 10) -> str:
    """The factor c, or the range of those of all pieces."""
    known = recovery.scale[np.isfinite(recovery.scale)]
    low, high = (float(f(known)) if len(known) else math.nan for f in (np.min, np.max))
    # Pieces of one matrix mostly share c, up to rounding.
    return f"{low:.{digits}g}" if high - low <= 1e-9 * abs(low) else f"{low:.{digits}g} to {high:.{digits}g}"


def _worst(recovery: Recovery) -> list[tuple[str, str]]:
    """Entries that stand out, then those that fit worst, which are often only their neighbours."""
    suspects = recovery.suspects.tolist() if isinstance(recovery, PlanarMesh) else []
    apart = set(map(tuple, suspects))
    misfits = dict(zip(map(tuple, recovery.worst_entries.tolist()), recovery.worst_misfits.tolist(), strict=True))
    rest = sorted((pair for pair in misfits if pair not in apart), key=misfits.__getitem__, reverse=True)
    named = [("stands out", pair) for pair in misfits if pair in apart][:_SHOWN]
    named += [("worst fit", pair) for pair in rest][: max(1, _SHOWN - len(named))]
    return [
        (name, f"rows {i} and {j}, off by {misfits[i, j]:.1e} of the row's largest entry") for name, (i, j) in named
    ]


def _timings(timings: Mapping[str, float]) -> str:
    stages = ", ".join(f"{stage} {seconds:.2g}" for stage, seconds in timings.items() if seconds >= 0.005)
    return f"{sum(timings.values()):.2f} s" + (f" ({stages})" if stages else "")
