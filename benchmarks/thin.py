"""Accuracy on strips one element wide, with and without the factorisation that does not square their condition.

Run ``python benchmarks/thin.py``; ``--sizes 300 3000 30000`` are vertices, ``--height 0.87`` is in units of the mean
side along the strip (0.02 makes needles). Vertices are moved at random, rows come in random order, and scikit-fem
assembles.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter

import unassemble.planar.piece
from unassemble import recover

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from meshes import largest_error, specimen, strip


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", type=int, default=[300, 3000, 30000])
    parser.add_argument("--height", type=float, default=0.87)
    chosen = parser.parse_args()
    affordable = unassemble.planar.piece.affordable
    print(f"{'vertices':>9} {'normal equations':>34} {'augmented system':>34}")
    for n in chosen.sizes:
        known = specimen(*strip(n, chosen.height, 0.1), c=-2.5, seed=1)
        texts = []
        for allowed in (lambda edges, z: False, affordable):
            unassemble.planar.piece.affordable = allowed
            start = perf_counter()
            found = recover(known.matrix)
            seconds = perf_counter() - start
            texts.append(f"{largest_error(found.points, known.points):.0e} {found.status}, {seconds:.1f} s")
        print(f"{n:9d} {texts[0]:>34} {texts[1]:>34}", flush=True)


if __name__ == "__main__":
    main()
