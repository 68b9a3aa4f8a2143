"""Draw the picture of the README: a matrix on the left, the mesh recovered from it on the right.

python docs/make_picture.py
"""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from unassemble import recover
from unassemble_demo import lake

INK, FILL, SHORE, ISLAND = "#16324f", "#7ba3cc", "#16324f", "#e2552f"


def main() -> None:
    specimen = lake(0.075)
    found = recover(specimen.matrix)
    figure = Figure(figsize=(11, 3.9), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.75])
    matrix = specimen.matrix.tocoo()
    left.scatter(matrix.col, matrix.row, s=0.6, c=INK, linewidths=0)
    left.set(aspect="equal", xlim=(0, matrix.shape[0]), ylim=(matrix.shape[0], 0), xticks=[], yticks=[])
    left.set_title(f"in: a sparse matrix, {matrix.shape[0]} rows in random order", fontsize=11)
    sides = found.points[found.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
    right.add_collection(LineCollection(sides, colors=FILL, linewidths=0.35))
    for start, stop in zip(found.boundary_offsets[:-1], found.boundary_offsets[1:], strict=True):
        loop = found.points[found.boundary[start:stop, 0]]
        x, y = loop.T
        outer = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0
        right.add_collection(LineCollection([np.vstack([loop, loop[:1]])], colors=SHORE if outer else ISLAND, lw=1.4))
    right.autoscale_view()
    right.set_aspect("equal")
    right.axis("off")
    right.set_title(f"out: its mesh, {found.status}; backward error {found.backward_error:.0e}", fontsize=11)
    figure.savefig(Path(__file__).parent / "_static" / "matrix-to-mesh.png")


if __name__ == "__main__":
    main()
