"""Noise on matrices that do not store their zeros: how often the cells are found, and how far off the mesh is.

    python benchmarks/vanished.py [--sigmas 1e-6,1e-3,3e-2] [--draws 10]

Entries that vanish are not stored; all others get independent normal errors of standard deviation sigma times c.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from bound import noisy

from unassemble import RecoveryError, recover

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

C = 1.7


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sigmas", default="1e-6,1e-3,3e-2")
    parser.add_argument("--draws", type=int, default=10)
    arguments = parser.parse_args()
    print(
        "| mesh | sigma / c | cells found | certified | error, diameters over sigma / c | noise estimated over sigma |"
    )
    print("|---|---|---|---|---|---|")
    for name, mesh in meshes().items():
        for sigma in map(float, arguments.sigmas.split(",")):
            print(f"| {name} | {sigma:.0e} | {measure(mesh, sigma, arguments.draws)} |", flush=True)


def meshes() -> dict:
    """Some 100 to 300 vertices each."""
    from vanishing import half_jittered, holes, polar, refined, squares

    return {
        "five-point stencil": squares(holes(14, 12)),
        "L-shape": squares(holes(14, 14, (7, 7, 7, 7))),
        "crossed squares": squares(holes(10, 10), crossed=True),
        "grid with three holes": squares(holes(16, 16, (3, 3, 4, 5), (10, 10, 2, 1), (8, 2, 1, 2))),
        "annulus": polar(6, 24, 0.5),
        "adaptive": refined(5, 1),
        "triangles and squares": half_jittered(14),
    }


def measure(mesh: tuple[np.ndarray, np.ndarray], sigma: float, draws: int) -> str:
    """Cells right and certified, of so many draws; medians over those with the right cells."""
    from meshes import largest_error, specimen
    from vanishing import forgotten

    known = forgotten(specimen(*mesh, c=C))
    truth = recover(known.matrix)
    right, certified, errors, levels = 0, 0, [], []
    for seed in range(draws):
        try:
            found = recover(noisy(known.matrix, sigma * C, seed)[0], noise=sigma * C)
        except RecoveryError:
            continue
        same = cells(found) == cells(truth)
        right += same
        certified += found.certified
        if same:
            errors.append(largest_error(found.points, known.points) / sigma)
            levels.append(found.estimated_noise / (sigma * C))
    figures = f"{np.median(errors):.2f} | {np.median(levels):.2f}" if errors else "|"
    return f"{right} of {draws} | {certified} | {figures}"


def cells(found) -> set:
    """All of them, as sets of vertices."""
    ends = zip(found.polygons_offsets[:-1], found.polygons_offsets[1:], strict=True)
    polygons = (found.polygons_data[a:b].tolist() for a, b in ends)
    return {frozenset(cell) for cell in (*found.triangles.tolist(), *polygons)}


if __name__ == "__main__":
    main()
