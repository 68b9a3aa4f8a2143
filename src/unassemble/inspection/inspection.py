"""Facts about a matrix, and what follows from them."""

from dataclasses import asdict, dataclass
from typing import Any

from ..diagnosis import PLANAR
from ..words import count_of
from .text import ELEMENTS, lines_of, mesh_text

_IF = "if the entries agree, which recovery tells"
_IF_WHOLE = f"if enough rows are whole, away from supports, and {_IF[3:]}"


@dataclass(frozen=True, eq=False)
class Inspection:
    """Facts about a matrix that passed the checks at the door."""

    n_rows: int  #: Order.
    n_edges: int  #: Stored off-diagonal entries, each with its transpose counted once.
    #: Largest difference between an entry and its transpose, relative to the largest off-diagonal entry of the rows.
    asymmetry: float
    n_connected: int  #: Connected pieces of the graph, isolated rows not counted.
    n_isolated: int  #: Rows without an off-diagonal entry.
    n_vanished: int  #: Off-diagonal entries stored as zero, or of at most 1e-12 relative to their rows.
    n_zero_sums: int  #: Rows that sum to zero, relative to their largest off-diagonal entry; isolated ones not counted.
    warnings: tuple[str, ...]  #: What was changed as the matrix was checked.
    planar: bool = True  #: Whether the graph is that of a planar mesh, as far as that is known.
    obstacle: str = ""  #: Why no mesh is recognised; empty where one is.
    n_triangles: int = 0  #: Triangles among the cells.
    n_holes: int = 0  #: Bounded boundary loops.
    n_boundary_edges: int = 0  #: Edges on the boundary.
    n_pieces: int = 0  #: Edge-connected ones.
    n_hinges: int = 0  #: Vertices that join them.
    n_bare_edges: int = 0  #: Edges of no cell.
    n_undetermined: int = 0  #: Rows of no cell.
    #: Rows, the first in each piece, in which c would have the other sign than in most.
    mixed_signs: tuple[int, ...] = ()
    block_size: int = 1  #: Unknowns per node, 1 for a scalar matrix.
    n_nodes: int = 0  #: Nodes of a vector-valued matrix.
    numbering: str = ""  #: How its unknowns stand.
    coupled: bool = True  #: Whether its directions are coupled.
    structure: str = ""  #: ``"truss"``, or the kind of structure whose nodes have rotations too; empty for others.
    n_polygons: int = 0  #: Cells of more than three vertices, whose diagonals have no entry.
    #: Sides of the boundary that face a right angle and have no entry; counted among its edges.
    n_vanished_sides: int = 0
    #: ``"graph"``, cycles of three edges are cells; or ``"entries"``, if edges are left over and the entries suggest
    #: others. :func:`unassemble.recover` begins with these; it holds the result against the entries, and changes cells
    #: where that asks for it. Empty where there is no mesh.
    cells_from: str = ""
    kind: str = "vector-valued"  #: That, or as in :class:`unassemble.diagnosis.Diagnosis`.
    name: str = ""  #: The same in words.
    evidence: tuple[str, ...] = ()  #: What speaks for it, the strongest first.
    advice: str = ""  #: What to do next; empty where recovery is.
    surface: str = ""  #: What kind of surface the graph is that of, where that is none in the plane.
    #: Of scalar matrices whose rows form cells of other elements than linear triangles ``"P2"``, ``"Q1"``, ...
    element: str = ""
    n_quads: int = 0  #: Quadrilaterals, beside `n_triangles`.
    #: Of scalar matrices, what was added to the Laplacian, or done to it, as row sums tell; begins with a comma.
    further: str = ""

    @property
    def operator(self) -> str:
        """The operator that the matrix likely belongs to, or why none."""
        if self.structure == "truss":
            return f"truss: bars between nodes of {self.block_size} displacements"
        if self.structure:
            return f"{self.structure}: displacements and rotations, {self.block_size} unknowns per node"
        if self.n_nodes:
            kind = "elasticity, if the material is isotropic" if self.coupled else "laplacian in each direction"
            return f"vector-valued, {self.block_size} components, {self.numbering}: {kind}"
        if self.element:
            return f"laplacian, {ELEMENTS[self.element]}{self.further}"
        if self.surface:
            sphere = self.surface.startswith("closed, 0 handles")  # whose graph is planar
            other = "; or of a mesh in the plane whose outline has three edges" if sphere else ""
            return f"laplacian of a surface in space, linear triangles{self.further}{other}"
        if self.kind != PLANAR:
            return self.name
        if self.obstacle:
            return "none that is known"
        if self.mixed_signs:
            return "not a Laplacian: its diagonal has one sign, and the off-diagonal sums here have both"
        return f"laplacian, linear triangles{self.further}"

    @property
    def recoverable(self) -> str:
        """What :func:`unassemble.recover` may make of the matrix; only that tells whether its entries are a mesh's."""
        if self.structure:
            size = "up to position and size" if self.structure == "truss" else "in true size, up to position"
            return f"coordinates of {count_of(self.n_nodes, 'node')} {size}, members and cells, {_IF_WHOLE}"
        if self.n_nodes and self.coupled:
            return (
                f"coordinates of {count_of(self.n_nodes, 'node')} in {self.block_size}D, up to position and size, "
                f"and elements that the matrix re-assembles from, {_IF_WHOLE}"
            )
        if self.n_nodes:
            return "what each direction's scalar matrix holds"
        if self.surface:
            return f"lengths of {count_of(self.n_edges, 'edge')} up to size, {_IF}{self._or_else}"
        if self.element:
            return (
                f"{mesh_text(self)} on {self.n_rows - self.n_isolated:,} points, up to position, rotation, size and "
                f"mirror image, {_IF}{self._or_else}"
            )
        if self.kind == "mass" and not self.advice:
            return f"areas of {mesh_text(self)}, up to the density, and no positions: a mass matrix has no shape"
        if self.kind != PLANAR:
            return f"nothing: {self.advice}"
        if self.obstacle:
            return f"nothing: {self.obstacle}"
        mesh = f"{mesh_text(self)} on {self.n_rows - self.n_undetermined:,} points"
        if self.mixed_signs:
            return f"{mesh}, but no positions that could be certified: look at row {self.mixed_signs[0]}"
        each = f", each of the {self.n_pieces:,} pieces by itself" if self.n_pieces > 1 else ""
        return f"{mesh}, up to position, rotation, size and mirror image{each}, {_IF}"

    @property
    def _or_else(self) -> str:
        return f" (where they do not, {self.advice})" if self.advice else ""

    def to_dict(self) -> dict[str, Any]:
        """All attributes, ready for JSON."""
        return asdict(self) | {"operator": self.operator, "recoverable": self.recoverable}

    def __str__(self) -> str:
        return "\n".join(f"{name:<13} {value}" for name, value in lines_of(self))
