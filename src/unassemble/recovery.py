"""Results: one frozen type for each kind of answer, and what they share.

Files, reports, pictures and near-null spaces are made of a result from above, in :mod:`unassemble.outputs`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .topology.polygons import Polygons

if TYPE_CHECKING:
    import meshio
    from matplotlib.figure import Figure

    from .cells import Alternative


def _none(*columns: int) -> Callable[[], NDArray[np.int64]]:
    """Default of a field of indices: none, each of so many columns."""
    return lambda: np.empty((0, *columns), np.int64)


@dataclass(frozen=True, eq=False, kw_only=True)
class Recovery:
    """What was recovered from a matrix: the part that all kinds of answer share.

    Attributes
    ----------
    points : (n, 2) or (n, 3) float64
        Coordinates; row i belongs to matrix row i, or to node i of a vector-valued matrix, whose nodes are numbered
        by their first row. NaN where the matrix determines none.
    triangles : (m, 3) int64
        Cells, rows of `points`, counter-clockwise in the plane.
    component : (n,) int64
        Edge-connected piece of each point, -1 for points of no cell; a vertex shared by pieces carries the lowest
        label.
    hinges : (k,) int64
        Vertices shared by several pieces.
    scale : (number of pieces,) float64
        The factor c of each piece in A = c L + D. For elasticity the mean shear modulus of the piece's cells, on the
        mesh as it is given here; NaN where no cells are recognised.
    boundary : (b, 2) int64
        Directed boundary edges of planar cells with the mesh on their left, loop by loop in running order.
    boundary_offsets : (loops + 1,) int64
        Loop k is ``boundary[boundary_offsets[k]:boundary_offsets[k + 1]]``.
    node_status : (n,) int8
        0 determined, 1 not determined by the matrix.
    status : {"certified", "ambiguous", "uncertified"}
        Whether the mesh gives the matrix back, and no other mesh is known that does.
    uniqueness : {"proved", "searched", "ambiguous", None}
        What is known of other meshes that fit: none can, a search found none, there is one; None where this one does
        not fit.
    reason : str
        Why, in one sentence.
    operator : str
        ``"laplacian"``, or ``"anisotropic laplacian"`` where a tensor was undone; ``"elasticity"``, or ``"vector
        laplacian"`` where the directions of a vector-valued matrix are not coupled; ``"frame or shell"``, ``"plane
        frame"`` or ``"plate"`` where nodes have rotations too; ``"truss"``; ``"surface laplacian"``.
    reaction : float
        The factor s of the mass matrix in the operator, 0 if none.
    backward_error : float
        Largest difference between an off-diagonal entry and the re-assembled one, relative to the largest
        off-diagonal entry of its row. For elasticity whose cells are not recognised the largest residual of a valid
        identity, relative to the size of its row.
    timings : mapping of str to float
        Seconds by stage.
    warnings : tuple of str
    worst_entries : (k, 2) int64
        Rows and columns of the entries that fit worst, worst first, suspects before others; empty where all fit.
    worst_misfits : (k,) float64
        Their misfit, as in `backward_error`.
    node_of_row, direction_of_row : (N,) int64 or None
        Vector-valued matrices: node and direction of each matrix row.
    numbering : str
        Vector-valued matrices: how the unknowns stand, ``"interleaved"``, ``"by component"``, ``"pattern"`` (in no
        order, found by the pattern) or ``"given"``.
    choice : str
        Why the matrix was taken for this operator's, where that was not asked for.
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
    uniqueness: str | None = None
    reason: str
    operator: str
    reaction: float = 0.0
    backward_error: float
    timings: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    worst_entries: NDArray[np.int64] = field(default_factory=_none(2))
    worst_misfits: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    node_of_row: NDArray[np.int64] | None = None
    direction_of_row: NDArray[np.int64] | None = None
    numbering: str = ""
    choice: str = ""

    # Put here by :mod:`unassemble.outputs`.
    report: ClassVar[Callable[[Recovery], dict[str, Any]]]
    to_meshio: ClassVar[Callable[[Recovery], meshio.Mesh]]
    save: ClassVar[Callable[[Recovery, str | PathLike[str]], None]]
    plot: ClassVar[Callable[..., Figure]]
    rigid_body_modes: ClassVar[Callable[[Recovery], NDArray[np.float64]]]

    @property
    def certified(self) -> bool:
        """Whether the re-assembled matrix is the given one, and no other mesh is known that gives it back."""
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
        return 0

    @property
    def n_components(self) -> int:
        """Number of edge-connected pieces."""
        return len(self.scale)

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names; polygons are not among them."""
        return _occurring(triangle=self.triangles)

    @property
    def element(self) -> str | None:
        """``P1``, ``P2``, ``Q1``, ``Q2`` or ``S2`` (serendipity), or ``mixed``; None where it is not known."""
        kinds = {_ELEMENTS[kind] for kind in self.cells if kind in _ELEMENTS}
        return "mixed" if len(kinds) > 1 else next(iter(kinds), None)

    @property
    def dim(self) -> int:
        """Dimension of space."""
        return self.points.shape[1]

    @property
    def vector_valued(self) -> bool:
        """Whether the matrix has several rows per node."""
        return self.node_of_row is not None

    @property
    def block_size(self) -> int:
        """Unknowns per node."""
        return 1 if self.direction_of_row is None else int(self.direction_of_row.max()) + 1


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarMesh(Recovery):
    """A planar mesh of triangles: from a scalar matrix, or from directions that are not coupled.

    Attributes
    ----------
    n_holes : int
        Bounded boundary loops, over all pieces.
    polygons_offsets : (polygons + 1,) int64
    polygons_data : (polygons_offsets[-1],) int64
        Cells that the matrix leaves undivided, counter-clockwise: polygon k is
        ``polygons_data[polygons_offsets[k]:polygons_offsets[k + 1]]``.
    standard_deviations : (n, 2) float64 or None
        One standard deviation of each coordinate, on request.
    chi_square : mapping or None
        With noise, or entries that were rounded: ``statistic``, ``degrees_of_freedom``, ``p_value``, ``sigma``,
        ``largest``, ``largest_p_value``; see :func:`unassemble.certify.chi_square_verdict`.
    estimated_noise : float or None
        Standard deviation of independent errors of the entries that would leave the misfit found.
    suspects : (k, 2) int64
        Entries that the mesh would fit the others far better without, the gravest first.
    alternatives : tuple of Alternative
        Cells in doubt where other meshes fit as well, and what these have instead; see
        :class:`unassemble.cells.Alternative`.
    eliminated_points : (k, 2) float64
        Vertices that the matrix has no rows for, where it determines them; see :mod:`unassemble.boundaries`.
    """

    n_holes: int
    polygons_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    polygons_data: NDArray[np.int64] = field(default_factory=_none())
    standard_deviations: NDArray[np.float64] | None = None
    chi_square: Mapping[str, float] | None = None
    estimated_noise: float | None = None
    suspects: NDArray[np.int64] = field(default_factory=_none(2))
    alternatives: tuple[Alternative, ...] = ()
    eliminated_points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def element(self) -> str:
        """``P1``: a polygon stands for triangles."""
        return "P1"

    @property
    def n_polygons(self) -> int:
        """Number of cells that the matrix leaves undivided."""
        return len(self.polygons_offsets) - 1

    @property
    def largest_deviation(self) -> float | None:
        """The largest error bar of a coordinate, where there are any."""
        deviations = self.standard_deviations
        if deviations is None or not np.isfinite(deviations).any():
            return None
        return float(np.nanmax(deviations))

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


@dataclass(frozen=True)
class Evidence:
    """How uniquely the matrix determines a piece of a body or structure.

    Attributes
    ----------
    null_dimension : int
        Independent fields that satisfy all valid identities, nodes that stay loose left out. 4 in space, 3 in the
        plane: translations and scale. One less where no field but translations is exact.
    residual : float
        Singular value of the coordinates: norm of the residual over the norm of the centred field.
    gap : float
        Singular value of the best field that is none of these; an upper bound on large bodies.
    rows : int
        Nodes with valid identities.
    settled : bool
        Whether the residual is that small beside the gap that no other field has a part in the coordinates.
    """

    null_dimension: int
    residual: float
    gap: float
    rows: int
    settled: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Mechanical(Recovery):
    """What bodies and structures share: positions that solve linear identities.

    Attributes
    ----------
    evidence : tuple of Evidence
        The null space of each piece's identities.
    quads : (m, 4) int64
        Cells of four corners, counter-clockwise in the plane.
    """

    evidence: tuple[Evidence, ...] = ()
    quads: NDArray[np.int64] = field(default_factory=_none(4))


@dataclass(frozen=True, eq=False, kw_only=True)
class Body(Mechanical):
    """An elastic body in the plane or in space.

    Attributes
    ----------
    tetrahedra, hexahedra : (m, 4), (m, 8) int64
        Further cells, in meshio's order and positively oriented. Of quadratic cells, as in `triangles` and `quads`,
        these are the corners.
    mid_nodes : (m, k) int64
        Quadratic cells: the nodes that each has besides its corners, in meshio's order; else empty.
    poisson_ratio : float or None
        Where it is one number; that of plane strain in the plane.
    lame : (n_cells, 2) float64
        Lambda and mu of each cell, as in `scale`.
    """

    tetrahedra: NDArray[np.int64] = field(default_factory=_none(4))
    hexahedra: NDArray[np.int64] = field(default_factory=_none(8))
    mid_nodes: NDArray[np.int64] = field(default_factory=_none(0))
    poisson_ratio: float | None = None
    lame: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names."""
        corners = _occurring(triangle=self.triangles, quad=self.quads, tetra=self.tetrahedra, hexahedron=self.hexahedra)
        if not self.mid_nodes.size:
            return corners
        whole = {kind: np.hstack([cells, self.mid_nodes]) for kind, cells in corners.items()}
        return {f"{kind}{cells.shape[1]}": cells for kind, cells in whole.items()}


@dataclass(frozen=True, eq=False, kw_only=True)
class Structure(Mechanical):
    """A frame, shell, plate or truss.

    Attributes
    ----------
    lines : (m, 2) int64
        Members.
    """

    lines: NDArray[np.int64] = field(default_factory=_none(2))

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Members and shell cells, each kind that occurs, by meshio's names."""
        return _occurring(line=self.lines, triangle=self.triangles, quad=self.quads)

    @property
    def element(self) -> None:
        """None: members and shell cells are read off the graph, and what they are is not looked for."""
        return None


_ELEMENTS = {
    **dict.fromkeys(("triangle", "tetra"), "P1"),
    **dict.fromkeys(("triangle6", "tetra10"), "P2"),
    **dict.fromkeys(("quad", "hexahedron"), "Q1"),
    **dict.fromkeys(("quad9", "hexahedron27"), "Q2"),
    **dict.fromkeys(("quad8", "hexahedron20"), "S2"),
}


def _occurring(**kinds: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    return {kind: cells for kind, cells in kinds.items() if len(cells)}
