"""Coordinates of frames and shells: time beside one direct solve with the same matrix, and growth.

Run ``python benchmarks/structures.py``; option ``--sizes 6 12 24`` (nodes per edge of the frame; the shell has about as
many nodes); with ``--multigrid`` the iterations that PyAMG takes without and with the recovered rigid-body modes.
Element matrices are Pynite's; one end is clamped and eliminated, nodes are numbered at random.

With ``--bodies`` instead a table of what becomes of small bodies with noise, few digits and supports of all kinds; the
solid body is scikit-fem's. The exit status is 1 where a certificate is wrong.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "structures"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))
from as_given import supported, written
from assembled import box, stiffness
from built import Built, error, frame, plane_frame, plate, shell, sound, truss, vault

from unassemble import RecoveryError, recover
from unassemble.linalg import UpperTriangle, factorisation

SUPPORTS = ("none", "removed", "identity", "penalty", "condensed")


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


def solid() -> Built:
    """A block of trilinear hexahedra, its inner nodes moved."""
    made = stiffness("hex-q1", box("hex-q1", (4, 4, 6), perturb=0.2, stretch=(3, 3, 5)))
    return Built(made.matrix, made.points, np.zeros((0, 2), dtype=np.int64), (0, 1, 2))


def pinned() -> Built:
    """A truss, whose size is free, as large as the others."""
    given = truss(3, 40)
    return replace(given, points=5 * given.points)


def noisy(matrix: sp.csr_array, size: float = 1e-15) -> sp.csr_array:
    """Symmetric noise relative to each entry."""
    noise = sp.csr_array(matrix, copy=True)
    noise.data *= size * np.random.default_rng(0).standard_normal(noise.nnz)
    return sp.csr_array(matrix + (noise + noise.T) / 2)


def outcome(matrix: sp.csr_array, true: np.ndarray) -> str:
    """What becomes of a matrix, rows of which belong to nodes at (order, d) true positions."""
    try:
        certified = recover(matrix).certified
    except RecoveryError:
        return "refused"
    if not certified:
        return "uncertified"
    try:
        return "right" if sound(matrix, true) else "uncertified"
    except AssertionError:
        return "WRONG"


def table() -> bool:
    """Print one line per body and sort of support; whether no certificate is wrong."""
    changes = {"exact": lambda matrix: matrix, "noise 1e-15": noisy}
    changes |= {f"{digits} digits": lambda matrix, digits=digits: written(matrix, digits) for digits in (12, 10, 8)}
    print(f"{'body':12} {'supports':10}" + "".join(f"{name:>13}" for name in changes))
    wrong = False
    for make in (plane_frame, frame, pinned, plate, shell, solid, vault):
        for how in SUPPORTS:
            given = make().permuted(1)
            if how == "condensed" and given.unknowns == (0, 1, 2):
                continue  # no rotations
            matrix, true = supported(given, how)
            answers = [outcome(change(sp.csr_array(matrix)), true) for change in changes.values()]
            wrong |= "WRONG" in answers
            print(f"{make.__name__:12} {how:10}" + "".join(f"{answer:>13}" for answer in answers), flush=True)
    return not wrong


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", nargs="+", type=int, default=[6, 9, 14, 20])
    parser.add_argument("--multigrid", action="store_true")
    parser.add_argument("--bodies", action="store_true")
    chosen = parser.parse_args()
    if chosen.bodies:
        sys.exit(0 if table() else 1)
    for size in chosen.sizes:
        side = round(size**1.5)
        for name, given in (("frame", frame((size,) * 3)), ("shell", shell(counts=(side, side), thickness=0.05))):
            print((iterations if chosen.multigrid else measure)(name, standing(given)), flush=True)


if __name__ == "__main__":
    main()
