"""Draw what comes back of PyAMG's airfoil, whose outer triangles were taken out: what is plausible only, and the truth.

python docs/make_boundaries.py
"""

from pathlib import Path

import numpy as np
import pyamg
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from unassemble import recover

INK, FILL, PLAUSIBLE = "#16324f", "#7ba3cc", "#e2552f"


def main() -> None:
    example = pyamg.gallery.load_example("airfoil")
    found = recover(example["A"])
    true = inner(example)
    known = found.node_status == 0
    z, w = found.points @ [1, 1j], true @ [1, 1j]
    maps = [np.polyfit(source[known], w[known], 1) for source in (z, np.conj(z))]
    ends = [np.polyval(fit, source) for fit, source in zip(maps, (z, np.conj(z)), strict=True)]
    there = min(ends, key=lambda end: float(np.abs(end - w)[known].max()))
    figure = Figure(figsize=(9, 4.5), layout="constrained", dpi=120)
    FigureCanvasAgg(figure)
    for axes, title in zip(figure.subplots(1, 2), ("what comes back", "the plausible points nearer by"), strict=True):
        for points, colour, width in ((w, "#bbbbbb", 2.2), (there, FILL, 0.8)):
            sides = points[found.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
            axes.add_collection(LineCollection(np.stack([sides.real, sides.imag], axis=-1), colors=colour, lw=width))
        for status, colour, size in ((0, INK, 3), (2, PLAUSIBLE, 22)):
            chosen = there[found.node_status == status]
            axes.scatter(chosen.real, chosen.imag, s=size, color=colour, zorder=3)
        axes.set(aspect="equal", title=title)
        axes.axis("off")
    rim = there[found.node_status == 2]
    first = rim[np.argmax(np.abs(there - w)[found.node_status == 2])]
    span = 0.12 * np.ptp(w.real)
    axes.set(xlim=(first.real - span, first.real + span), ylim=(first.imag - span, first.imag + span))
    figure.savefig(Path(__file__).parent / "_static" / "plausible-rim.png")


def inner(example: dict) -> np.ndarray:
    """(260, 2) true positions of the rows: vertices in the order of the file, without those on the boundary."""
    triangles, points = example["elements"], example["vertices"]
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs, count = np.unique(sides, axis=0, return_counts=True)
    return points[np.setdiff1d(np.arange(len(points)), pairs[count == 1])]


if __name__ == "__main__":
    main()
