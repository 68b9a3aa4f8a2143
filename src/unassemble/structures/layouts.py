"""What the unknowns of a node of a frame, shell or plate are: displacements and rotations."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Layout:
    """Unknowns of each node, in the order of their directions: first displacements, then rotations."""

    name: str
    dim: int  # coordinates of a node that the matrix tells
    displacements: tuple[int, ...]  # axis of each; direction k of a node is ``displacements[k]``
    rotations: tuple[int, ...]  # axis of each; none where nodes have displacements only

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the directions: ``x``, ``y``, ``z``, and ``rx``, ``ry``, ``rz`` of the rotations."""
        return (*("xyz"[k] for k in self.displacements), *("r" + "xyz"[k] for k in self.rotations))

    @property
    def block_size(self) -> int:
        """Unknowns per node."""
        return len(self.displacements) + len(self.rotations)

    @property
    def turning(self) -> tuple[int, ...]:
        """Axes of the rigid rotations that nodes follow."""
        return self.rotations or tuple(axis for axis in range(3) if self.turned(axis))

    @property
    def space(self) -> int:
        """Coordinates of a node: those that the matrix does not tell are zero."""
        return self.dim if self.dim > 1 else max(self.displacements) + 1

    def turned(self, axis: int) -> list[tuple[int, int, int]]:
        """Unit rotation about an axis: (direction, coordinate, sign) of displacements, sign times the coordinate."""
        after, last = (axis + 1) % 3, (axis + 2) % 3
        terms = ((after, last, -1), (last, after, 1))
        return [
            (self.displacements.index(moved), coordinate, sign)
            for moved, coordinate, sign in terms
            if moved in self.displacements and coordinate < self.dim
        ]

    def rigid_motions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, block size, motions) translations, then rotations about the origin, of nodes at `points` (n, dim)."""
        moves = len(self.displacements)
        motions = np.zeros((len(points), self.block_size, moves + len(self.turning)))
        motions[:, range(self.block_size), range(self.block_size)] = 1
        for k, axis in enumerate(self.turning, start=moves):
            for direction, coordinate, sign in self.turned(axis):
                motions[:, direction, k] = sign * points[:, coordinate]
        return motions


SPACE = Layout("frame or shell", 3, (0, 1, 2), (0, 1, 2))
PLANE = Layout("plane frame", 2, (0, 1), (2,))
PLATE = Layout("plate", 2, (2,), (0, 1))
BEAM = Layout("beam", 1, (1, 2), (1, 2))  # straight along x, bending in two planes that do not know of each other
PINNED = Layout("structure", 3, (0, 1, 2), ())  # bars, membranes and solids, of any material, in one
ALONG_X = Layout("plane frame", 1, (0, 1), (2,))  # straight, so that stretching has no part in rotations
LAYOUTS = (SPACE, PLANE, PLATE, BEAM)
SOLIDS = {d: Layout("solid", d, tuple(range(d)), ()) for d in (3, 2)}


def layout_named(name: str) -> Layout | None:
    """The layout of an operator's name; None for other operators."""
    return next((layout for layout in LAYOUTS if layout.name == name), None)
