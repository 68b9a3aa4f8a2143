"""What all kinds of answer share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..certificate import UNJUDGED, Status, Uniqueness, Verdict
from ..tolerances import AGREED
from ..words import sentences

if TYPE_CHECKING:
    import meshio
    from matplotlib.figure import Figure


def none_of(*columns: int) -> Callable[[], NDArray[np.int64]]:
    """Default of a field of indices: none, each of so many columns."""
    return lambda: np.empty((0, *columns), np.int64)


SHOWN = 3  # pieces, or entries that fit worst, that a summary names


@dataclass(frozen=True)
class Look:
    """How a picture shows the cells of a kind of result."""

    outlined: bool = False  # by their sides and the boundary loops, in place of filled cells
    solid: bool = True  # whether they hide each other, so that only the outside is drawn
    shaded: bool = True  # by their orientation in space
    two_sided: bool = False  # whether the side that is seen is the outside
    cells: str = ""  # what they are called in the legend; by default the outside of the recognised cells


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
    #: What the mesh is worth, and why; `status`, `uniqueness`, `reason` and `advice` say so one by one.
    verdict: Verdict = UNJUDGED
    #: ``"laplacian"``, or ``"anisotropic laplacian"`` where a tensor was undone; ``"mass"``; ``"elasticity"``;
    #: ``"frame or shell"``, ``"plane frame"``, ``"plate"`` or ``"beam"`` where nodes have rotations too; ``"truss"``;
    #: ``"structure"`` where they have displacements only and elements are of any kind; ``"surface laplacian"``.
    operator: str
    reaction: float = 0.0  #: The factor s of the mass matrix in the operator, 0 if none.
    #: Beside a mass matrix, mass over area or volume, on the mesh as it is given here; 1 where the mesh is in the size
    #: that makes it so.
    density: float | None = None
    #: Largest difference between an off-diagonal entry and the re-assembled one, relative to the largest off-diagonal
    #: entry of its row. Of a body whose elements are not recognised the largest part of an identity that a row
    #: leaves, over the distance of the farthest node to which it is coupled.
    backward_error: float = np.inf
    timings: Mapping[str, float] = field(default_factory=dict)  #: Seconds by stage.
    warnings: tuple[str, ...] = ()  #: What was changed, guessed or left open.
    #: (k, 2) rows and columns of the entries that fit worst, worst first, suspects before others; empty where all fit.
    worst_entries: NDArray[np.int64] = field(default_factory=none_of(2))
    #: (k,) their misfit, as in `backward_error`.
    worst_misfits: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    suspects: NDArray[np.int64] = field(default_factory=none_of(2))  #: (k, 2) those that stand out from all others.
    #: Entries above the diagonal, where all were compared; those on it too where it was compared, with a mass term, a
    #: scaling or terms on the boundary.
    n_entries: int = 0
    n_fitting: int = 0  #: Those that the mesh gives back to 1e-9 of their row's largest.
    node_of_row: NDArray[np.int64] | None = None  #: (N,) node of each matrix row, if it is vector-valued.
    direction_of_row: NDArray[np.int64] | None = None  #: (N,) and its direction.
    #: Of vector-valued matrices, how the unknowns stand, ``"interleaved"``, ``"by component"``, ``"pattern"`` (in no
    #: order, found by the pattern) or ``"given"``.
    numbering: str = ""
    choice: str = ""  #: Why the matrix was taken for this operator's, where that was not asked for.

    look: ClassVar[Look] = Look()

    # Put here by :mod:`unassemble.outputs`.
    report: ClassVar[Callable[..., dict[str, Any]]]
    to_meshio: ClassVar[Callable[[Recovery], meshio.Mesh]]
    save: ClassVar[Callable[[Recovery, str | PathLike[str]], None]]
    plot: ClassVar[Callable[..., Figure]]
    _repr_html_: ClassVar[Callable[[Recovery], str]]
    rigid_body_modes: ClassVar[Callable[[Recovery], NDArray[np.float64]]]

    @property
    def status(self) -> Status:
        """``"certified"``, ``"ambiguous"`` or ``"uncertified"``, see :mod:`unassemble.certificate`."""
        return self.verdict.status

    @property
    def uniqueness(self) -> Uniqueness | None:
        """Of other meshes that fit: ``"proved"``, there is none; ``"searched"``, a search found none.

        ``"conventional"``: there is no other grid or lattice, but meshes that are neither may fit. ``"ambiguous"``:
        there is another. None where this mesh does not fit.
        """
        return self.verdict.uniqueness

    @property
    def reason(self) -> str:
        """Why the mesh has its status, in one sentence or two."""
        return sentences(self.verdict.reasons)

    @property
    def advice(self) -> str:
        """What to do next, where the mesh is not certified."""
        return self.verdict.advice

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

    def divided(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles (m, 3), with cells that the matrix leaves undivided in fans.

        And (m, 3) bool, false for sides, from each corner to the next, that are diagonals of such cells.
        """
        return self.triangles, np.ones(self.triangles.shape, dtype=bool)

    def polygons_by_size(self) -> list[NDArray[np.int64]]:
        """Cells that the matrix leaves undivided, (m, k) for each number k of vertices that occurs."""
        return []

    def scale_at_points(self) -> NDArray[np.float64] | None:
        """(n,) the factor of the piece of each point; None where factors belong to cells."""
        return np.append(self.scale, np.nan)[self.component]

    @property
    def element(self) -> str | None:
        """``P1`` to ``P3``, ``Q1``, ``Q2`` or ``S2`` (serendipity), or ``mixed``; None where it is not known."""
        kinds = {ELEMENT_NAMES[kind] for kind in self.cells if kind in ELEMENT_NAMES}
        kinds |= {"P1"} if self.n_polygons else set()  # one stands for triangles
        return "mixed" if len(kinds) > 1 else next(iter(kinds), None)

    @property
    def shapeless(self) -> str:
        """Why there are no points to write or to draw; empty where there are."""
        return ""

    @property
    def drawable(self) -> bool:
        """Whether there is a picture of it."""
        return not self.shapeless

    @property
    def instead(self) -> str:
        """How points can be had all the same where there are none, to follow "write .npz"."""
        return ""

    @property
    def re_assembled(self) -> bool:
        """Whether cells were assembled again; else rows were tested, those away from supports."""
        return bool(self.n_cells) or not self.vector_valued

    @property
    def title(self) -> str:
        """What a picture of it is headed by."""
        return self.status

    def details(self) -> list[str]:
        """What only this kind of result says below the title of its picture."""
        return [f"c = {self.scale_text(6)}"]

    def facts(self) -> list[tuple[str, str]]:
        """Names and values of what only this kind of result has, for people."""
        return []

    def entries_of_report(self) -> dict[str, Any]:
        """What only this kind of result has, for programs."""
        return {}

    def point_data(self) -> dict[str, NDArray]:
        """What only this kind of result has at each point."""
        return {}

    def boundary_flag(self) -> NDArray[np.int64]:
        """(n,) 1 for points on the outside of the mesh, else 0."""
        flag = np.zeros(self.n_points, dtype=np.int64)
        flag[self.boundary] = 1
        return flag

    def scale_text(self, digits: int = 10) -> str:
        """The factor c, or the range of those of all pieces."""
        known = self.scale[np.isfinite(self.scale)]
        low, high = (float(f(known)) if len(known) else math.nan for f in (np.min, np.max))
        # Pieces of one matrix mostly share c, up to rounding.
        return f"{low:.{digits}g}" if high - low <= AGREED * abs(low) else f"{low:.{digits}g} to {high:.{digits}g}"

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
