"""An inspection in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..tolerances import ROUNDED
from ..words import count_of

if TYPE_CHECKING:
    from .inspection import Inspection


def lines_of(facts: Inspection) -> list[tuple[str, str]]:
    """Names and values, in the order in which they are shown."""
    above = count_of(facts.n_edges, "off-diagonal entry", "off-diagonal entries")
    off = "rounding" if facts.asymmetry <= ROUNDED else f"{facts.asymmetry:.1e}"
    isolated = f", and {count_of(facts.n_isolated, 'isolated row')}" if facts.n_isolated else ""
    gone = f"{count_of(facts.n_vanished, 'of these is', 'of these are')} zero up to rounding"
    used, zero = facts.n_rows - facts.n_isolated, facts.n_zero_sums
    lines = [
        ("matrix", f"{count_of(facts.n_rows, 'row')}, {above} above the diagonal"),
        ("symmetry", f"symmetric up to {off}" if facts.asymmetry else "symmetric"),
        ("graph", f"{count_of(facts.n_connected, 'connected piece')}{isolated}"),
        ("vanished", gone if facts.n_vanished else "none of these"),
        ("row sums", "zero" if zero == used else f"zero in {zero:,} of {used:,} rows only" if zero else "not zero"),
        ("surface", facts.surface) if facts.surface else ("planar", _planar(facts)),
    ]
    if facts.n_nodes:
        nodes = f"{count_of(facts.n_nodes, 'node')} with {facts.block_size} unknowns each, {facts.numbering}"
        lines.append(("nodes", nodes))
    pieces = f"{facts.n_pieces:,}" + (f", joined by {count_of(facts.n_hinges, 'hinge')}" if facts.n_hinges else "")
    holes = [("holes", f"{facts.n_holes:,}"), ("pieces", pieces)]
    if facts.surface:
        lines += [("mesh", mesh_text(facts)), ("pieces", pieces)]
    elif facts.element:
        sides = f"{count_of(facts.n_boundary_edges, 'side')} on the boundary"
        lines += [("element", f"{facts.element}, {ELEMENTS[facts.element]}"), ("mesh", f"{mesh_text(facts)}, {sides}")]
        lines += holes
    elif not facts.obstacle:
        left_over = {"edge": facts.n_bare_edges, "row": facts.n_undetermined}
        more = [f"; {count_of(count, one)} of no cell" for one, count in left_over.items() if count]
        mesh = "".join([f"{mesh_text(facts)}, {count_of(facts.n_boundary_edges, 'boundary edge')}", *more])
        lines += [("mesh", mesh), ("cells", _cells(facts)), *holes]
    lines.append(("operator", facts.operator))
    lines += [("evidence", one) for one in facts.evidence]
    lines.append(("recoverable", facts.recoverable))
    return lines + [("note", warning) for warning in facts.warnings]


def _planar(facts: Inspection) -> str:
    if facts.planar:
        return "yes"
    if facts.element:
        return "no, but rows that are all coupled to each other form cells"
    return "not looked for, since the rows form nodes of several unknowns" if facts.n_nodes else "no"


def mesh_text(facts: Inspection) -> str:
    """The cells; likely ones where they are not the graph's triangles."""
    several = f"{count_of(facts.n_polygons, 'cell')} of more than three vertices" if facts.n_polygons else ""
    quads = count_of(facts.n_quads, "quadrilateral") if facts.n_quads else ""
    triangles = count_of(facts.n_triangles, "triangle") if facts.n_triangles or not (several or quads) else ""
    cells = filter(None, (triangles, quads, several))
    return "likely " * (facts.cells_from == "entries" and not facts.element) + " and ".join(cells)


ELEMENTS = {
    "P2": "quadratic triangles",
    "P3": "cubic triangles",
    "Q1": "bilinear quadrilaterals",
    "Q2": "biquadratic quadrilaterals",
    "S2": "serendipity quadrilaterals of eight nodes",
    "mixed": "linear triangles and bilinear quadrilaterals",
}


def _cells(facts: Inspection) -> str:
    if facts.cells_from == "graph":
        return "the cycles of three edges; recovery holds them against the entries, and leaves some open if it has to"
    gone = [f"the diagonals of {count_of(facts.n_polygons, 'cell')}"] if facts.n_polygons else []
    if facts.n_vanished_sides:
        gone.append(f"{count_of(facts.n_vanished_sides, 'side')} of the boundary, facing right angles")
    vanished = f"; no entry on {' and on '.join(gone)}" if gone else ""
    return f"read from the entries, since the graph does not settle them{vanished}; recovery begins with these"
