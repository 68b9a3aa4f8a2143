"""An inspection in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..tolerances import ROUNDED
from ..words import count_of

if TYPE_CHECKING:
    from .inspect import Inspection


def lines_of(facts: Inspection) -> list[tuple[str, str]]:
    """Names and values, in the order in which they are shown."""
    lines = [
        ("matrix", f"{count_of(facts.n_rows, 'row')}, {_above(facts.n_edges)} above the diagonal"),
        ("symmetry", _symmetry(facts.asymmetry)),
        ("graph", _graph(facts)),
        ("vanished", _vanished(facts.n_vanished)),
        ("row sums", _row_sums(facts)),
        ("surface", facts.surface) if facts.surface else ("planar", _planar(facts)),
    ]
    if facts.n_nodes:
        nodes = f"{count_of(facts.n_nodes, 'node')} with {facts.block_size} unknowns each, {facts.numbering}"
        lines.append(("nodes", nodes))
    if facts.surface:
        lines += [("mesh", mesh_text(facts)), ("pieces", _pieces(facts))]
    elif facts.element:
        lines += [
            ("element", f"{facts.element}, {element_text(facts)}"),
            ("mesh", f"{mesh_text(facts)}, {count_of(facts.n_boundary_edges, 'side')} on the boundary"),
            ("holes", f"{facts.n_holes:,}"),
            ("pieces", f"{facts.n_pieces:,}"),
        ]
    elif not facts.obstacle:
        lines += [
            ("mesh", _mesh(facts)),
            ("cells", _cells(facts)),
            ("holes", f"{facts.n_holes:,}"),
            ("pieces", _pieces(facts)),
        ]
        lines.append(("scale c", _scale(facts)))
    lines.append(("operator", facts.operator))
    lines += [("evidence", one) for one in facts.evidence]
    lines.append(("recoverable", facts.recoverable))
    return lines + [("note", warning) for warning in facts.warnings]


def _above(number: int) -> str:
    return count_of(number, "off-diagonal entry", "off-diagonal entries")


def _symmetry(asymmetry: float) -> str:
    if not asymmetry:
        return "symmetric"
    return "symmetric up to rounding" if asymmetry <= ROUNDED else f"symmetric up to {asymmetry:.1e}"


def _vanished(number: int) -> str:
    return count_of(number, "of these is", "of these are") + " zero up to rounding" if number else "none of these"


def _graph(facts: Inspection) -> str:
    isolated = f", and {count_of(facts.n_isolated, 'isolated row')}" if facts.n_isolated else ""
    return f"{count_of(facts.n_connected, 'connected piece')}{isolated}"


def _row_sums(facts: Inspection) -> str:
    used = facts.n_rows - facts.n_isolated
    if facts.n_zero_sums == used:
        return "zero"
    return f"zero in {facts.n_zero_sums:,} of {used:,} rows only" if facts.n_zero_sums else "not zero"


def _planar(facts: Inspection) -> str:
    if facts.planar:
        return "yes"
    if facts.element:
        return "no, but rows that are all coupled to each other form cells"
    if facts.kind == "mass":
        return "not looked for, since the matrix has no shape"
    if facts.n_nodes:
        return "not looked for, since the rows form nodes of several unknowns"
    return "no"


def mesh_text(facts: Inspection) -> str:
    """The cells; likely ones where they are not the graph's triangles."""
    cells = []
    if facts.n_triangles or not (facts.n_polygons or facts.n_quads):
        cells.append(count_of(facts.n_triangles, "triangle"))
    if facts.n_quads:
        cells.append(count_of(facts.n_quads, "quadrilateral"))
    if facts.n_polygons:
        cells.append(f"{count_of(facts.n_polygons, 'cell')} of more than three vertices")
    likely = facts.cells_from == "entries" and not facts.element
    return ("likely " if likely else "") + " and ".join(cells)


_ELEMENTS = {
    "P2": "quadratic triangles",
    "P3": "cubic triangles",
    "Q1": "bilinear quadrilaterals",
    "Q2": "biquadratic quadrilaterals",
    "S2": "serendipity quadrilaterals of eight nodes",
    "mixed": "linear triangles and bilinear quadrilaterals",
}


def element_text(facts: Inspection) -> str:
    """The element of a scalar matrix in words."""
    return _ELEMENTS[facts.element]


def _cells(facts: Inspection) -> str:
    if facts.cells_from == "graph":
        return "the cycles of three edges; recovery holds them against the entries, and leaves some open if it has to"
    gone = []
    if facts.n_polygons:
        gone.append(f"the diagonals of {count_of(facts.n_polygons, 'cell')}")
    if facts.n_vanished_sides:
        gone.append(f"{count_of(facts.n_vanished_sides, 'side')} of the boundary, facing right angles")
    vanished = f"; no entry on {' and on '.join(gone)}" if gone else ""
    return f"read from the entries, since the graph does not settle them{vanished}; recovery begins with these"


def _mesh(facts: Inspection) -> str:
    text = (
        f"{mesh_text(facts)}, {count_of(facts.n_faces, 'face')} with the outside and the holes, "
        f"{count_of(facts.n_boundary_edges, 'boundary edge')}"
    )
    if facts.n_bare_edges:
        text += f"; {count_of(facts.n_bare_edges, 'edge')} of no cell"
    return text + (f"; {count_of(facts.n_undetermined, 'row')} of no cell" if facts.n_undetermined else "")


def _pieces(facts: Inspection) -> str:
    return f"{facts.n_pieces:,}" + (f", joined by {count_of(facts.n_hinges, 'hinge')}" if facts.n_hinges else "")


def _scale(facts: Inspection) -> str:
    known = facts.scale[np.isfinite(facts.scale)]
    if not len(known):
        return "cannot be estimated: the entries add up to zero"
    low, high = float(known.min()), float(known.max())
    about = f"about {low:.2g}" if high - low <= 0.1 * abs(low) else f"about {low:.2g} to {high:.2g}"
    if facts.mixed_signs:
        return f"{about}, but of the other sign in row {facts.mixed_signs[0]}"
    return f"{about}, of one sign in every row" + (" of a piece" if facts.n_pieces > 1 else "")
