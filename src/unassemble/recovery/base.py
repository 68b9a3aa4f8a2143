"""What all kinds of answer share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import meshio
    from matplotlib.figure import Figure


def none_of(*columns: int) -> Callable[[], NDArray[np.int64]]:
    """Default of a field of indices: none, each of so many columns."""
    return lambda: np.empty((0, *columns), np.int64)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Recovery:
    """What was recovered from a matrix: the part that all kinds of answer share."""

    #: (n, 2) or (n, 3) coordinates; row i belongs to matrix row i, or to node i of a vector-valued matrix, whose nodes
    #: are numbered by their first row. NaN where the matrix determines none.
    points: NDArray[np.float64]
    #: (m, 3) cells, rows of `points`, counter-clockwise in the plane.
    triangles: NDArray[np.int64] = field(default_factory=none_of(3))
    #: (n,) edge-connected piece of each point, the lowest of those that share it; -1 for points of no cell.
    component: NDArray[np.int64]
    hinges: NDArray[np.int64] = field(default_factory=none_of())  #: (k,) vertices shared by several pieces.
    #: (number of pieces,) the factor c of each piece in A = c L + D, or of each region where there are some. For
    #: elasticity the mean shear modulus of the piece's cells, on the mesh as it is given here; NaN where no cells are
    #: recognised.
    scale: NDArray[np.float64]
    #: (b, 2) directed boundary edges of planar cells with the mesh on their left, loop by loop in running order.
    boundary: NDArray[np.int64] = field(default_factory=none_of(2))
    #: (loops + 1,) loop k is ``boundary[boundary_offsets[k]:boundary_offsets[k + 1]]``.
    boundary_offsets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    #: (n,) 0 determined, 1 not determined by the matrix, 2 plausible, a position that entries do not determine.
    node_status: NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, np.int8))
    #: ``"certified"``, ``"ambiguous"`` or ``"uncertified"``, whether the mesh gives the matrix back, with entries to
    #: spare, and no other mesh is known that does, but for grids (``"conventional"``).
    status: str = "uncertified"
    #: Of other meshes that fit ``"proved"``, none can; ``"searched"``, a search found none; ``"conventional"``, no
    #: other grid of equal cells does, while meshes that are no grids may; ``"ambiguous"``, there is one, as the status
    #: says, too; None where this one does not fit.
    uniqueness: str | None = None
    reason: str = ""  #: Why, in one sentence or two.
    advice: str = ""  #: What to do next, where the mesh is not certified.
    #: ``"laplacian"``, or ``"anisotropic laplacian"`` where a tensor was undone; ``"mass"``; ``"elasticity"``;
    #: ``"frame or shell"``, ``"plane frame"``, ``"plate"`` or ``"beam"`` where nodes have rotations too; ``"truss"``;
    #: ``"structure"`` where they have displacements only and elements are of any kind; ``"surface laplacian"``.
    operator: str
    reaction: float = 0.0  #: The factor s of the mass matrix in the operator, 0 if none.
    #: Beside a mass matrix, mass over area or volume, on the mesh as it is given here; 1 where the mesh is in the size
    #: that makes it so.
    density: float | None = None
    #: Largest difference between an off-diagonal entry and the re-assembled one, relative to the largest off-diagonal
    #: entry of its row. For elasticity whose cells are not recognised the largest residual of a valid identity,
    #: relative to the size of its row.
    backward_error: float = np.inf
    timings: Mapping[str, float] = field(default_factory=dict)  #: Seconds by stage.
    warnings: tuple[str, ...] = ()  #: What was changed, guessed or left open.
    #: (k, 2) rows and columns of the entries that fit worst, worst first, suspects before others; empty where all fit.
    worst_entries: NDArray[np.int64] = field(default_factory=none_of(2))
    #: (k,) their misfit, as in `backward_error`.
    worst_misfits: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    node_of_row: NDArray[np.int64] | None = None  #: (N,) node of each matrix row, if it is vector-valued.
    direction_of_row: NDArray[np.int64] | None = None  #: (N,) and its direction.
    #: Of vector-valued matrices, how the unknowns stand, ``"interleaved"``, ``"by component"``, ``"pattern"`` (in no
    #: order, found by the pattern) or ``"given"``.
    numbering: str = ""
    choice: str = ""  #: Why the matrix was taken for this operator's, where that was not asked for.

    # Put here by :mod:`unassemble.outputs`.
    report: ClassVar[Callable[..., dict[str, Any]]]
    to_meshio: ClassVar[Callable[[Recovery], meshio.Mesh]]
    save: ClassVar[Callable[[Recovery, str | PathLike[str]], None]]
    plot: ClassVar[Callable[..., Figure]]
    _repr_html_: ClassVar[Callable[[Recovery], str]]
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
        return int(self.component.max(initial=-1)) + 1

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names; polygons are not among them."""
        return occurring(triangle=self.triangles)

    @property
    def element(self) -> str | None:
        """``P1`` to ``P3``, ``Q1``, ``Q2`` or ``S2`` (serendipity), or ``mixed``; None where it is not known."""
        kinds = {ELEMENT_NAMES[kind] for kind in self.cells if kind in ELEMENT_NAMES}
        kinds |= {"P1"} if self.n_polygons else set()  # one stands for triangles
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


ELEMENT_NAMES = {
    **dict.fromkeys(("triangle", "tetra"), "P1"),
    **dict.fromkeys(("triangle6", "tetra10"), "P2"),
    "triangle10": "P3",
    **dict.fromkeys(("quad", "hexahedron"), "Q1"),
    **dict.fromkeys(("quad9", "hexahedron27"), "Q2"),
    **dict.fromkeys(("quad8", "hexahedron20"), "S2"),
}


def occurring(**kinds: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Kinds of cells that there are any of."""
    return {kind: cells for kind, cells in kinds.items() if len(cells)}


def with_mid_nodes(corners: dict[str, NDArray[np.int64]], mid_nodes: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Cells with their further nodes, where they have any."""
    if not mid_nodes.size:
        return corners
    whole = {kind: np.hstack([cells, mid_nodes]) for kind, cells in corners.items()}
    return {f"{kind}{cells.shape[1]}": cells for kind, cells in whole.items()}
