"""Figures 9 to 12: the paper's embeddings from angles of few digits, from every first triangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unassemble.paper import aligned, bfs_embedding, coordinate_smoothing, distance, inverted, least_squares_layout

from .cases import Case, Run
from .multilevel import multilevel_embedding
from .tables import Cell, Table, table

# The residuals at which the iteration is stopped. The paper gives 1e-4 for the rocket and an angle error of
# O(1e-2) for the grid, which the iteration has there.
RESIDUALS = {"rocket": 1e-4, "square": 0.1}

BFS, MODIFIED, SMOOTHED = "BFS-Embedding", "Modified BFS-Embedding", "Modified BFS, Coordinate-Smoothing"
MULTILEVEL, BOTH, LAYOUT = "multilevel", "multilevel, Coordinate-Smoothing", "least-squares layout"


@dataclass(frozen=True, eq=False)
class Embeddings:
    """What every embedding makes of the same rough angles.

    Attributes
    ----------
    case : Case
    run : Run
        Where the angles come from: the BiCG-Newton iteration, stopped early.
    turned : dict of (roots,) int64
        Triangles turned over, by embedding, for each first triangle; one number where there is no such choice.
    errors : dict of (roots,) float64
        Largest distance from the true mesh, relative to its diameter.
    """

    case: Case
    run: Run
    turned: dict[str, NDArray[np.int64]]
    errors: dict[str, NDArray[np.float64]]

    @property
    def root(self) -> int:
        """The first triangle in the middle of those from which BFS-Embedding is not planar, as in the paper's figures.

        By triangles turned over, then by error.
        """
        order = np.lexsort((self.errors[BFS], self.turned[BFS]))
        order = order[self.turned[BFS][order] > 0]
        return int(order[len(order) // 2])

    def shown(self, name: str) -> NDArray[np.complex128]:
        """(n,) one of the paper's embeddings from that triangle, moved onto the true mesh."""
        return aligned(paper_embeddings(self.case, self.run.angles, self.root)[name], self.case.truth)


def over_all_roots(case: Case) -> Embeddings:
    """All embeddings of a mesh of :data:`RESIDUALS`."""
    run = case.run("1.1^-i", tolerance=RESIDUALS[case.name])
    found: dict[str, list[NDArray]] = {BFS: [], MODIFIED: [], SMOOTHED: []}
    for root in range(len(case.piece.triangles)):
        for name, z in paper_embeddings(case, run.angles, root).items():
            found[name].append(z)
    patches, _ = multilevel_embedding(case.piece, run.angles)
    found |= {
        MULTILEVEL: [patches],
        BOTH: [coordinate_smoothing(case.piece, run.angles, patches)],
        LAYOUT: [least_squares_layout(case.piece, run.angles)],
    }
    turned = {name: np.array([inverted(z, case.piece.triangles) for z in each]) for name, each in found.items()}
    errors = {name: np.array([distance(z, case.truth) for z in each]) for name, each in found.items()}
    return Embeddings(case, run, turned, errors)


def paper_embeddings(case: Case, angles: NDArray, root: int) -> dict[str, NDArray[np.complex128]]:
    """The three of section 5, from one first triangle."""
    averaged = bfs_embedding(case.piece, angles, root=root, averaging=True)
    return {
        BFS: bfs_embedding(case.piece, angles, root=root),
        MODIFIED: averaged,
        SMOOTHED: coordinate_smoothing(case.piece, angles, averaged),
    }


def roots_table(found: dict[str, Embeddings]) -> Table:
    """Distributions over all first triangles."""
    rows: list[list[Cell]] = []
    for f in found.values():
        label = f"Figure {f.case.figure}, angles off by {f.run.angle_error:.0e}"
        for name, turned in f.turned.items():
            errors = f.errors[name]
            low, middle, high = np.quantile(turned, [0.25, 0.5, 0.75])
            rows.append([
                label, name, len(turned), f"{(turned == 0).mean():.0%}", f"{low:.0f}, {middle:.0f}, {high:.0f}",
                int(turned.max()), float(np.median(errors)), float(errors.max()),
            ])  # fmt: skip
    columns = ("mesh", "embedding", "roots", "planar", "triangles turned over: quartiles", "most", "error: median",
               "greatest")  # fmt: skip
    return table("roots", columns, rows)
