"""Mean square error of recovered meshes over the Cramer-Rao bound, from repeated draws of noise.

python benchmarks/noise.py [--sizes 500,5000,50000] [--sigmas 1e-12,1e-11,...,1e-3] [--draws 400,100,10]
                           [--output FILE.json] [--figure FILE.png] [--from FILE.json] [--channels] [--element P2]

Each draw adds independent normal errors of standard deviation sigma to the entries of one triangle of the Laplacian
(and their mirror images to the other) of an irregular mesh with three islands; cotangent weights are about 0.6.
Errors are what is left after the best similarity onto the true mesh, as mean squares over the vertices, relative to the
square of the diameter. The bound is computed in bound.py, which differentiates the weights by itself.

A few smooth displacements carry most of the error, so that its mean over 100 draws still scatters by several percent.
"paired" takes that out: from each draw's square error that of the best linear estimate for the same draw is subtracted,
and the bound, which is its expectation, added. Draws of different noise levels are independent, so that the last line
of each size, over all levels, is the mean over the most draws. Results of an earlier run are kept, and levels that they
have are not measured again: parts of the table may be run one by one.

"lost" are meshes that end with flipped triangles; none of them may be certified.

With --element P2 or Q1: the same for quadratic triangles on such a mesh, and for a lattice of irregular quadrilaterals
with a hole; sizes then are numbers of rows, and errors those of corners.

With --channels: how often meshes forty times as long as wide are certified. There smooth conformal maps come closest
to the null space, and noise bends the start most.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from bound import Bound, mean_square, mesh_of_at_least, noisy, weights_and_derivative
from irregular import laplacian, largest_piece
from noise_elements import specimen
from scipy.spatial import Delaunay

from unassemble import Recovery, RecoveryError, recover

LARGEST = 1e-3
"""Noise up to which errors are held against the bound."""


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="500,5000,50000")
    parser.add_argument("--sigmas", default=",".join(f"1e-{k}" for k in range(12, 2, -1)))
    parser.add_argument("--draws", default="400,100,10", help="for each size")
    parser.add_argument("--element", choices=("P1", "P2", "Q1"), default="P1")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--channels", action="store_true", help="only count how often long channels are recovered")
    parser.add_argument("--from", dest="known", type=Path, help="results of an earlier run, to draw or to extend")
    arguments = parser.parse_args()
    results = json.loads(arguments.known.read_text()) if arguments.known else []
    sizes = [int(float(size)) for size in arguments.sizes.split(",") if size]
    if arguments.channels:
        for size in sizes:
            for sigma in map(float, arguments.sigmas.split(",")):
                count_channels(size, sigma, int(arguments.draws.split(",")[0]))
        return
    for size, draws in zip(sizes, arguments.draws.split(","), strict=False):
        for result in measure(
            arguments.element, size, list(map(float, arguments.sigmas.split(","))), int(draws), results
        ):
            results.append(result)
            if arguments.output:
                arguments.output.write_text(json.dumps(results, indent=1) + "\n")
    results.sort(key=lambda r: (r["vertices"], r["sigma"]))
    print_table(results)
    if arguments.figure:
        draw([r for r in results if r["sigma"] <= LARGEST], arguments.figure)


def count_channels(size: int, sigma: float, draws: int) -> None:
    """How many of the draws are certified."""
    width = int((size / 40) ** 0.5)
    x, y = np.meshgrid(np.arange(40 * width), np.arange(width))
    lattice = np.column_stack([(x + 0.5 * (y % 2)).ravel(), 0.87 * y.ravel()])
    points = lattice + np.random.default_rng(0).uniform(-0.25, 0.25, lattice.shape)
    triangles = Delaunay(points).simplices
    corner = points[triangles]
    longest = np.abs((corner - np.roll(corner, 1, axis=1)) @ [1, 1j]).max(axis=1)
    used, triangles = np.unique(largest_piece(triangles[longest < 2]), return_inverse=True)
    matrix, true = laplacian(points[used], triangles.reshape(-1, 3), 1.0)
    z = true @ [1, 1j]
    z = z / (2 * np.abs(z - z.mean()).max())
    certified, refused, flipped, before, after = 0, 0, 0, [], []
    for seed in range(draws):
        given = noisy(matrix, sigma, seed)[0]
        try:
            polished, start = recover(given, noise=sigma), recover(given, noise=sigma, refine=False)
        except RecoveryError:
            refused += 1
            continue
        certified += polished.certified
        flipped += any_flipped(start)
        before.append(mean_square(start.points, z) ** 0.5)
        after.append(mean_square(polished.points, z) ** 0.5)
    print(
        f"channel of {len(z):6d} vertices, sigma {sigma:.0e}: certified {certified} of {draws}, refused {refused}, "
        f"starts with flipped triangles {flipped}; median error {np.median(before):.1e} diameters at the start, "
        f"{np.median(after):.1e} after",
        flush=True,
    )


def linear(size: int) -> tuple[sp.csr_array, np.ndarray, np.ndarray, Bound]:
    """As :func:`noise_elements.specimen`, of linear triangles."""
    points, triangles = mesh_of_at_least(size)
    matrix, true = laplacian(points, triangles, 1.0)
    place = {tuple(p): k for k, p in enumerate(true)}
    triangles = np.array([place[tuple(p)] for p in points])[triangles]
    z = true @ [1, 1j]
    z = z / (2 * np.abs(z - z.mean()).max())
    return matrix, np.arange(len(z)), z, Bound(z, *weights_and_derivative(z, triangles))


def measure(element: str, size: int, sigmas: list[float], draws: int, known: list[dict]) -> Iterator[dict]:
    """One mesh, all noise levels that are not known yet."""
    matrix, corners, z, bound = linear(size) if element == "P1" else specimen(element, size)
    for sigma in sigmas:
        if any(r["vertices"] == len(z) and r["sigma"] == sigma for r in known):
            continue
        start = time.perf_counter()
        level = round(-1000 * np.log10(sigma))  # independent draws at every level
        found = [draw_errors(matrix, corners, z, bound, sigma, [level, seed]) for seed in range(draws)]
        squares = np.array([one[:3] for one in found]) / (sigma**2 * bound.mean_square)
        result = {
            "vertices": len(z),
            "sigma": sigma,
            "draws": draws,
            "bound": sigma * bound.mean_square**0.5,
            "polished": squares[:, 0].tolist(),
            "unpolished": squares[:, 1].tolist(),
            "linear": squares[:, 2].tolist(),
            "certified": [one[3] for one in found],
            "flipped_starts": sum(one[4] for one in found),
            "lost": sum(one[5] for one in found),
            "lost_and_certified": sum(one[3] and one[5] for one in found),
            "reasons": sorted({one[6] for one in found if not one[3]}),
            "seconds": time.perf_counter() - start,
        }
        print(row(result), f"in {result['seconds']:.0f} s", *result["reasons"][:2], flush=True)
        yield result


HEAD = (
    "| vertices | sigma | draws | mean square error over bound | paired | null vector | certified | flipped starts "
    "| lost, of these certified |\n|---|---|---|---|---|---|---|---|---|"
)


def print_table(results: list[dict]) -> None:
    """All levels of every size, and all draws up to the largest noise of the table together."""
    print(HEAD)
    for size in sorted({r["vertices"] for r in results}):
        same = [r for r in results if r["vertices"] == size]
        print(*map(row, same), sep="\n")
        small = [r for r in same if r["sigma"] <= LARGEST]
        if len(small) > 1:
            pooled = {
                key: [x for r in small for x in r[key]] for key in ("polished", "unpolished", "linear", "certified")
            }
            counts = ("draws", "flipped_starts", "lost", "lost_and_certified")
            print(row({**pooled, **{k: sum(r[k] for r in small) for k in counts}, "vertices": size, "sigma": None}))


def row(result: dict) -> str:
    """Of the table."""
    polished, linear = np.array(result["polished"]), np.array(result["linear"])
    sigma = "all" if result["sigma"] is None else f"{result['sigma']:.0e}"
    return (
        f"| {result['vertices']:,} | {sigma} | {result['draws']} | {plus_minus(polished, 3)} | "
        f"{plus_minus(polished - linear + 1, 4)} | {np.mean(result['unpolished']):,.0f} | {sum(result['certified'])} | "
        f"{result['flipped_starts']} | {result['lost']}, {result['lost_and_certified']} |"
    )


def plus_minus(values: np.ndarray, digits: int) -> str:
    """Mean and its standard error."""
    error = f" ± {values.std(ddof=1) / len(values) ** 0.5:.{digits}f}" if len(values) > 1 else ""
    return f"{values.mean():.{digits}f}{error}"


def draw_errors(
    matrix: sp.csr_array, corners: np.ndarray, z: np.ndarray, bound: Bound, sigma: float, seed: list[int]
) -> tuple:
    """Mean square error with the polish, without it, and to first order; certified; flipped at the start, at the end.

    And the beginning of the reason.
    """
    given, noise = noisy(matrix, sigma, seed)
    polished, start = recover(given, noise=sigma), recover(given, noise=sigma, refine=False)
    linear = float(np.sum(bound.response(-noise[:, None]) ** 2)) / len(z)
    squares = mean_square(polished.points[corners], z), mean_square(start.points[corners], z), linear
    return *squares, polished.certified, any_flipped(start), any_flipped(polished), polished.reason[:200]


def any_flipped(found: Recovery) -> bool:
    """Whether a cell is turned over in a corner."""
    for cells in found.cells.values():
        z = found.points[cells[:, : 3 if len(found.triangles) else 4]] @ [1, 1j]
        side = np.roll(z, -1, axis=1) - z
        if (np.imag(np.conj(np.roll(side, 1, axis=1)) * side) <= 0).any():
            return True
    return False


def draw(results: list[dict], path: Path) -> None:
    """Errors against sigma, and the ratio to the bound against the size."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    sizes = sorted({r["vertices"] for r in results})
    for size, colour, marker in zip(sizes, ("#16324f", "#2f8f6b", "#e2552f", "#8a5fb0"), "osD^", strict=False):
        rows = sorted((r for r in results if r["vertices"] == size), key=lambda r: r["sigma"])
        sigma, bound = (np.array([r[key] for r in rows]) for key in ("sigma", "bound"))
        ratio = np.array([np.mean(r["polished"]) - np.mean(r["linear"]) + 1 for r in rows]) ** 0.5
        other = np.array([np.mean(r["unpolished"]) for r in rows]) ** 0.5
        name = f"{size:,} vertices"
        left.loglog(sigma, bound, color=colour, lw=0.8)
        left.loglog(sigma, bound * ratio, marker, color=colour, ms=4, label=name)
        left.loglog(sigma, bound * other, marker, mfc="none", color=colour, ms=6)
        right.loglog([size] * len(rows), ratio**2, marker, color=colour, ms=4)
        right.loglog([size] * len(rows), other**2, marker, mfc="none", color=colour, ms=6)
    left.set(xlabel="standard deviation of the entries", ylabel="root mean square error / diameter")
    left.set_title("lines: Cramér–Rao bound; filled: polished; hollow: null vector", fontsize=8)
    left.legend(fontsize=8)
    right.axhline(1.0, color="0.3", lw=0.8)
    right.axhline(1.1, color="0.3", lw=0.8, ls=":")
    right.set(xlabel="vertices", ylabel="mean square error / bound")
    right.set_title("solid: the bound; dotted: 1.1 times the bound", fontsize=8)
    for axis in (left, right):
        axis.grid(alpha=0.25, lw=0.5)
    figure.savefig(path)


if __name__ == "__main__":
    main()
