"""Mean square error of recovered meshes over the Cramer-Rao bound, from repeated draws of noise.

python benchmarks/noise.py [--sizes 500,5000,50000] [--sigmas 1e-12,1e-9,1e-6,1e-4,1e-3] [--draws 100,100,10]
                           [--output FILE.json] [--figure FILE.png] [--from FILE.json] [--channels]

Each draw adds independent normal errors of standard deviation sigma to the entries of one triangle of the Laplacian
(and their mirror images to the other) of an irregular mesh with three islands; cotangent weights are about 0.6.
Errors are what is left after the best similarity onto the true mesh, as mean squares over the vertices, relative to the
square of the diameter. To first order in sigma that similarity takes away the component along translations, rotation
and scaling, so the bound is the trace of P C P, P the projector off these four displacements, C = sigma^2 (K'K)^-1 in
any gauge, and K = (I - ww'/w'w) J the derivative of the weights with what a change of the unknown scale c could
explain projected out. P C P = sigma^2 (K'K)^+ since K has no other null vectors. The derivative is coded here a
second time, from dot and cross products; up to 3,000 edges the trace is exact, above it is the mean over 400 random
vectors.

A few smooth displacements carry most of the error, so that its mean over 100 draws still scatters by several percent.
"paired" takes that out: from each draw's square error that of the best linear estimate for the same draw is subtracted,
and the bound, which is its expectation, added.

With --channels: how often meshes forty times as long as wide are certified. There smooth conformal maps come closest
to the null space, and noise bends the start most.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from irregular import irregular_mesh, laplacian, largest_piece
from scipy.sparse.linalg import splu
from scipy.spatial import Delaunay

from unassemble import Recovery, recover

EXACT, SAMPLES = 3000, 400


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="500,5000,50000")
    parser.add_argument("--sigmas", default="1e-12,1e-9,1e-6,1e-4,1e-3")
    parser.add_argument("--draws", default="100,100,10", help="for each size")
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
        results += measure(size, [float(sigma) for sigma in arguments.sigmas.split(",")], int(draws))
        if arguments.output:
            arguments.output.write_text(json.dumps(results, indent=1) + "\n")
    if arguments.figure:
        draw(results, arguments.figure)


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
    certified, flipped, before, after = 0, 0, [], []
    for seed in range(draws):
        given = noisy(matrix, sigma, seed)[0]
        polished, start = recover(given, noise=sigma), recover(given, noise=sigma, refine=False)
        certified += polished.certified
        flipped += any_flipped(start)
        before.append(mean_square(start.points, z) ** 0.5)
        after.append(mean_square(polished.points, z) ** 0.5)
    print(
        f"channel of {len(z):6d} vertices, sigma {sigma:.0e}: certified {certified} of {draws}, "
        f"starts with flipped triangles {flipped}; median error {np.median(before):.1e} diameters at the start, "
        f"{np.median(after):.1e} after",
        flush=True,
    )


def measure(size: int, sigmas: list[float], draws: int) -> list[dict]:
    """One mesh, all noise levels."""
    points, triangles = mesh_of_at_least(size)
    matrix, true = laplacian(points, triangles, 1.0)
    place = {tuple(p): k for k, p in enumerate(true)}
    triangles = np.array([place[tuple(p)] for p in points])[triangles]
    z = true @ [1, 1j]
    z = z / (2 * np.abs(z - z.mean()).max())
    bound = Bound(z, triangles)
    results = []
    for sigma in sigmas:
        start = time.perf_counter()
        squares = np.array([draw_errors(matrix, z, bound, sigma, seed) for seed in range(draws)])
        polished, unpolished, linear = squares[:, :3].T / (sigma**2 * bound.mean_square)
        paired = polished - linear + 1
        result = {
            "vertices": len(z),
            "sigma": sigma,
            "draws": draws,
            "bound": sigma * bound.mean_square**0.5,
            "ratio": float(polished.mean()),
            "ratio_error": standard_error(polished),
            "paired": float(paired.mean()),
            "paired_error": standard_error(paired),
            "unpolished": float(unpolished.mean()),
            "certified": int(squares[:, 3].sum()),
            "flipped_starts": int(squares[:, 4].sum()),
            "seconds": time.perf_counter() - start,
        }
        results.append(result)
        print(
            f"{len(z):7d} vertices, sigma {sigma:.0e}, {draws:3d} draws: mean square error over bound "
            f"{result['ratio']:.3f} +- {result['ratio_error']:.3f} (paired {result['paired']:.4f} +- "
            f"{result['paired_error']:.4f}), unpolished {result['unpolished']:.1f}; "
            f"certified {result['certified']}, starts with flipped triangles {result['flipped_starts']}; "
            f"root of the bound {result['bound']:.2e} diameters",
            flush=True,
        )
    return results


def mesh_of_at_least(size: int) -> tuple[np.ndarray, np.ndarray]:
    """An irregular mesh of that many vertices after the islands are cut out."""
    lattice = size
    while True:
        points, triangles = irregular_mesh(lattice)
        if len(points) >= size:
            return points, triangles
        lattice = int(1.02 * lattice) + 1


def standard_error(values: np.ndarray) -> float:
    """Of the mean."""
    return float(values.std(ddof=1) / len(values) ** 0.5)


def draw_errors(matrix: sp.csr_array, z: np.ndarray, bound: Bound, sigma: float, seed: int) -> tuple[float, ...]:
    """Mean square error with the polish, without it, and to first order; certified; start with flipped triangles."""
    given, noise = noisy(matrix, sigma, seed)
    polished, start = recover(given, noise=sigma), recover(given, noise=sigma, refine=False)
    linear = float(np.sum(bound.response(-noise[:, None]) ** 2)) / len(z)
    return mean_square(polished.points, z), mean_square(start.points, z), linear, polished.certified, any_flipped(start)


def noisy(matrix: sp.csr_array, sigma: float, seed: int) -> tuple[sp.coo_array, np.ndarray]:
    """The matrix with errors, and the errors (e,) of its upper triangle."""
    upper = sp.triu(matrix, 1).tocsr()
    upper.sort_indices()
    upper = upper.tocoo()
    noise = sigma * np.random.default_rng(seed).standard_normal(upper.nnz)
    value = upper.data + noise
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape), noise


def any_flipped(found: Recovery) -> bool:
    """Whether a triangle is turned over."""
    x, y = found.points[found.triangles].transpose(2, 1, 0)
    return bool(((x[1] - x[0]) * (y[2] - y[0]) <= (x[2] - x[0]) * (y[1] - y[0])).any())


def mean_square(points: np.ndarray, z: np.ndarray) -> float:
    """After the best similarity or reflection."""
    source, target = points @ [1, 1j], z - z.mean()
    source = source - source.mean()
    fits = [s * (np.vdot(s, target) / np.vdot(s, s)) for s in (source, source.conj())]
    return float(min(np.mean(np.abs(fit - target) ** 2) for fit in fits))


def weights_and_derivative(z: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, sp.csr_array]:
    """w (e,) and dw / d(x, y) (e, 2 v), from cot = dot / cross."""
    n = len(z)
    rows, columns, slopes, cots = [], [], [], []
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    edges, edge = np.unique(sides, axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    for k in range(3):
        corner, a, b = (triangles[:, (k + s) % 3] for s in range(3))
        u, v = z[a] - z[corner], z[b] - z[corner]
        dot, cross = (u.conj() * v).real, (u.conj() * v).imag
        sign = np.sign(cross)
        cots.append((edge[:, k], sign * dot / cross / 2))
        # d dot = v.du + u.dv, d cross = (v.y, -v.x).du + (-u.y, u.x).dv, as complex gradients.
        to_a, to_b = (v / cross + 1j * v * dot / cross**2, u / cross - 1j * u * dot / cross**2)
        for vertex, g in ((a, to_a), (b, to_b), (corner, -to_a - to_b)):
            for part, value in ((0, g.real), (1, g.imag)):
                rows.append(edge[:, k])
                columns.append(2 * vertex + part)
                slopes.append(sign * value / 2)
    w = np.zeros(len(edges))
    for place, value in cots:
        np.add.at(w, place, value)
    indices = np.concatenate(rows), np.concatenate(columns)
    return w, sp.coo_array((np.concatenate(slopes), indices), shape=(len(edges), 2 * n)).tocsr()


class Bound:
    """The best linear estimate, and its mean square error."""

    def __init__(self, z: np.ndarray, triangles: np.ndarray):
        self.w, self.derivative = weights_and_derivative(z, triangles)
        n = len(z)
        centred = z - z.mean()
        first = int(np.abs(centred).argmax())
        self.free = np.ones(2 * n, dtype=bool)
        for pin in (first, int(np.abs(z - z[first]).argmax())):
            self.free[[2 * pin, 2 * pin + 1]] = False
        self.held = self.derivative[:, self.free]
        self.factor = splu((self.held.T @ self.held).tocsc())
        one = np.ones(n)
        fields = [one + 0j, 1j * one, centred, 1j * centred]
        self.gauge = np.linalg.qr(np.column_stack([np.column_stack([f.real, f.imag]).ravel() for f in fields]))[0]
        self.along = self.fitted(self.w[:, None])
        self.rest = self.w - self.derivative @ self.along[:, 0]  # what no displacement explains of w

    @cached_property
    def mean_square(self) -> float:
        """Expected mean square error for sigma = 1: trace of P C P over the number of vertices."""
        return self.trace() / (self.derivative.shape[1] / 2)

    def fitted(self, noise: np.ndarray) -> np.ndarray:
        """Displacements (2 v, k) that fit errors (e, k) of the weights for known c."""
        full = np.zeros((self.derivative.shape[1], noise.shape[1]))
        full[self.free] = self.factor.solve(self.held.T @ noise)
        return full

    def response(self, noise: np.ndarray) -> np.ndarray:
        """The same for unknown c, and without translations, rotation and scaling."""
        y = self.fitted(noise) - self.along * (self.rest @ noise / (self.rest @ self.w))
        return y - self.gauge @ (self.gauge.T @ y)

    def trace(self) -> float:
        """Sum of squares of the responses to every entry, or to as many random vectors as estimate it."""
        edges, rng, total = len(self.w), np.random.default_rng(1), 0.0
        count = edges if edges <= EXACT else SAMPLES
        for first in range(0, count, 50):
            width = min(50, count - first)
            if edges <= EXACT:
                noise = np.eye(edges)[:, first : first + width]
            else:
                noise = rng.standard_normal((edges, width)) / SAMPLES**0.5
            total += float(np.sum(self.response(noise) ** 2))
        return total


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
        ratio, other = (np.array([r[key] for r in rows]) ** 0.5 for key in ("paired", "unpolished"))
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
