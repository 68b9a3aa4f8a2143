"""The paper's Figures 2 to 12, drawn again."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg", force=False)
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .cases import Case, Run
from .convergence import Histories
from .embeddings import BFS, SMOOTHED, Embeddings
from .examples import wheel

INK, ACCENT, SECOND, THIRD, WRONG = "#22303c", "#0072b2", "#d55e00", "#009e73", "#d62728"


def all_figures(
    cases: tuple[Case, ...], runs: dict[str, Histories], embedded: dict[str, Embeddings], folder: Path
) -> list[Path]:
    """Draw them all."""
    files = [figure_2(folder), figure_3(cases, folder), *figures_4_to_6(cases, folder)]
    files += [figure_7(runs["square"], folder), figure_8(runs["ellipse"], runs["rocket"], folder)]
    for name, numbers in (("rocket", (9, 11)), ("square", (10, 12))):
        for number, method in zip(numbers, (BFS, SMOOTHED), strict=True):
            files.append(_embedding(embedded[name], method, number, folder))
    return files


def figure_2(folder: Path) -> Path:
    """Two meshes whose boundary entries are the same."""
    figure, both = plt.subplots(1, 2, figsize=(7.6, 3.9), layout="constrained")
    for axes, radii in zip(both, ([1.0] * 7, [1.0, 1.6, 1.2, 0.7, 1.4, 1.1, 1.5]), strict=True):
        mesh = wheel(np.array(radii))
        draw_mesh(axes, mesh.points @ np.array([1, 1j]), mesh.triangles)
    figure.suptitle("Figure 2. All angles that face the boundary are 360/7 degrees in both", fontsize=10)
    return _save(figure, folder / "figure02.png")


def figure_3(cases: tuple[Case, ...], folder: Path) -> Path:
    """The sparsity structure of the Jacobian, with c as its last column."""
    case = cases[1]
    system = case.system()
    matrix = system.jacobian(system.pack(case.angles)).sparse().tocoo()
    figure, axes = plt.subplots(figsize=(6.4, 6.8), layout="constrained")
    axes.plot(matrix.col, matrix.row, "s", markersize=1.3, color=INK, markeredgewidth=0)
    counts = case.corners.counts
    blocks = ((0, "(3) triangles"), (counts.m, "(4) interior"), (counts.m + counts.w, "(1)-(2) edges"))
    ends = [start for start, _ in blocks[1:]] + [counts.equations]
    for (start, label), end in zip(blocks, ends, strict=True):
        axes.axhline(end - 0.5, color="0.75", linewidth=0.8)
        axes.text(-0.025, (start + end) / 2, label, rotation=90, ha="center", va="center",
                  transform=axes.get_yaxis_transform(), fontsize=9)  # fmt: skip
    axes.set(xlim=(-3, matrix.shape[1] + 6), ylim=(matrix.shape[0], -3), aspect="equal", yticks=[])
    axes.set_xlabel("cotangents, three to a triangle; last column: c")
    axes.set_title(
        f"Figure 3. Jacobian of the mesh of Figure 5: {matrix.shape[0]} x {matrix.shape[1]},\n"
        f"{matrix.nnz} entries, of which {system.jacobian(system.pack(case.angles)).stored} numbers are stored",
        fontsize=10,
    )
    return _save(figure, folder / "figure03.png")


def figures_4_to_6(cases: tuple[Case, ...], folder: Path) -> list[Path]:
    """The three meshes."""
    paths = []
    for case in cases:
        figure, axes = plt.subplots(figsize=(5.2, 5.2), layout="constrained")
        draw_mesh(axes, case.truth, case.piece.triangles)
        c = case.corners.counts
        axes.set_title(
            f"Figure {case.figure}. {c.v} vertices, {c.e} edges, {c.m} elements, {c.w} interior,\n"
            f"Jacobian {c.equations} x {c.unknowns + 1} with c",
            fontsize=10,
        )
        paths.append(_save(figure, folder / f"figure{case.figure:02d}.png"))
    return paths


def figure_7(square: Histories, folder: Path) -> Path:
    """Newton and BiCG-Newton on the uniform grid."""
    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    _history(axes, square.newton, ":", "s", INK, "Newton (7)")
    _history(axes, square.paper, "-", "o", ACCENT, r"inner-outer, $1.1^{-i}$")
    _history(axes, square.dembo, "--", "^", THIRD, r"inner-outer, $2^{-i}$")
    _history(axes, square.sines, "-", "D", SECOND, r"$1.1^{-i}$ with sine products")
    _finish_history(axes, "Figure 7. Uniform grid of Figure 4, c unknown, from pi/3")
    axes.set_xlim(-10, 1.02 * max(square.newton.inner, square.paper.inner))
    return _save(figure, folder / "figure07.png")


def figure_8(ellipse: Histories, rocket: Histories, folder: Path) -> Path:
    """BiCG-Newton on the unstructured meshes: the paper's range on the left, all of it on the right."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained", sharey=True)
    for axes in (left, right):
        _history(axes, ellipse.paper, "-", "o", ACCENT, r"Figure 5, $1.1^{-i}$")
        _history(axes, rocket.paper, ":", "o", INK, r"Figure 6, $1.1^{-i}$")
        _history(axes, ellipse.sines, "-", "D", SECOND, "Figure 5, with sine products")
        _history(axes, rocket.sines, ":", "D", THIRD, "Figure 6, with sine products")
        _history(axes, ellipse.newton, "-.", "s", "0.6", "Figure 5, Newton (7): no progress")
    _finish_history(left, "Figure 8. Unstructured meshes, c unknown: the first 400 steps")
    left.set_xlim(-8, 400)
    _finish_history(right, "The whole history")
    right.set_xscale("symlog", linthresh=100)
    right.set_xlim(0, 3e4)
    left.legend().remove()
    return _save(figure, folder / "figure08.png")


