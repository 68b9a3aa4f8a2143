"""Surfaces in space: time beside one direct solve with the same matrix, growth, and errors of edge lengths.

    OMP_NUM_THREADS=1 python benchmarks/metric.py [--sizes 100000 200000] [--runs 3]
    python benchmarks/metric.py --noise [--draws 40]

A closed surface of random vertices, a torus and a wavy sheet of about as many triangles as told are assembled by
scikit-fem, rows in random order. Printed is the median processor time of a whole recovery, polish and certificate
included, against direct solves of the same run, and the largest relative error of a length. With ``--noise``, small
surfaces with errors in the entries instead: the mean square of errors of lengths over that of their error bars (1 if
these are right), how many in a hundred lie within one, two and three of them (68, 95.4 and 99.7), and how many draws
are certified.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "metric")]

from surfaces import largest_error, moebius, sheet, sphere, surface, torus  # noqa: E402

from boundaries import unit  # noqa: E402
from unassemble import recover  # noqa: E402


def main() -> None:
    """Print a line for each surface."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", type=int, default=[100_000, 200_000], help="triangles")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--noise", action="store_true")
    parser.add_argument("--draws", type=int, default=40, help="of noise, at each level")
    arguments = parser.parse_args()
    if arguments.noise:
        for name, mesh in (("torus", torus(12, 8)), ("Moebius band", moebius()), ("sheet", sheet(16))):
            for sigma in 10.0 ** -np.arange(2, 13, 2):
                scatter(name, mesh, sigma, arguments.draws)
        return
    for size in arguments.sizes:
        k = int(np.sqrt(size / 4))
        timed("random closed", sphere(size // 2 + 2), arguments.runs)
        timed("torus", torus(2 * k, k), arguments.runs)
        timed("wavy sheet", sheet(int(np.sqrt(size / 2)), holes=False), arguments.runs)


def timed(name: str, mesh: tuple[np.ndarray, np.ndarray], runs: int) -> None:
    """Times of one surface, c unknown."""
    known = surface(*mesh, c=0.3)
    seconds, solves, error = [], [], 0.0
    for _ in range(runs):
        start = time.process_time()
        found = recover(known.matrix, operator="surface")
        seconds.append(time.process_time() - start)
        solves.append(seconds[-1] / np.median([unit(known.matrix) for _ in range(3)]))
        error = max(error, largest_error(found, known.points))
    print(
        f"{name:14s} {len(found.triangles):7,} triangles {np.median(seconds):6.1f} s, {np.median(solves):4.1f} "
        f"({min(solves):.1f} to {max(solves):.1f}) solves; {found.status}, error {error:.0e}",
        flush=True,
    )


def scatter(name: str, mesh: tuple[np.ndarray, np.ndarray], sigma: float, draws: int) -> None:
    """Errors of lengths in units of their bars, sigma relative to c."""
    known = surface(*mesh, c=2.0)
    ratios, certified = [], 0
    for seed in range(draws):
        rng = np.random.default_rng([seed, round(-np.log10(sigma))])
        upper = sp.triu(known.matrix).tocoo()
        errors = sp.coo_array((2 * sigma * rng.standard_normal(upper.nnz), upper.coords), shape=upper.shape)
        noisy = known.matrix + errors + sp.triu(errors, 1).T
        found = recover(noisy.tocsr(), operator="surface", noise=2 * sigma, standard_deviations=True)
        i, j = found.edges.T
        true = np.linalg.norm(known.points[i] - known.points[j], axis=1)
        ratios.append((found.edge_lengths - true / true.mean()) / found.length_deviations)
        certified += found.certified
    size = np.abs(ratios)
    within = " ".join(f"{100 * (size < k).mean():.1f}" for k in (1, 2, 3))
    print(
        f"{name:14s} sigma {sigma:.0e} c: mean square {np.mean(size**2):.2f}, within {within}, "
        f"largest {size.max():.1f}; certified {certified} of {draws}",
        flush=True,
    )


if __name__ == "__main__":
    main()
