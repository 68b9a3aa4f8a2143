"""The kinds of scalar matrix that are told apart, and what to do with each."""

from collections.abc import Mapping
from dataclasses import dataclass

from ..words import sentences

PLANAR, UNKNOWN = "laplacian", "unknown"

_IN_SPACE = "scalar matrices of meshes in space are not read yet, but elasticity matrices of such meshes are"
UNREAD: Mapping[str, str] = {
    **dict.fromkeys(("tetrahedra", "hexahedra", "grid in space"), _IN_SPACE),
    "mass": "pass the stiffness matrix of the same mesh: a mass matrix tells sizes of cells, and no shape",
    "graph": "a graph has no coordinates: a layout of the graph may draw it",
    "segments": "the length of each segment is the reciprocal of its entry, with nothing left to solve",
}
"""What to do with kinds that :func:`unassemble.recover` refuses; who builds the recovery of one takes its line out."""

KEEP_ALL = "keep all rows and columns, those on the boundary too"
WITHOUT_MASS = "assemble the stiffness matrix alone, without a mass matrix"
TERMS = "see which elements and terms it was assembled with"
CONSTANT = "see whether a coefficient varies from cell to cell: it must be constant"
"""What to do about terms that are read of linear triangles only, or not at all."""

LENGTHS = "the length of each segment is six times its entry, over the density, with nothing left to solve"
"""What to do with the mass matrix of linear elements on segments, a boundary's for one."""


@dataclass(frozen=True)
class Diagnosis:
    """What a scalar matrix is."""

    #: ``"laplacian"`` (linear triangles in the plane), ``"quadrilaterals"``, ``"quadratic"``, ``"cubic"``,
    #: ``"tetrahedra"``, ``"hexahedra"``, ``"grid in space"``, ``"surface"`` (triangles, but not in the plane),
    #: ``"segments"``, ``"mass"``, ``"graph"`` or ``"unknown"``.
    kind: str
    name: str  #: The same in words, to follow "the matrix is".
    evidence: tuple[str, ...] = ()  #: What speaks for it, the strongest first.
    #: What to do next; empty where recovery is. Of cells that are read, what to do where the entries fit none.
    advice: str = ""

    @property
    def unread(self) -> bool:
        """Whether recovery refuses such matrices."""
        return self.kind in UNREAD and bool(self.advice)

    def sentence(self, begun: str = "the matrix is") -> str:
        """What it is, and what to do next."""
        return sentences([f"{begun} {self.name}" + (f": {self.evidence[0]}" if self.evidence else ""), self.advice])
