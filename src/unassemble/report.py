"""What there is to say about a recovery: for programs as JSON, for people as a few lines."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from ._version import __version__
from .errors import OutputError, UnassembleError
from .files import check_target, whole_file

if TYPE_CHECKING:
    from .recovery import Recovery

_SHOWN = 3


def build_report(recovery: Recovery) -> dict[str, Any]:
    """Everything but the mesh, made of what JSON knows; numbers that are not finite become None.

    Keys: ``status``, ``reason``, ``operator``, ``n_points``, ``n_cells``, ``n_components``, ``n_holes``, ``scale`` (one
    for each piece), ``backward_error``, ``timings`` (seconds by stage), ``warnings``; further ``n_polygons``
    (cells that the matrix leaves undivided), ``n_hinges``,
    ``n_undetermined``, ``n_boundary_edges``, ``worst_entries`` (``row``, ``column``, ``misfit``, worst first),
    ``suspects`` (``row``, ``column``), ``alternatives`` (where other cells fit as well: ``cells`` and
    ``other_cells``, lists of rows; the rows ``around`` which they lie, and others in the order ``found`` and in that
    of the ``other`` mesh; ``same_scale``, whether both have the same c), ``chi_square``, ``estimated_noise``,
    ``largest_standard_deviation`` and ``version``. Vector-valued matrices have those of :func:`_vector_facts` too.
    """
    return _plain(
        {
            "status": recovery.status,
            "reason": recovery.reason,
            "operator": recovery.operator,
            "n_points": recovery.n_points,
            "n_cells": recovery.n_cells,
            "n_polygons": recovery.n_polygons,
            "n_components": recovery.n_components,
            "n_holes": recovery.n_holes,
            "n_hinges": len(recovery.hinges),
            "n_undetermined": np.count_nonzero(recovery.node_status),
            "n_boundary_edges": len(recovery.boundary),
            "scale": recovery.scale,
            "backward_error": recovery.backward_error,
            "chi_square": recovery.chi_square,
            "estimated_noise": recovery.estimated_noise,
            "largest_standard_deviation": _largest_deviation(recovery),
            "worst_entries": [
                {"row": i, "column": j, "misfit": misfit}
                for (i, j), misfit in zip(recovery.worst_entries, recovery.worst_misfits, strict=True)
            ],
            "suspects": [{"row": i, "column": j} for i, j in recovery.suspects],
            "alternatives": [asdict(other) for other in recovery.alternatives],
            **(_vector_facts(recovery) if recovery.vector_valued else {}),
            "timings": recovery.timings,
            "warnings": recovery.warnings,
            "version": __version__,
        }
    )


def _vector_facts(recovery: Recovery) -> dict[str, Any]:
    """What only vector-valued matrices have.

    ``dimension`` of space, ``block_size``, ``numbering``, ``operator_choice`` (why, if nobody said), ``cells`` (number
    by kind), ``poisson_ratio``, and for each piece in ``evidence`` the dimension of the null space, the singular value
    of the coordinates and that of the best field that is none of them.
    """
    return {
        "dimension": recovery.dim,
        "block_size": _block_size(recovery),
        "numbering": recovery.numbering,
        "operator_choice": recovery.choice,
        "cells": {kind: len(cells) for kind, cells in recovery.cells.items()},
        "poisson_ratio": recovery.poisson_ratio,
        "evidence": [asdict(one) for one in recovery.evidence],
    }


def _block_size(recovery: Recovery) -> int:
    direction = recovery.direction_of_row
    return 1 if direction is None else int(direction.max()) + 1


def failure_report(error: UnassembleError) -> dict[str, Any]:
    """The report of a matrix from which nothing could be recovered: the same keys, mostly empty."""
    empty = dict.fromkeys(("operator", "n_points", "n_cells", "n_components", "n_holes", "scale", "backward_error"))
    return {"status": "failed", "reason": str(error), **empty, "timings": {}, "warnings": [], "version": __version__}


def check_report(path: str | os.PathLike[str]) -> None:
    """Find out, before long work, whether a report can be written.

    Raises
    ------
    OutputError
        If the extension is not ``.json``, or the file cannot be written.
    """
    suffix = PurePath(path).suffix.lower()
    if suffix == ".html":
        raise OutputError("reports in HTML are not available in this version: name a .json file")
    if suffix != ".json":
        raise OutputError(f"a report is a .json file, not {os.fspath(path)!r}")
    check_target(path)


def write_report(recovery: Recovery | Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a report as ``.json``, whole or not at all.

    Parameters
    ----------
    recovery : Recovery or mapping
        A mapping is a report that is already built.
    path : path

    Raises
    ------
    OutputError
        See :func:`check_report`.
    """
    check_report(path)
    report = recovery if isinstance(recovery, Mapping) else build_report(recovery)
    text = json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False)
    with whole_file(path, ".json") as draft:
        draft.write_text(text + "\n", encoding="utf-8")


def summary(recovery: Recovery) -> str:
    """A few aligned lines for a person."""
    lines = [f"{recovery.status}: {recovery.reason}"]
    lines += [f"  {name:<15} {value}" for name, value in _rows(recovery)]
    return "\n".join(lines)


