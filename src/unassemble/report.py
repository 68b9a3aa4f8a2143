"""What there is to say about a recovery, for programs: JSON."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import PurePath
from typing import Any

import numpy as np

from ._version import __version__
from .errors import OutputError, UnassembleError
from .files import check_target, whole_file
from .recovery import Body, ConformingMesh, Mechanical, PlanarMesh, Recovery, Surface


def build_report(recovery: Recovery) -> dict[str, Any]:
    """Everything but the mesh, made of what JSON knows; numbers that are not finite become None.

    Keys: ``status``, ``uniqueness``, ``reason``, ``advice`` (what to do next), ``operator``, ``element``,
    ``reaction``, ``density`` (beside a mass matrix), ``n_points``, ``n_cells``,
    ``n_components``, ``n_holes`` (null but for planar meshes), ``scale`` (one for each piece), ``backward_error``,
    ``timings`` (seconds by stage), ``warnings``; further ``n_polygons`` (cells that the matrix leaves undivided),
    ``n_hinges``, ``n_undetermined``, ``n_boundary_edges``, ``worst_entries`` (``row``, ``column``, ``misfit``, worst
    first), ``version``, ``quadrature`` (of elements other than linear triangles), and those of :func:`_planar_facts`,
    :func:`_surface_facts`, :func:`_vector_facts` and :func:`_mechanical_facts`.
    """
    return _plain(
        {
            "status": recovery.status,
            "uniqueness": recovery.uniqueness,
            "reason": recovery.reason,
            "advice": recovery.advice,
            "operator": recovery.operator,
            "element": recovery.element,
            "reaction": recovery.reaction,
            "density": recovery.density,
            "n_points": recovery.n_points,
            "n_cells": recovery.n_cells,
            "n_polygons": recovery.n_polygons,
            "n_components": recovery.n_components,
            "n_holes": recovery.n_holes if isinstance(recovery, PlanarMesh) else None,
            "n_hinges": len(recovery.hinges),
            "n_undetermined": np.count_nonzero(recovery.node_status),
            "n_boundary_edges": len(recovery.boundary),
            "scale": recovery.scale,
            "backward_error": recovery.backward_error,
            "worst_entries": [
                {"row": i, "column": j, "misfit": misfit}
                for (i, j), misfit in zip(recovery.worst_entries, recovery.worst_misfits, strict=True)
            ],
            **(_planar_facts(recovery) if isinstance(recovery, PlanarMesh) else {}),
            **(_surface_facts(recovery) if isinstance(recovery, Surface) else {}),
            **({"quadrature": recovery.quadrature} if isinstance(recovery, ConformingMesh) else {}),
            **(_vector_facts(recovery) if recovery.vector_valued else {}),
            **(_mechanical_facts(recovery) if isinstance(recovery, Mechanical) else {}),
            "timings": recovery.timings,
            "warnings": recovery.warnings,
            "version": __version__,
        }
    )


def _planar_facts(mesh: PlanarMesh) -> dict[str, Any]:
    """What only planar meshes have.

    ``chi_square``, ``estimated_noise``, ``n_entries`` above the diagonal and ``n_fitting`` of these to 1e-9 of their
    row's largest, ``largest_standard_deviation``, ``suspects`` (``row``, ``column``) and
    ``alternatives``, where other cells fit as well: ``cells`` and ``other_cells``, lists of rows.
    """
    return {
        "chi_square": mesh.chi_square,
        "estimated_noise": mesh.estimated_noise,
        "n_entries": mesh.n_entries,
        "n_fitting": mesh.n_fitting,
        "largest_standard_deviation": mesh.largest_deviation,
        "suspects": [{"row": i, "column": j} for i, j in mesh.suspects],
        "alternatives": [asdict(other) for other in mesh.alternatives],
    }


def _surface_facts(surface: Surface) -> dict[str, Any]:
    """What only surfaces have.

    One for each piece: ``euler_characteristic``, ``orientable``, ``genus`` (of pieces that are not orientable the
    number of cross-caps), ``n_boundary_loops`` and ``total_curvature``, over 2 pi, which is the Euler characteristic by
    the theorem of Gauss and Bonnet; ``n_edges``; ``chi_square``, ``largest_standard_deviation`` of a length, with
    noise; ``realisation``, if coordinates were asked for: ``misfit``,
    ``largest`` and ``misfits``.
    """
    return {
        "n_edges": len(surface.edges),
        "euler_characteristic": surface.euler,
        "orientable": surface.orientable,
        "genus": surface.genus,
        "n_boundary_loops": surface.loops,
        "largest_curvature": float(np.nanmax(np.abs(surface.curvature))),
        "chi_square": surface.chi_square,
        "largest_standard_deviation": None
        if surface.length_deviations is None
        else float(np.nanmax(surface.length_deviations)),
        "realisation": surface.realisation,
    }


def _vector_facts(recovery: Recovery) -> dict[str, Any]:
    """What only vector-valued matrices have.

    ``dimension`` of space, ``block_size``, ``numbering``, ``operator_choice`` (why, if nobody said) and ``cells``
    (number by kind).
    """
    return {
        "dimension": recovery.dim,
        "block_size": recovery.block_size,
        "numbering": recovery.numbering,
        "operator_choice": recovery.choice,
        "cells": {kind: len(cells) for kind, cells in recovery.cells.items()},
    }


def _mechanical_facts(recovery: Mechanical) -> dict[str, Any]:
    """What only bodies and structures have.

    ``poisson_ratio``, ``position_error`` (of entries with few digits), and for each piece in ``evidence`` the dimension
    of the null space, the singular value of the coordinates and that of the best field that is none of them.
    """
    return {
        "poisson_ratio": recovery.poisson_ratio if isinstance(recovery, Body) else None,
        "position_error": recovery.position_error,
        "evidence": [asdict(one) for one in recovery.evidence],
    }


def failure_report(error: UnassembleError) -> dict[str, Any]:
    """The report of a matrix from which nothing could be recovered: the same keys, mostly empty."""
    sizes = ("n_points", "n_cells", "n_components", "n_holes")
    empty = dict.fromkeys(("uniqueness", "operator", "element", "reaction", *sizes, "scale", "backward_error"))
    return {"status": "failed", "reason": str(error), **empty, "timings": {}, "warnings": [], "version": __version__}


def check_report(path: str | os.PathLike[str]) -> None:
    """Find out, before long work, whether a report can be written.

    Raises
    ------
    OutputError
        If the extension is not ``.json``, or the file cannot be written.
    """
    if PurePath(path).suffix.lower() != ".json":
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
