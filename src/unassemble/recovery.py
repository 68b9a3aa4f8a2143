"""The result of a recovery: a frozen record of mesh, gauge and certificate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .topology.polygons import Polygons

if TYPE_CHECKING:
    import meshio
    from matplotlib.figure import Figure

    from .cells.alternatives.corners import Alternative
    from .elasticity.results import Evidence


def _none(*columns: int) -> Callable[[], NDArray[np.int64]]:
    """Default of a field of indices: none, each of so many columns."""
    return lambda: np.empty((0, *columns), np.int64)


@dataclass(frozen=True, eq=False, kw_only=True)
class Recovery:
    """A mesh recovered from a matrix, scalar or vector-valued.

    Attributes
    ----------
    points : (n, 2) or (n, 3) float64
        Coordinates; row i belongs to matrix row i, or to node i of a vector-valued matrix, whose nodes are numbered
        by their first row. NaN where the matrix determines none.
    triangles : (m, 3) int64
        Cells, rows of `points`, counter-clockwise.
    component : (n,) int64
        Edge-connected piece of each point, -1 for points of no cell; a vertex shared by pieces carries the lowest
        label.
    hinges : (k,) int64
        Vertices shared by several pieces.
    scale : (number of pieces,) float64
        The factor c of each piece in A = c L + D. For elasticity the mean shear modulus of the piece's cells, on the
        mesh as it is given here; NaN where no cells are recognised.
    boundary : (b, 2) int64
        Directed boundary edges with the mesh on their left, loop by loop in running order; none in space.
    boundary_offsets : (loops + 1,) int64
        Loop k is ``boundary[boundary_offsets[k]:boundary_offsets[k + 1]]``.
    node_status : (n,) int8
        0 determined, 1 not determined by the matrix.
    status : {"certified", "uncertified"}
    reason : str
        Why, in one sentence.
    operator : str
        ``"laplacian"``, or ``"anisotropic laplacian"`` where a tensor was undone; ``"elasticity"``, or ``"vector
        laplacian"`` where the directions of a vector-valued matrix are not coupled; ``"frame or shell"``, ``"plane
        frame"`` or ``"plate"`` where nodes have rotations too.
    backward_error : float
        Largest difference between an off-diagonal entry and the re-assembled one, relative to the
        largest off-diagonal entry of its row. For elasticity whose cells are not recognised the largest residual of
        a valid identity, relative to the size of its row.
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
        With noise, or entries that were rounded: ``statistic``, ``degrees_of_freedom``, ``p_value``, ``sigma``,
        ``largest``, ``largest_p_value``; see :func:`unassemble.certify.chi_square_verdict`.
    quads, tetrahedra, hexahedra : (m, 4), (m, 4), (m, 8) int64
        Further cells, in meshio's order and positively oriented; empty where there are none. Of quadratic cells these
        are the corners.
    lines : (m, 2) int64
        Members of frames.
    mid_nodes : (m, k) int64
        Quadratic cells: the nodes that each has besides its corners, in meshio's order; else empty.
    node_of_row, direction_of_row : (N,) int64 or None
        Vector-valued matrices: node and direction of each matrix row.
    numbering : str
        Vector-valued matrices: how the unknowns stand, ``"interleaved"``, ``"by component"``, ``"pattern"`` (in no
        order, found by the pattern) or ``"given"``.
    choice : str
        Why the matrix was taken for this operator's, where that was not asked for.
    poisson_ratio : float or None
        Elasticity, where it is one number; that of plane strain in the plane.
    lame : (n_cells, 2) float64
        Elasticity: lambda and mu of each cell, as in `scale`.
    evidence : tuple of Evidence
        Elasticity: the null space of each piece's identities; see :class:`unassemble.elasticity.Evidence`.
    polygons_offsets : (polygons + 1,) int64
    polygons_data : (polygons_offsets[-1],) int64
        Cells that the matrix leaves undivided, counter-clockwise: polygon k is
        ``polygons_data[polygons_offsets[k]:polygons_offsets[k + 1]]``.
    estimated_noise : float or None
        Standard deviation of independent errors of the entries that would leave the misfit found.
    suspects : (k, 2) int64
        Entries that the mesh would fit the others far better without, the gravest first.
    alternatives : tuple of Alternative
        Cells in doubt where other meshes fit as well, and what these have instead; see
        :class:`unassemble.cells.Alternative`.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64] = field(default_factory=_none(3))
    component: NDArray[np.int64]
    hinges: NDArray[np.int64] = field(default_factory=_none())
    scale: NDArray[np.float64]
    boundary: NDArray[np.int64] = field(default_factory=_none(2))
    boundary_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    node_status: NDArray[np.int8]
    status: str
    reason: str
    operator: str
    backward_error: float
    n_holes: int | None = None
    timings: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    worst_entries: NDArray[np.int64] = field(default_factory=_none(2))
    worst_misfits: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    standard_deviations: NDArray[np.float64] | None = None
    chi_square: Mapping[str, float] | None = None
    quads: NDArray[np.int64] = field(default_factory=_none(4))
    tetrahedra: NDArray[np.int64] = field(default_factory=_none(4))
    hexahedra: NDArray[np.int64] = field(default_factory=_none(8))
    lines: NDArray[np.int64] = field(default_factory=_none(2))
    mid_nodes: NDArray[np.int64] = field(default_factory=_none(0))
    node_of_row: NDArray[np.int64] | None = None
    direction_of_row: NDArray[np.int64] | None = None
    numbering: str = ""
    choice: str = ""
    poisson_ratio: float | None = None
    lame: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    evidence: tuple[Evidence, ...] = ()
    polygons_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    polygons_data: NDArray[np.int64] = field(default_factory=_none())
    estimated_noise: float | None = None
    suspects: NDArray[np.int64] = field(default_factory=_none(2))
    alternatives: tuple[Alternative, ...] = ()

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
        return sum(map(len, self.cells.values())) + self.n_polygons

    @property
    def n_polygons(self) -> int:
        """Number of cells that the matrix leaves undivided."""
        return len(self.polygons_offsets) - 1

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names; polygons are not among them."""
        kinds = {
            "line": self.lines,
            "triangle": self.triangles,
            "quad": self.quads,
            "tetra": self.tetrahedra,
            "hexahedron": self.hexahedra,
        }
        if not self.mid_nodes.size:
            return {kind: cells for kind, cells in kinds.items() if len(cells)}
        return {
            f"{kind}{cells.shape[1] + self.mid_nodes.shape[1]}": np.hstack([cells, self.mid_nodes])
            for kind, cells in kinds.items()
            if len(cells)
        }

    def divided(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles, with the polygons in fans.

        Returns
        -------
        triangles : (m, 3) int64
        outline : (m, 3) bool
            False for sides, from each corner to the next, that are diagonals of polygons.
        """
        fans, outline = Polygons(self.polygons_offsets, self.polygons_data).fans()
        return np.concatenate([self.triangles, fans]), np.concatenate([np.ones(self.triangles.shape, bool), outline])

    @property
    def dim(self) -> int:
        """Dimension of space."""
        return self.points.shape[1]

    @property
    def vector_valued(self) -> bool:
        """Whether the matrix has several rows per node."""
        return self.node_of_row is not None

    @property
    def mechanical(self) -> bool:
        """Whether the matrix is a stiffness matrix of a solid or a structure, not of a scalar field or several."""
        return bool(self.evidence)

    @property
    def n_components(self) -> int:
        """Number of edge-connected pieces."""
        return len(self.scale)

    def rigid_body_modes(self) -> NDArray[np.float64]:
        """Near-null space of a vector-valued matrix, (N, 3) or (N, 6), rows as in the matrix: PyAMG's ``B``.

        Translations, then rotations; nodes without coordinates get translations only. The directions of a vector
        Laplacian are not coupled: it has translations only, (N, 2) or (N, 3).

        Raises
        ------
        InputError
            If the matrix is scalar.
        """
        from .modes import modes_of

        return modes_of(self)

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
