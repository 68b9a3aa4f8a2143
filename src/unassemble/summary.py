"""What there is to say about a recovery, for people: a few lines."""

import numpy as np

from .recovery import SHOWN, Recovery
from .tolerances import CERTIFIED
from .words import count_of

_OTHERS = {
    "proved": "none fits",
    "searched": "none found that fits",
    "conventional": "no other grid of equal cells fits",
    "ambiguous": "another fits as well",
}


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
    """What fits, why that is not certified, and what to do next; `files` are those written, the mesh first."""
    missing = int(np.count_nonzero(recovery.node_status))
    cells = f"{' and '.join(counted_cells(recovery))} on " if recovery.n_cells or not recovery.vector_valued else ""
    mesh = f"{cells}{count_of(recovery.n_points, 'point')}"
    mesh += f", {missing:,} of these without a position," if missing else ""
    fits = f"{mesh} give the matrix back to {recovery.backward_error:.1e} of each row's largest entry"
    if not recovery.re_assembled:
        fits = f"{mesh} agree with all rows away from supports to {recovery.backward_error:.1e} (relative)"
    if 0 < recovery.n_fitting < recovery.n_entries:
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
    operator, hinges = recovery.operator, len(recovery.hinges)
    if recovery.vector_valued:
        words = {"pattern": "in an order found by the pattern", "given": "in the given order"}
        operator += f", {recovery.block_size} unknowns per node, {words.get(recovery.numbering, recovery.numbering)}"
    rows = [
        ("operator", operator),
        *([("chosen since", recovery.choice)] if recovery.choice else []),
        ("points", _points(recovery)),
        *(
            (several + more, f"{count:,}" if count or several != "cells" else "none recognised")
            for (_, several), more, count in _cell_counts(recovery)
        ),
    ]
    meeting = f", meeting in {count_of(hinges, 'hinge')}" if hinges else ""
    rows.append(("pieces", f"{recovery.n_components:,}{meeting}"))
    rows += recovery.facts()
    rows += [("density", f"{recovery.density:.10g}")] if recovery.density is not None else []
    rows.append(("backward error", f"{recovery.backward_error:.1e} (relative)"))
    if recovery.uniqueness is not None:
        rows.append(("other meshes", _OTHERS[recovery.uniqueness]))
    if not recovery.certified:  # what stands out first; what fits worst are often only its neighbours
        suspects = recovery.suspects.tolist()
        for pair, misfit in zip(recovery.worst_entries[:SHOWN].tolist(), recovery.worst_misfits, strict=False):
            text = f"rows {pair[0]} and {pair[1]}, off by {misfit:.1e} of the row's largest entry"
            rows.append(("stands out" if pair in suspects else "worst fit", text))
    if recovery.timings:
        stages = ", ".join(f"{stage} {seconds:.2g}" for stage, seconds in recovery.timings.items() if seconds >= 0.005)
        rows.append(("time", f"{sum(recovery.timings.values()):.2f} s" + (f" ({stages})" if stages else "")))
    return rows + [("note", warning) for warning in recovery.warnings]


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


def _points(recovery: Recovery, noun: str = "") -> str:
    missing = int(np.count_nonzero(recovery.node_status))
    return f"{recovery.n_points:,}{noun}" + (f", of which {missing:,} not determined" if missing else "")