def _embedding(found: Embeddings, method: str, number: int, folder: Path) -> Path:
    """One embedding, from the first triangle of :attr:`Embeddings.root`."""
    turned, errors = found.turned[method], found.errors[method]
    figure, axes = plt.subplots(figsize=(5.4, 5.6), layout="constrained")
    draw_mesh(axes, found.shown(method), found.case.piece.triangles, mark=True)
    axes.set_title(
        f"Figure {number}. {method}, angles off by up to {found.run.angle_error:.0e}:\n"
        f"{turned[found.root]} turned over, error {errors[found.root]:.1g} of the diameter\n"
        f"(of {len(turned)} first triangles {(turned > 0).mean():.0%} turn some over, {turned.max()} at most)",
        fontsize=10,
    )
    return _save(figure, folder / f"figure{number:02d}.png")


def draw_mesh(axes: Axes, z: NDArray, triangles: NDArray, *, mark: bool = False) -> None:
    """Edges of a mesh; with `mark`, triangles that are turned over filled."""
    points = np.column_stack([z.real, z.imag])
    corners = points[triangles]
    if mark:
        a, b, c = corners.transpose(1, 0, 2)
        area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        axes.add_collection(PolyCollection(corners[area <= 0], facecolor=WRONG, alpha=0.55, edgecolor="none"))
    sides = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    axes.add_collection(LineCollection(points[sides], colors=INK, linewidths=0.7))
    axes.update_datalim(points)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()


def _history(axes: Axes, run: Run, line: str, marker: str, colour: str, label: str) -> None:
    history = run.result.history
    axes.semilogy(
        history.inner_steps, history.residuals, line, marker=marker, markersize=4, linewidth=1.3, color=colour,
        label=label,
    )  # fmt: skip


def _finish_history(axes: Axes, title: str) -> None:
    axes.axhline(1e-6, color="0.8", linewidth=0.8, zorder=0)
    axes.set(xlabel="inner iterations (two products each)", ylabel="residual norm |F|", ylim=(1e-9, 1e2))
    axes.set_title(title, fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)


def _save(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path
