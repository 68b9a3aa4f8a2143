"""Right-angled cells whose longest side has vanished from the boundary: where a mesh may be read in two ways."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ...topology.faces import joined
from ...topology.keys import contains
from ..alike import Cells, as_cell


@dataclass(frozen=True)
class Alternative:
    """Another mesh that fits as well as the one found, in the place where they differ.

    Attributes
    ----------
    around : tuple of int
        The rows that stay.
    found, other : tuple of int
        Rows about them, in the order of the mesh that was found and in that of the other.
    cells, other_cells : tuple of tuple of int
        Cells that only the one or the other has, corners in running order.
    same_scale : bool
        Whether both have the same factor c; otherwise a known c decides.
    tested : bool
        Whether the other was solved and fits; otherwise it was not tried, and might.
    """

    around: tuple[int, ...]
    found: tuple[int, ...]
    other: tuple[int, ...]
    cells: tuple[tuple[int, ...], ...]
    other_cells: tuple[tuple[int, ...], ...]
    same_scale: bool = True
    tested: bool = True

    @classmethod
    def of(cls, cells: Cells, others: Cells, *, same_scale: bool) -> Alternative:
        """Another mesh with other cells, solved, anywhere in a component."""
        gone, new = tuple(sorted(cells - others)), tuple(sorted(others - cells))
        return cls((), (), (), gone, new, same_scale=same_scale)

    def renumbered(self, number: NDArray[np.int64]) -> Alternative:
        """The same with row v called ``number[v]``."""

        def named(rows: tuple[int, ...]) -> tuple[int, ...]:
            return tuple(number[list(rows)].tolist())

        return replace(
            self,
            around=named(self.around),
            found=named(self.found),
            other=named(self.other),
            cells=tuple(as_cell(named(cell)) for cell in self.cells),
            other_cells=tuple(as_cell(named(cell)) for cell in self.other_cells),
        )


@dataclass(frozen=True, eq=False)
class OrientedMesh:
    """What the search for other readings needs of a mesh.

    Attributes
    ----------
    triangles : (m, 3) int64
        Counter-clockwise; not those of divided polygons.
    polygons : Polygons
    boundary : (b, 2) int64
        Directed edges with the mesh on their left.
    boundary_offsets : (loops + 1,) int64
    z : (n,) complex128
        Positions in the frame in which the operator is the Laplacian.
    """

    triangles: NDArray[np.int64]
    polygons: Polygons
    boundary: NDArray[np.int64]
    boundary_offsets: NDArray[np.int64]
    z: NDArray[np.complex128]

    def chosen(self, rows: NDArray[np.bool_], number: NDArray[np.int64]) -> OrientedMesh:
        """The cells of whole pieces by their rows (n,), row v called ``number[v]``; the rest is left as it is."""
        first = self.polygons.vertices[self.polygons.offsets[:-1]]
        triangles = number[self.triangles[rows[self.triangles[:, 0]]]]
        return replace(self, triangles=triangles, polygons=self.polygons.chosen(rows[first], number))

    def cells_at(self, wanted: NDArray[np.bool_]) -> Iterator[tuple[int, ...]]:
        """The cells that have one of the wanted vertices, (n,)."""
        yield from map(tuple, self.triangles[wanted[self.triangles].any(axis=1)].tolist())
        polygons = self.polygons
        owner = np.repeat(np.arange(polygons.count), polygons.size)
        for k in np.unique(owner[wanted[polygons.vertices]]).tolist():
            yield tuple(polygons.vertices[polygons.offsets[k] : polygons.offsets[k + 1]].tolist())


@dataclass(frozen=True, eq=False)
class Corners:
    """Triangles with a right angle whose facing side, on the boundary, has no entry.

    Attributes
    ----------
    apex, first, second : (k,) int64
        The vertex of the right angle and the others, counter-clockwise.
    loop : (k,) int64
        Boundary loop of the vanished side.
    next_at, previous_at : dict of (vertex, loop) to vertex
        The far ends of the stored edges at an apex next to where a loop leaves it, and to where it arrives.
    """

    apex: NDArray[np.int64]
    first: NDArray[np.int64]
    second: NDArray[np.int64]
    loop: NDArray[np.int64]
    next_at: dict[tuple[int, int], int]
    previous_at: dict[tuple[int, int], int]

    @classmethod
    def of(cls, n: int, edges: NDArray, mesh: OrientedMesh) -> Corners:
        """Find them all.

        Parameters
        ----------
        n : int
        edges : (e, 2) int64
            Stored ones, i < j.
        mesh : OrientedMesh
        """
        tail, head = mesh.boundary.T
        loop = np.repeat(np.arange(len(mesh.boundary_offsets) - 1), np.diff(mesh.boundary_offsets))
        gone, apex = vanished_sides(n, edges, mesh)
        hub = np.zeros(n, dtype=bool)
        hub[apex] = True
        # Where the boundary runs along a vanished side the last stored edge is that to its apex.
        after, before = head.copy(), tail.copy()
        after[gone] = before[gone] = apex
        leaving, arriving = hub[tail], hub[head]
        return cls(
            apex,
            tail[gone],
            head[gone],
            loop[gone],
            _table(tail[leaving], loop[leaving], after[leaving]),
            _table(head[arriving], loop[arriving], before[arriving]),
        )

    def __len__(self) -> int:
        return len(self.apex)

    def chosen(self, which: NDArray) -> Corners:
        """Some of them, by a mask or by their numbers."""
        return replace(
            self,
            apex=self.apex[which],
            first=self.first[which],
            second=self.second[which],
            loop=self.loop[which],
        )


def vanished_sides(n: int, edges: NDArray, mesh: OrientedMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Boundary edges of triangles that have no entry, by their rows (k,), and the vertices that face them (k,)."""
    gone = np.flatnonzero(~joined(n, edges, *mesh.boundary.T))
    near = np.zeros(n, dtype=bool)
    near[mesh.boundary[gone]] = True
    triangles = mesh.triangles[near[mesh.triangles].sum(axis=1) >= 2]
    sides = (triangles * n + np.roll(triangles, -1, axis=1)).ravel()
    order = np.argsort(sides)
    wanted = mesh.boundary[gone] @ [n, 1]
    of_triangle = contains(sides[order], wanted)
    triangle, position = np.divmod(order[np.searchsorted(sides[order], wanted[of_triangle])], 3)
    return gone[of_triangle], triangles[triangle, (position + 2) % 3]


def _table(vertex: NDArray, loop: NDArray, value: NDArray) -> dict[tuple[int, int], int]:
    return dict(zip(zip(vertex.tolist(), loop.tolist(), strict=True), value.tolist(), strict=True))


def cell(apex: int, pair: frozenset[int]) -> tuple[int, ...]:
    """A corner as a sorted cell."""
    return tuple(sorted((apex, *pair)))
