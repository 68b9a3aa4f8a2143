"""Bodies and structures."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..elements.surface import outer_nodes
from .base import SHOWN, Look, Recovery, none_of, occurring, with_mid_nodes


@dataclass(frozen=True)
class Evidence:
    """How uniquely the matrix determines a piece of a body or structure."""

    #: Independent fields that satisfy all valid identities, nodes that stay loose left out. 4 in space, 3 in the plane,
    #: translations and scale. One less where no field but translations is exact.
    null_dimension: int
    residual: float  #: Singular value of the coordinates, norm of the residual over the norm of the centred field.
    gap: float  #: Singular value of the best field that is none of these; an upper bound on large bodies.
    rows: int  #: Nodes with valid identities.


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Mechanical(Recovery):
    """What bodies and structures share: positions that solve linear identities."""

    evidence: tuple[Evidence, ...] = ()  #: The null space of each piece's identities.
    #: Of entries with few digits, how far off a node may be, ten standard deviations (the largest that are
    #: likely), over its piece's diameter.
    position_error: float | None = None
    #: (m, 4) cells of four corners, counter-clockwise in the plane.
    quads: NDArray[np.int64] = field(default_factory=none_of(4))

    def details(self) -> list[str]:
        """Nothing: the size is free, or the matrix's own."""
        return []

    def facts(self) -> list[tuple[str, str]]:
        """The null space of each piece's identities."""
        rows = [("shear modulus", self.scale_text())] if np.isfinite(self.scale).any() else []
        return rows + [
            ("null space", f"dimension {one.null_dimension}, residual {one.residual:.1e}, next {one.gap:.1e}")
            for one in self.evidence[:SHOWN]
        ]

    def entries_of_report(self) -> dict[str, Any]:
        """The material, how far positions may be off, and the null spaces."""
        return {
            "poisson_ratio": None,
            "position_error": self.position_error,
            "evidence": [asdict(one) for one in self.evidence],
        }


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Body(Mechanical):
    """An elastic body in the plane or in space.

    Cells are in meshio's order and positively oriented. Of quadratic ones `triangles`, `quads`, `tetrahedra` and
    `hexahedra` are the corners.
    """

    tetrahedra: NDArray[np.int64] = field(default_factory=none_of(4))  #: (m, 4)
    hexahedra: NDArray[np.int64] = field(default_factory=none_of(8))  #: (m, 8)
    #: (m, k) of quadratic cells the nodes that each has besides its corners, in meshio's order; else empty.
    mid_nodes: NDArray[np.int64] = field(default_factory=none_of(0))
    poisson_ratio: float | None = None  #: Where it is one number; that of plane strain in the plane.
    #: (n_cells, 2) lambda and mu of each cell, as in `scale`.
    lame: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Cells of each kind that occurs, all their nodes, by meshio's names."""
        corners = occurring(triangle=self.triangles, quad=self.quads, tetra=self.tetrahedra, hexahedron=self.hexahedra)
        return with_mid_nodes(corners, self.mid_nodes)

    def details(self) -> list[str]:
        """Poisson's ratio, where it is one number."""
        return [] if self.poisson_ratio is None else [f"Poisson's ratio {self.poisson_ratio:.6g}"]

    def facts(self) -> list[tuple[str, str]]:
        """Poisson's ratio besides, where it is one number."""
        ratio = [] if self.poisson_ratio is None else [("Poisson's ratio", f"{self.poisson_ratio:.10g}")]
        return ratio + super().facts()

    def entries_of_report(self) -> dict[str, Any]:
        """Poisson's ratio besides."""
        return super().entries_of_report() | {"poisson_ratio": self.poisson_ratio}

    def boundary_flag(self) -> NDArray[np.int64]:
        """(n,) 1 for points on the outside, else 0; in space those of outer facets."""
        flag = super().boundary_flag()
        if self.dim == 3 and self.n_cells:
            flag[outer_nodes(self.cells)] = 1
        return flag


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Structure(Mechanical):
    """A frame, shell, plate or truss."""

    look: ClassVar[Look] = Look(solid=False, shaded=False, cells="cells of shells or plates, read off the graph")

    lines: NDArray[np.int64] = field(default_factory=none_of(2))  #: (m, 2) members.

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Members and shell cells, each kind that occurs, by meshio's names."""
        return occurring(line=self.lines, triangle=self.triangles, quad=self.quads)

    @property
    def re_assembled(self) -> bool:
        """Whether all its members are bars, which were assembled again."""
        return self.operator == "truss"

    def boundary_flag(self) -> NDArray[np.int64]:
        """(n,) 1 for ends of members, and nodes of shell cells that are on their outside; else 0."""
        flag = super().boundary_flag()
        if self.dim == 3:
            flag[self.lines] = 1
            shells = {kind: cells for kind, cells in self.cells.items() if kind != "line"}
            if shells:
                flag[outer_nodes(shells)] = 1
        return flag

    @property
    def element(self) -> None:
        """None: members and shell cells are read off the graph, and what they are is not looked for."""
        return None
