"""Bodies and structures."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .base import Recovery, none_of, occurring, with_mid_nodes


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
    #: Of entries with few digits, how far off a node may be, ten standard deviations, over its piece's diameter.
    position_error: float | None = None
    #: (m, 4) cells of four corners, counter-clockwise in the plane.
    quads: NDArray[np.int64] = field(default_factory=none_of(4))


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


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Structure(Mechanical):
    """A frame, shell, plate or truss."""

    lines: NDArray[np.int64] = field(default_factory=none_of(2))  #: (m, 2) members.

    @property
    def cells(self) -> dict[str, NDArray[np.int64]]:
        """Members and shell cells, each kind that occurs, by meshio's names."""
        return occurring(line=self.lines, triangle=self.triangles, quad=self.quads)

    @property
    def element(self) -> None:
        """None: members and shell cells are read off the graph, and what they are is not looked for."""
        return None
