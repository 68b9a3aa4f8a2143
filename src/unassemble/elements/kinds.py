"""Kinds of cells by meshio's names: how many nodes, in which order."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

_TRIANGLE = ((0, 1), (1, 2), (2, 0))
_THIRDS = ((0, 0, 1), (0, 1, 1), (1, 1, 2), (1, 2, 2), (2, 2, 0), (2, 0, 0), (0, 1, 2))
_QUAD = ((0, 1), (1, 2), (2, 3), (3, 0))
_TETRA = (*_TRIANGLE, (0, 3), (1, 3), (2, 3))
_HEXAHEDRON = (*_QUAD, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_SIDES = ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))


@dataclass(frozen=True)
class Kind:
    """A kind of cell."""

    name: str  # meshio's
    base: str  # the linear cell on the same corners
    dim: int
    corners: int
    # further nodes in meshio's order: the corners, counted as often as named, that each is the middle of
    between: tuple[tuple[int, ...], ...] = ()

    @property
    def nodes(self) -> int:
        """Nodes of a cell."""
        return self.corners + len(self.between)

    @property
    def simplex(self) -> bool:
        """Triangles and tetrahedra."""
        return self.corners == self.dim + 1

    @property
    def linear_simplex(self) -> bool:
        """Cells of which any clique of the graph could be one."""
        return self.simplex and not self.quadratic

    @property
    def quadratic(self) -> bool:
        """Whether it has nodes other than corners."""
        return bool(self.between)

    @property
    def degree(self) -> int:
        """Polynomial degree along a side."""
        return 1 + sum(set(some) == {0, 1} for some in self.between)

    @cached_property
    def on_one_side(self) -> NDArray[np.bool_]:
        """(k (k - 1) / 2,) whether two nodes of a plane cell share a side, in the order of numpy.triu_indices."""
        sides = [{s, (s + 1) % self.corners} for s in range(self.corners)]
        on = [side | {k for k, some in enumerate(self.between, self.corners) if set(some) == side} for side in sides]
        return np.array([any({a, b} <= side for side in on) for a, b in combinations(range(self.nodes), 2)])


KINDS = {
    kind.name: kind
    for kind in (
        Kind("triangle", "triangle", 2, 3),
        Kind("triangle6", "triangle", 2, 3, _TRIANGLE),
        Kind("triangle10", "triangle", 2, 3, _THIRDS),
        Kind("quad", "quad", 2, 4),
        Kind("quad8", "quad", 2, 4, _QUAD),
        Kind("quad9", "quad", 2, 4, (*_QUAD, (0, 1, 2, 3))),
        Kind("tetra", "tetra", 3, 4),
        Kind("tetra10", "tetra", 3, 4, _TETRA),
        Kind("hexahedron", "hexahedron", 3, 8),
        Kind("hexahedron20", "hexahedron", 3, 8, _HEXAHEDRON),
        Kind("hexahedron27", "hexahedron", 3, 8, (*_HEXAHEDRON, *_SIDES, tuple(range(8)))),
    )
}
