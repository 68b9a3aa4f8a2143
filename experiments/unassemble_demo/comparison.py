"""The true mesh beside the recovered one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from unassemble import PlanarMesh
from unassemble.files import whole_file
from unassemble.planar import fit_similarity


def plot_comparison(true_points: NDArray[np.float64], mesh: PlanarMesh, path: Path) -> Figure:
    """Draw the true mesh, or its mirror image, beside the recovered one, each piece of which is moved onto it.

    Row i of `true_points`, (n, 2), belongs to matrix row i.
    """
    a, b, c = true_points[mesh.divided()[0]].swapaxes(0, 1) @ [1, 1j]
    truth = true_points * [1, np.sign(np.sum(np.conj(b - a) * (c - a)).imag)]  # cells run counter-clockwise
    found = aligned(mesh.points, truth, mesh.component)
    wide, high = np.ptp(truth[mesh.component >= 0], axis=0)
    figure = Figure(figsize=(13, 1 + 6 * high / wide), layout="constrained")
    for ax, points, name in zip(figure.subplots(1, 2), (truth, found), ("true", "recovered"), strict=True):
        replace(mesh, points=points).plot(ax=ax)
        ax.set_title(name, style="italic")
    error = largest_error(found, truth)
    figure.suptitle(f"{mesh.status}, largest error {error:.1e} of the diameter", weight="bold")
    with whole_file(path, path.suffix) as draft:
        figure.savefig(draft, dpi=160)
    return figure


def aligned(points: NDArray[np.float64], target: NDArray[np.float64], component: NDArray) -> NDArray[np.float64]:
    """(n, 2) points, each piece moved onto its target by least squares over similarities, mirror images included."""
    moved = np.array(points)
    for label in np.unique(component[component >= 0]):
        rows = component == label
        source, there = points[rows] @ [1, 1j], target[rows] @ [1, 1j]
        fits = [fit_similarity(source, there, mirror=mirror) for mirror in (False, True)]
        z = min(fits, key=lambda fit: fit[1])[0](source)
        moved[rows] = np.column_stack([z.real, z.imag])
    return moved


def largest_error(moved: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Largest distance between points, relative to the diagonal of the box around the target."""
    rows = np.isfinite(moved).all(axis=1)
    distance = np.linalg.norm(moved[rows] - target[rows], axis=1)
    return float(distance.max() / np.linalg.norm(np.ptp(target[rows], axis=0)))