def _rows(recovery: Recovery) -> list[tuple[str, str]]:
    rows = [
        ("operator", _operator(recovery)),
        *([("chosen since", recovery.choice)] if recovery.choice else []),
        ("points", _points(recovery)),
        *_cell_rows(recovery),
        ("pieces", _pieces(recovery)),
    ]
    if recovery.n_holes is not None:
        rows.append(("holes", f"{recovery.n_holes:,}"))
    if recovery.mechanical:
        rows += _elastic_rows(recovery)
    else:
        rows.append(("scale c", scale_text(recovery)))
    rows.append(("backward error", f"{recovery.backward_error:.1e}"))
    if recovery.estimated_noise is not None and recovery.backward_error > 1e-12:
        rows.append(("noise", f"the misfit is that of a standard deviation of {recovery.estimated_noise:.1e}"))
    deviation = _largest_deviation(recovery)
    if deviation is not None:
        rows.append(("std deviation", f"at most {deviation:.1e} in a coordinate"))
    if recovery.status == "uncertified" and len(recovery.worst_entries):
        rows += [("worst fit", line) for line in _worst(recovery)]
    if recovery.timings:
        rows.append(("time", _timings(recovery.timings)))
    return rows + [("note", warning) for warning in recovery.warnings]


def _operator(recovery: Recovery) -> str:
    if not recovery.vector_valued:
        return recovery.operator
    return f"{recovery.operator}, {_block_size(recovery)} unknowns per node, {numbering_text(recovery)}"


def numbering_text(recovery: Recovery) -> str:
    """How the unknowns of a vector-valued matrix stand, in words."""
    words = {"pattern": "in an order found by the pattern", "given": "in the given order"}
    return words.get(recovery.numbering, recovery.numbering)


_KINDS = {
    "line": "members",
    "triangle": "triangles",
    "quad": "quadrilaterals",
    "tetra": "tetrahedra",
    "hexahedron": "hexahedra",
}


def _kind_text(kind: str) -> str:
    """Cells of a meshio kind in words, with the number of nodes of quadratic ones."""
    base = kind.rstrip("0123456789")
    nodes = kind[len(base) :]
    return _KINDS[base] + (f" of {nodes} nodes" if nodes else "")


def cells_text(recovery: Recovery) -> list[tuple[str, int]]:
    """Kinds of cells and their numbers; triangles, if there are none, of scalar matrices."""
    known = [(_kind_text(kind), len(cells)) for kind, cells in recovery.cells.items()]
    if recovery.n_polygons:
        known.append(("polygons", recovery.n_polygons))
    return known or [("cells" if recovery.vector_valued else "triangles", 0)]


def _cell_rows(recovery: Recovery) -> list[tuple[str, str]]:
    return [(kind, f"{count:,}" if count or kind != "cells" else "none recognised") for kind, count in
            cells_text(recovery)]  # fmt: skip


def _elastic_rows(recovery: Recovery) -> list[tuple[str, str]]:
    rows = []
    if recovery.poisson_ratio is not None:
        rows.append(("Poisson's ratio", f"{recovery.poisson_ratio:.10g}"))
    if np.isfinite(recovery.scale).any():
        rows.append(("shear modulus", scale_text(recovery)))
    for one in recovery.evidence[:_SHOWN]:
        text = f"dimension {one.null_dimension}, residual {one.residual:.1e}, next {one.gap:.1e}"
        rows.append(("null space", text))
    return rows


def _points(recovery: Recovery) -> str:
    missing = int(np.count_nonzero(recovery.node_status))
    return f"{recovery.n_points:,}" + (f", of which {missing:,} not determined" if missing else "")


def _pieces(recovery: Recovery) -> str:
    hinges = len(recovery.hinges)
    return f"{recovery.n_components:,}" + (f", meeting in {hinges:,} hinge{'s' * (hinges > 1)}" if hinges else "")


def scale_text(recovery: Recovery, digits: int = 10) -> str:
    """The factor c, or the range of those of all pieces."""
    known = recovery.scale[np.isfinite(recovery.scale)]
    low, high = (float(f(known)) if len(known) else math.nan for f in (np.min, np.max))
    # Pieces of one matrix mostly share c, up to rounding.
    return f"{low:.{digits}g}" if high - low <= 1e-9 * abs(low) else f"{low:.{digits}g} to {high:.{digits}g}"


def _worst(recovery: Recovery) -> list[str]:
    pairs = zip(recovery.worst_entries[:_SHOWN], recovery.worst_misfits[:_SHOWN], strict=True)
    return [f"rows {i} and {j}, off by {misfit:.1e} of the row's largest entry" for (i, j), misfit in pairs]


def _timings(timings: Mapping[str, float]) -> str:
    stages = ", ".join(f"{stage} {seconds:.2g}" for stage, seconds in timings.items() if seconds >= 0.005)
    return f"{sum(timings.values()):.2f} s" + (f" ({stages})" if stages else "")


def _largest_deviation(recovery: Recovery) -> float | None:
    deviations = recovery.standard_deviations
    if deviations is None or not np.isfinite(deviations).any():
        return None
    return float(np.nanmax(deviations))


def _plain(value: Any) -> Any:
    """Nothing but dict, list, str, bool, int, finite float and None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
