"""What is said of every matrix at hand, one JSON line each, so that two versions or two arithmetics can be compared.

    python benchmarks/statuses.py OUT.jsonl [--under NAME] [--seconds 120] [--only WORD ...] [--shared ../shared]
    python benchmarks/statuses.py --compare OLD.jsonl NEW.jsonl

The matrices: every mesh of ``corpus`` below the shared folder, assembled by scikit-fem with its rows in random order
(linear triangles in the plane and on surfaces, quadrilaterals, elastic tetrahedra), the files of ``classics``, and
those of ``cases/wrong``, ``cases/codes`` and ``cases/slow``. Each is recovered in a process of its own, which ends
after so many seconds of processor time (status "too slow").

`--under` names an arithmetic of arithmetic.py, or "last bits" (each entry moved by a unit in its last place, symmetric
ones alike) or "rows anew" (another order of the rows; of vector-valued matrices another order of the nodes). The
exit status of `--compare` is 1 where a status, a uniqueness or an operator differs.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp
from skfem import MeshQuad, MeshTet, MeshTri

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / part) for part in ("", "elasticity", "metric")]

import surfaces  # noqa: E402
from arithmetic import ENVIRONMENTS, environment, perturbed  # noqa: E402
from assembled import permuted_nodes, stiffness  # noqa: E402
from supported import given as supported, judged  # noqa: E402

import meshes  # noqa: E402
from conforming.assembled import assembled as scalar  # noqa: E402
from unassemble import RecoveryError, UnassembleError, recover  # noqa: E402

MATRICES = ("last bits", "rows anew")
COMPARED = ("status", "uniqueness", "operator", "cells", "undetermined")
DECISIVE = ("status", "uniqueness", "operator")


@dataclass(frozen=True)
class Known:
    """A matrix or a file with one, and the largest error of what is found, where the mesh is known."""

    matrix: Any
    error: Callable[[Any], float] | None = None
    operator: str = "auto"


def main() -> int:
    """Write the lines, or compare those of two files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="?", help="where the lines go")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("OLD", "NEW"))
    parser.add_argument("--under", choices=[*ENVIRONMENTS, *MATRICES])
    parser.add_argument("--seconds", type=int, default=120, help="of processor time for one matrix")
    parser.add_argument("--only", nargs="+", default=[""], help="matrices whose name begins with one of these")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared")
    arguments = parser.parse_args()
    if arguments.compare:
        return compared(*map(lines_of, arguments.compare))
    if arguments.out is None:
        parser.error("say where the lines go")
    if arguments.under in ENVIRONMENTS and os.environ.get("STATUSES_UNDER") != arguments.under:
        again = environment(arguments.under) | {"STATUSES_UNDER": arguments.under}
        os.execve(sys.executable, [sys.executable, *sys.argv], again)  # libraries read it when they are loaded
    with arguments.out.open("w") as out:
        for name, known in matrices(arguments.shared, seed=int(arguments.under == "rows anew")):
            if name.startswith(tuple(arguments.only)):
                line = apart(name, known, arguments.under, arguments.seconds)
                print(json.dumps(line), file=out, flush=True)
    return 0


def matrices(shared: Path, seed: int) -> Iterator[tuple[str, Callable[[], Known]]]:
    """The name of each, and how to make it; rows are in an order of the seed."""
    kinds = {"planar": planar, "quad": quadrilaterals, "surface": surface, "tet": tetrahedra}
    for kind, make in kinds.items():
        for path in sorted((shared / "corpus" / kind).glob("*.npz")):
            yield f"{kind}/{path.stem}", lambda make=make, path=path: make(np.load(path), seed)
    for path in sorted((shared / "classics").glob("*.mtx.gz")):
        yield f"classics/{path.name.removesuffix('.mtx.gz')}", lambda path=path: Known(path)
    for folder in ("wrong", "codes", "slow"):
        for path in sorted((shared / "cases" / folder).glob("*.npz")):
            yield f"{folder}/{path.stem}", lambda path=path: Known(path)


def planar(mesh: Any, seed: int) -> Known:
    """Linear triangles in the plane."""
    known = meshes.specimen(mesh["points"][:, :2], mesh["triangles"], diagonal=True, seed=seed)
    return Known(known.matrix, lambda found: error_of_pieces(found, known.points))


def quadrilaterals(mesh: Any, seed: int) -> Known:
    """Quadrilaterals, some beside triangles."""
    points = mesh["points"][:, :2].T.copy()
    kinds = {"triangles": MeshTri, "quads": MeshQuad}
    parts = [kind(points, mesh[key].T.copy()) for key, kind in kinds.items() if key in mesh]
    known = scalar("mixed" if len(parts) > 1 else "Q1", *parts, seed=seed)
    return Known(known.matrix, lambda found: error_of_pieces(found, known.points))


