"""The result of a recovery: a frozen record of mesh, gauge and certificate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import meshio
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Recovery:
    """A mesh recovered from a matrix.

    Attributes
    ----------
    points : (n, 2) float64
        Coordinates; row i belongs to matrix row i. NaN where the matrix determines none.
    triangles : (m, 3) int64
        Cells, rows of `points`, counter-clockwise.
    component : (n,) int64
        Edge-connected piece of each point, -1 for points of no cell; a vertex shared by pieces carries the lowest
        label.
    hinges : (k,) int64
        Vertices shared by several pieces.
    scale : (number of pieces,) float64
        The factor c of each piece in A = c L + D.
    boundary : (b, 2) int64
        Directed boundary edges with the mesh on their left, loop by loop in running order.
    boundary_offsets : (loops + 1,) int64
        Loop k is ``boundary[boundary_offsets[k]:boundary_offsets[k + 1]]``.
    node_status : (n,) int8
        0 determined, 1 not determined by the matrix.
    status : {"certified", "uncertified"}
    reason : str
        Why, in one sentence.
    operator : str
        ``"laplacian"``, or ``"anisotropic laplacian"`` where a tensor was undone.
    backward_error : float
        Largest difference between an off-diagonal entry and the re-assembled one, relative to the
        largest off-diagonal entry of its row.
    n_holes : int or None
        Bounded boundary loops, over all pieces.
    timings : mapping of str to float
        Seconds by stage.
    warnings : tuple of str
    worst_entries : (k, 2) int64
        Rows and columns of the entries that fit worst, the suspects first, then the others, worst first; empty where
        all fit.
    worst_misfits : (k,) float64
        Their misfit, as in `backward_error`.
    standard_deviations : (n, 2) float64 or None
        One standard deviation of each coordinate, on request.
    chi_square : mapping or None
        With noise: ``statistic``, ``degrees_of_freedom``, ``p_value``, ``sigma``, ``largest``, ``largest_p_value``; see
        :func:`unassemble.certify.chi_square_verdict`.
    estimated_noise : float or None
        Standard deviation of independent errors of the entries that would leave the misfit found.
    suspects : (k, 2) int64
        Entries that the mesh would fit the others far better without, the gravest first.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    component: NDArray[np.int64]
    hinges: NDArray[np.int64]
    scale: NDArray[np.float64]
    boundary: NDArray[np.int64]
    boundary_offsets: NDArray[np.int64]
    node_status: NDArray[np.int8]
    status: str
    reason: str
    operator: str
    backward_error: float
    n_holes: int | None = None
    timings: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    worst_entries: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))
    worst_misfits: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    standard_deviations: NDArray[np.float64] | None = None
    chi_square: Mapping[str, float] | None = None
    estimated_noise: float | None = None
    suspects: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))

    @property
    def certified(self) -> bool:
        """Whether the re-assembled matrix is the given one."""
        return self.status == "certified"

    @property
    def n_points(self) -> int:
        """Number of points, determined or not."""
        return len(self.points)

    @property
    def n_cells(self) -> int:
        """Number of cells of all kinds."""
        return len(self.triangles)

    @property
    def n_components(self) -> int:
        """Number of edge-connected pieces."""
        return len(self.scale)

    def report(self) -> dict[str, Any]:
        """Everything but the mesh, ready for JSON; see :mod:`unassemble.report`."""
        from .report import build_report

        return build_report(self)

    def to_meshio(self) -> meshio.Mesh:
        """The mesh for meshio, with rows, pieces and boundary as point data."""
        from .export import to_meshio

        return to_meshio(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write ``.npz`` or any format of meshio, whole or not at all."""
        from .export import save

        save(self, path)

    def plot(self, path: str | PathLike[str] | None = None) -> Figure:
        """Draw the mesh; write it to `path` (``.png``, ``.svg``, ``.pdf``) where one is given."""
        from .plot import plot_recovery

        return plot_recovery(self, path)
