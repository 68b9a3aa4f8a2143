"""What coordinates are worth to multigrid: iterations of PyAMG on a clamped beam, by near-null space.

Run ``python benchmarks/beam.py``; options ``--counts 43 14 14`` (nodes along each axis), ``--runs 3``. The beam is six
times as long as wide, made of trilinear hexahedra whose inner nodes are moved at random, clamped and eliminated at one
end, and assembled by scikit-fem. Conjugate gradients run to 1e-8 for random right-hand sides; the mean number of
iterations and the shortest time of set-up and solve are printed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pyamg
import scipy.sparse as sp

from unassemble.modes import rigid_body_modes

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))

from assembled import box, eliminated, error, on_plane, recover_elasticity, stiffness


def solve(matrix: sp.csr_array, modes: np.ndarray | None, rhs: np.ndarray, *, blocks: bool) -> tuple[int, float]:
    """Iterations, and seconds of set-up and solve."""
    start = perf_counter()
    operator = sp.bsr_matrix(matrix, blocksize=(3, 3)) if blocks else sp.csr_matrix(matrix)
    solver = pyamg.smoothed_aggregation_solver(operator, **({} if modes is None else {"B": modes}))
    residuals: list = []
    solver.solve(rhs, tol=1e-8, accel="cg", residuals=residuals, maxiter=1000)
    return len(residuals) - 1, perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--counts", nargs=3, type=int, default=[43, 14, 14])
    parser.add_argument("--runs", type=int, default=3)
    chosen = parser.parse_args()
    given = stiffness("hex-q1", box("hex-q1", chosen.counts, perturb=0.1, stretch=(6, 1, 1)), intorder=3)
    matrix, nodes = eliminated(given, np.repeat(on_plane(given, 0)[:, None], 3, axis=1))
    start = perf_counter()
    found = recover_elasticity(matrix, cells=False)
    seconds = perf_counter() - start
    print(f"{len(nodes)} nodes; coordinates {seconds:.1f} s, error {error(found.points, given.points[nodes]):.0e}")
    row = np.arange(matrix.shape[0])
    spaces = {
        "defaults": None,
        "block size": None,
        "recovered modes": rigid_body_modes(found.points, found.node_of_row, found.direction_of_row),
        "true modes": rigid_body_modes(given.points[nodes], row // 3, row % 3),
    }
    for name, modes in spaces.items():
        rng = np.random.default_rng(0)
        runs = [
            solve(matrix, modes, rng.standard_normal(len(row)), blocks=name != "defaults") for _ in range(chosen.runs)
        ]
        iterations, times = zip(*runs, strict=True)
        print(f"{name:16s} {np.mean(iterations):6.1f} iterations {min(times):6.2f} s")


if __name__ == "__main__":
    main()