def surface(mesh: Any, seed: int) -> Known:
    """Linear triangles in space, of which edge lengths come back."""
    known = surfaces.surface(mesh["points"], mesh["triangles"], seed=seed)
    return Known(known.matrix, lambda found: surfaces.largest_error(found, known.points), "surface")


def tetrahedra(mesh: Any, seed: int) -> Known:
    """An elastic body, rows at random."""
    used, place = np.unique(mesh["tets"], return_inverse=True)
    cells = place.reshape(mesh["tets"].shape).T.copy()
    body = permuted_nodes(stiffness("tet-p1", MeshTet(mesh["points"][used].T.copy(), cells)), seed)
    known = supported(body, "free", "at random", "stored", seed)
    return Known(known.matrix, lambda found: judged(found, known).error)


def error_of_pieces(found: Any, true: np.ndarray) -> float:
    """Largest error of a determined point relative to the diameter of its piece, after the best similarity."""
    known = found.node_status == 0
    pieces = [known & (found.component == label) for label in range(found.n_components)]
    errors = [meshes.largest_error(found.points[rows], true[rows]) for rows in pieces if np.count_nonzero(rows) > 2]
    return max(errors, default=0.0)


def apart(name: str, known: Callable[[], Known], under: str | None, seconds: int) -> dict[str, Any]:
    """The line of one matrix, found by a process that ends after so many seconds."""
    context = multiprocessing.get_context("fork")  # what is imported stays imported
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=lambda: theirs.send(line_of(known(), under, seconds)))
    process.start()
    theirs.close()
    try:
        line = ours.recv()
    except EOFError:
        process.join()
        line = {"status": "too slow" if process.exitcode == -24 else f"ended by {process.exitcode}"}  # SIGXCPU
    process.join()
    return {"name": name, **line}


def line_of(known: Known, under: str | None, seconds: int) -> dict[str, Any]:
    """What is said of a matrix."""
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
    matrix = known.matrix
    if under == "last bits":
        matrix = perturbed(loaded(matrix))
    if under == "rows anew" and isinstance(matrix, Path):
        matrix = in_another_order(loaded(matrix))
    start = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = recover(matrix, operator=known.operator)
    except UnassembleError as refusal:
        line = {"status": "refused", "reason": str(refusal)}
    except Exception as fault:
        line = {"status": "CRASH", "reason": repr(fault)}
    else:
        line = {
            "status": found.status,
            "uniqueness": found.uniqueness,
            "operator": found.operator,
            "backward_error": float(found.backward_error),
            "cells": found.n_cells,
            "undetermined": int(np.count_nonzero(found.node_status)),
            "error": None if known.error is None else float(known.error(found)),
            "reason": found.reason,
        }
    return line | {"seconds": round(time.process_time() - start, 2)}


def loaded(matrix: Any) -> sp.csr_array:
    """The matrix, or that of a file."""
    if isinstance(matrix, Path):
        return sp.csr_array(sp.load_npz(matrix) if matrix.suffix == ".npz" else scipy.io.mmread(matrix))
    return sp.csr_array(matrix)


def in_another_order(matrix: sp.csr_array) -> sp.csr_array:
    """Rows at random; of a vector-valued matrix nodes at random, whose rows stand as they stood."""
    order = np.random.default_rng(1).permutation(matrix.shape[0])
    try:
        found = recover(matrix)
    except RecoveryError:
        found = None
    if found is not None and found.vector_valued and found.numbering in ("interleaved", "by component"):
        turn = np.random.default_rng(1).permutation(found.n_points)[found.node_of_row]
        groups = (found.direction_of_row, turn) if found.numbering == "interleaved" else (turn, found.direction_of_row)
        order = np.lexsort(groups)  # by the last, then by the first
    return sp.csr_array(matrix[order][:, order])


def lines_of(path: Path) -> dict[str, dict[str, Any]]:
    """Lines by name."""
    return {line["name"]: line for line in map(json.loads, path.read_text().splitlines())}


def compared(old: dict[str, dict[str, Any]], new: dict[str, dict[str, Any]]) -> int:
    """Print what differs, and how many."""
    decisive = 0
    for name in [*old, *(name for name in new if name not in old)]:
        if name not in old or name not in new:
            print(f"{name:36} only in the {'first' if name in old else 'second'}")
            continue
        one, other = old[name], new[name]
        differs = [key for key in COMPARED if one.get(key) != other.get(key)]
        decisive += any(key in DECISIVE for key in differs)
        if differs:
            print(f"{name:36} " + ", ".join(f"{key}: {one.get(key)} -> {other.get(key)}" for key in differs))
    print(f"{len(old.keys() & new.keys())} in both, {decisive} of another status, uniqueness or operator")
    return int(decisive > 0)


if __name__ == "__main__":
    sys.exit(main())
