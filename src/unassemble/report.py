"""What there is to say about a recovery, for programs: JSON."""

import json
import math
import os
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from ._version import __version__
from .errors import OutputError, UnassembleError
from .files import check_target, whole_file
from .recovery import Recovery

_SHARED = (
    *("status", "uniqueness", "reason", "advice", "operator", "element", "reaction", "density"),
    *("n_points", "n_cells", "n_polygons", "n_components", "scale", "backward_error"),
)


def build_report(recovery: Recovery) -> dict[str, Any]:
    """Everything but the mesh, by the keys that the manual lists; numbers that are not finite become None."""
    known: dict[str, Any] = {name: getattr(recovery, name) for name in _SHARED}
    known |= {
        "n_holes": getattr(recovery, "n_holes", None),
        "n_hinges": len(recovery.hinges),
        "n_undetermined": np.count_nonzero(recovery.node_status),
        "n_boundary_edges": len(recovery.boundary),
        "worst_entries": [
            {"row": i, "column": j, "misfit": misfit}
            for (i, j), misfit in zip(recovery.worst_entries, recovery.worst_misfits, strict=True)
        ],
    }
    known |= recovery.entries_of_report()
    if recovery.vector_valued:
        known |= {
            "dimension": recovery.dim,
            "block_size": recovery.block_size,
            "numbering": recovery.numbering,
            "operator_choice": recovery.choice,
            "cells": {kind: len(cells) for kind, cells in recovery.cells.items()},
        }
    return _plain(known | {"timings": recovery.timings, "warnings": recovery.warnings, "version": __version__})


def failure_report(error: UnassembleError) -> dict[str, Any]:
    """The report of a matrix from which nothing could be recovered: the same keys, mostly empty."""
    sizes = ("n_points", "n_cells", "n_components", "n_holes")
    empty = dict.fromkeys(("uniqueness", "operator", "element", "reaction", *sizes, "scale", "backward_error"))
    return {"status": "failed", "reason": str(error), **empty, "timings": {}, "warnings": [], "version": __version__}


def check_report(path: str | os.PathLike[str]) -> None:
    """Raise OutputError, before long work, where a report cannot be written, or its extension is not ``.json``."""
    if PurePath(path).suffix.lower() != ".json":
        raise OutputError(f"a report is a .json file, not {os.fspath(path)!r}")
    check_target(path)


def write_report(recovery: Recovery | Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a report, or that of a recovery, as ``.json``, whole or not at all; errors as :func:`check_report`."""
    check_report(path)
    report = recovery if isinstance(recovery, Mapping) else build_report(recovery)
    with whole_file(path, ".json") as draft:
        draft.write_text(json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    """Nothing but dict, list, str, bool, int, finite float and None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
