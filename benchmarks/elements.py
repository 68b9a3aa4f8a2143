"""Scalar matrices of quadrilaterals and of quadratic triangles, in units of a direct solve with the same matrix.

    python benchmarks/elements.py [--sizes 20000,100000,500000] [--repeat 3] [--elements Q1,P2]

Processor time: c known, unknown, unknown and polished, all with the certificate. Medians over repetitions, in which
all take turns; behind them the least and the largest ratio to the direct solve of the same turn. The exponents are
fitted over the sizes. The last column is the largest error of the polished mesh, relative to the diameter.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np
import scipy.sparse as sp
import skfem

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from conforming.assembled import assembled, largest_error, quadrilaterals
from unassemble import recover
from unassemble.linalg import UpperTriangle, factorisation

RUNS = ({"scale": 3.0, "refine": False}, {"refine": False}, {})


def main() -> None:
    """Print a table for each element."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="20000,100000,500000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--elements", default="Q1,P2")
    arguments = parser.parse_args()
    sizes = [int(float(size)) for size in arguments.sizes.split(",")]
    recover(assembled("Q1", quadrilaterals(3, 3)).matrix)  # loading libraries is start-up, not work
    for element in arguments.elements.split(","):
        titles = "".join(f"{title:>20}" for title in ("c known", "unknown", "polished"))
        print(f"{element:>4} {'rows':>9} {'solve, s':>9}{titles} {'error':>9}")
        table = np.array([row(element, size, arguments.repeat) for size in sizes])
        if len(sizes) > 1:
            solve, *others = (np.polyfit(np.log(table[:, 0]), np.log(seconds), 1)[0] for seconds in table[:, 1:].T)
            print(f"{'growth':>14} {solve:9.2f}" + "".join(f"{power:20.2f}" for power in others))


def row(element: str, size: int, repeat: int) -> list[float]:
    """Rows, and seconds of a direct solve and of the three runs."""
    if element == "Q1":
        side = int(np.sqrt(size))
        mesh = quadrilaterals(side, side)
    else:
        axis = np.arange(int(np.sqrt(size / 4)) + 1.0)
        mesh = skfem.MeshTri.init_tensor(axis, axis)
        mesh = skfem.MeshTri(mesh.p + np.random.default_rng(0).uniform(-0.2, 0.2, mesh.p.shape), mesh.t)
    known = assembled(element, mesh, c=3.0)
    turns = []
    for _ in range(repeat):
        turns.append([direct(known.matrix)])
        for options in RUNS:
            start = time.process_time()
            found = recover(known.matrix, **options)
            turns[-1].append(time.process_time() - start)
            assert found.certified, found.reason
    seconds = [median(some) for some in zip(*turns, strict=True)]
    columns = ""
    for k in range(1, len(seconds)):
        ratios = [turn[k] / turn[0] for turn in turns]
        columns += f"{f'{median(ratios):.1f} ({min(ratios):.1f} to {max(ratios):.1f})':>20}"
    error = largest_error(found.points, known.points)
    print(f"{'':4} {len(known.points):9,} {seconds[0]:9.2f}{columns} {error:9.1e}", flush=True)
    return [len(known.points), *seconds]


def direct(matrix: sp.csr_array) -> float:
    """Seconds of ordering, factorisation and one solution, the last row and column left out."""
    upper = UpperTriangle.of(sp.csr_array(matrix[:-1][:, :-1]))
    start = time.process_time()
    factor = factorisation(upper, definite=True)
    factor.factorise(upper)
    factor.solve(np.ones(upper.n))
    factor.release()
    return time.process_time() - start


if __name__ == "__main__":
    main()
