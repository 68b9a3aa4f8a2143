"""Coordinates of frames and shells: time beside one direct solve with the same matrix, and growth.

Run ``python benchmarks/structures.py``; option ``--sizes 6 12 24`` (nodes per edge of the frame; the shell has about as
many nodes); with ``--multigrid`` the iterations that PyAMG takes without and with the recovered rigid-body modes.
Element matrices are Pynite's; one end is clamped and eliminated, nodes are numbered at random.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from unassemble import recover
from unassemble.linalg import UpperTriangle, factorisation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "structures"))
from built import Built, error, frame, shell


def direct_solve(matrix: sp.csr_array) -> float:
    """Seconds for one factorisation, ordering included, and one solve."""
    start = perf_counter()
    triangle = UpperTriangle.of(matrix)
    solver = factorisation(triangle, definite=True)
    solver.factorise(triangle)
    solver.solve(np.ones(matrix.shape[0]))
    solver.release()
    return perf_counter() - start


def standing(given: Built) -> Built:
    """Clamped at the foot, nodes at random."""
    height = given.points[:, 2]
    return given.clamped(height < height.min() + 0.05 * np.ptp(height)).permuted()


def iterations(name: str, given: Built) -> str:
    """Of conjugate gradients to 1e-8, smoothed aggregation as preconditioner."""
    import pyamg

    matrix = sp.csr_array(given.matrix)
    modes = recover(matrix, cells=False).rigid_body_modes()
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    blocks = sp.bsr_matrix(matrix, blocksize=(given.block, given.block))
    counts = []
    for operator, options in ((sp.csr_matrix(matrix), {}), (blocks, {}), (blocks, {"B": modes})):
        residuals: list[float] = []
        solver = pyamg.smoothed_aggregation_solver(operator, **options)
        solver.solve(rhs, tol=1e-8, accel="cg", residuals=residuals, maxiter=5000)
        counts.append(len(residuals) - 1)
    return f"{name:6} {matrix.shape[0]:6d} rows: iterations plain {counts[0]}, block {counts[1]}, modes {counts[2]}"


def measure(name: str, given: Built) -> str:
    matrix = sp.csr_array(given.matrix)
    unit = min(direct_solve(matrix) for _ in range(3))
    seconds = []
    for _ in range(3):
        start = perf_counter()
        found = recover(matrix)
        seconds.append(perf_counter() - start)
    cells = ", ".join(f"{len(cells)} {kind}" for kind, cells in found.cells.items())
    return (
        f"{name:6} {len(given.points):6d} nodes, {matrix.shape[0]:6d} rows: {min(seconds):6.2f} s, "
        f"{min(seconds) / unit:5.1f} direct solves; {cells}; {found.status}, "
        f"error {error(found.points, given.points):.0e}, gap {min(one.gap for one in found.evidence):.0e}"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", nargs="+", type=int, default=[6, 9, 14, 20])
    parser.add_argument("--multigrid", action="store_true")
    chosen = parser.parse_args()
    for size in chosen.sizes:
        side = round(size**1.5)
        for name, given in (("frame", frame((size,) * 3)), ("shell", shell(counts=(side, side), thickness=0.05))):
            print((iterations if chosen.multigrid else measure)(name, standing(given)), flush=True)


if __name__ == "__main__":
    main()
