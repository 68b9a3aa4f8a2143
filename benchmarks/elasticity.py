"""Coordinates from elasticity matrices: time and memory beside PyAMG's, and growth with the number of nodes.

Run ``python benchmarks/elasticity.py``; options ``--sizes 10 15 31`` (vertices per edge of the cube), ``--kinds
tet-p1 hex-q1``, ``--peers cells plain block true recovered``, ``--folder F`` (keeps the matrices there for the next
run), ``--materials one cells`` (homogeneous; both Lame coefficients of each cell at random between 1 and 5),
``--supports clamp symmetry``. Each case is a cube assembled by scikit-fem with as many quadrature points as the element
needs, inner vertices moved at random. All unknowns of one face are eliminated, or one direction on each of three faces,
where nodes are no blocks any more and only ``cells`` and ``plain`` run; there all entries of blocks are stored, as most
codes do. The peer is PyAMG's smoothed aggregation with conjugate gradients to 1e-8 on the same matrix: with its
defaults on the scalar matrix, with the block size, and with true and recovered rigid-body modes. ``cells`` is the
recovery once more, with elements.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import perf_counter

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))


def assemble(kind: str, size: int, material: str, support: str, path: Path) -> None:
    """Write matrix and true points of a cube that is held."""
    from assembled import box, eliminated, on_plane, stiffness
    from supported import with_zeros

    mesh = box(kind, (size,) * 3, perturb=0.2)
    cells = mesh.t.shape[1]
    lam, mu = np.random.default_rng(1).uniform(1, 5, (2, cells, 1)) if material == "cells" else (1.0, 1.0)
    case = stiffness(kind, mesh, lam=lam, mu=mu, intorder={"tet-p1": 1, "hex-q1": 3}.get(kind))
    if support == "clamp":
        gone = np.repeat(on_plane(case, 0)[:, None], 3, axis=1)
    else:
        gone = np.column_stack([on_plane(case, axis) for axis in range(3)])
        case = replace(case, matrix=with_zeros(case.matrix, 3, "stored"))
    matrix, nodes = eliminated(case, gone)
    np.savez(path, data=matrix.data, indices=matrix.indices, indptr=matrix.indptr, points=case.points[nodes])


def load(path: Path) -> tuple[sp.csr_array, np.ndarray]:
    file = np.load(path)
    return sp.csr_array((file["data"], file["indices"], file["indptr"])), file["points"]


def peak() -> float:
    """MiB this process has used at most (its own: getrusage would count its parent's)."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def measure_recovery(path: Path, cells: bool) -> dict:
    from assembled import recover_elasticity

    matrix, points = load(path)
    before, start = peak(), perf_counter()
    found = recover_elasticity(matrix, cells=cells)
    seconds = perf_counter() - start
    a, b = found.points, points - points.mean(axis=0)
    a = a - a.mean(axis=0)
    scale = (a * b).sum() / (a * a).sum()
    error = np.linalg.norm(scale * a - b, axis=1).max() / np.linalg.norm(np.ptp(b, axis=0))
    return {
        "nodes": len(points), "seconds": seconds, "memory": peak() - before, "error": float(error),
        "status": found.status, "cells": found.n_cells, "timings": dict(found.timings),
    }  # fmt: skip


def measure_pyamg(path: Path, near_null: str) -> dict:
    import pyamg

    matrix, points = load(path)
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    given: dict = {}
    if near_null in ("true", "recovered"):
        from assembled import recover_elasticity

        from unassemble.modes import rigid_body_modes

        row = np.arange(matrix.shape[0])
        if near_null == "recovered":
            found = recover_elasticity(matrix, cells=False)
            given = {"B": rigid_body_modes(found.points, found.node_of_row, found.direction_of_row)}
        else:
            given = {"B": rigid_body_modes(points, row // 3, row % 3)}
    before, start = peak(), perf_counter()
    operator = sp.csr_matrix(matrix) if near_null == "plain" else sp.bsr_matrix(matrix, blocksize=(3, 3))
    solver = pyamg.smoothed_aggregation_solver(operator, **given)
    residuals: list = []
    solver.solve(rhs, tol=1e-8, accel="cg", residuals=residuals, maxiter=1000)
    return {"seconds": perf_counter() - start, "memory": peak() - before, "iterations": len(residuals) - 1}


def in_process(*arguments: str) -> dict:
    """Each measurement in a process of its own, so that memory peaks do not mix."""
    done = subprocess.run([sys.executable, __file__, *arguments], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", nargs="+", type=int, default=[10, 15, 22, 31])
    parser.add_argument("--kinds", nargs="+", default=["tet-p1", "hex-q1"])
    parser.add_argument("--peers", nargs="+", default=["cells", "plain", "block", "true", "recovered"])
    parser.add_argument("--materials", nargs="+", default=["one"], choices=["one", "cells"])
    parser.add_argument("--supports", nargs="+", default=["clamp"], choices=["clamp", "symmetry"])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--assemble", action="store_true", help="only fill the folder")
    parser.add_argument("--one", nargs="+")
    chosen = parser.parse_args()
    if chosen.one:
        what, path = chosen.one[0], Path(chosen.one[1])
        own = what in ("recover", "cells")
        print(json.dumps(measure_recovery(path, what == "cells") if own else measure_pyamg(path, what)))
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        folder.mkdir(exist_ok=True)
        for kind, size, material, support in product(chosen.kinds, chosen.sizes, chosen.materials, chosen.supports):
            path = folder / f"{kind}-{size}-{material}-{support}.npz"
            peers = [one for one in chosen.peers if support == "clamp" or one in ("cells", "plain")]
            if not path.exists():
                assemble(kind, size, material, support, path)
            if not chosen.assemble:
                print(line(f"{kind} {material} {support}", path, peers), flush=True)


def line(kind: str, path: Path, peers: list[str]) -> str:
    """Measure one case and put it into words."""
    mine = in_process("--one", "recover", str(path))
    text = (
        f"{kind:12} {mine['nodes']:7d} nodes: coordinates {mine['seconds']:6.2f} s {mine['memory']:6.0f} MiB, "
        f"error {mine['error']:.0e}, {mine['status']}"
    )
    for name in peers:
        one = in_process("--one", name, str(path))
        if name == "cells":
            text += f"; with {one['cells']} cells {one['seconds']:.2f} s {one['memory']:.0f} MiB"
        else:
            text += f"; PyAMG {name} {one['seconds']:.2f} s {one['memory']:.0f} MiB {one['iterations']} it"
    return text


if __name__ == "__main__":
    main()
