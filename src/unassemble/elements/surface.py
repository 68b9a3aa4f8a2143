"""The outside of a mesh: facets that belong to one cell only."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..topology.keys import contains
from ..topology.orientation import loops
from .kinds import KINDS, Kind

Blocks = Mapping[str, NDArray[np.int64]]  # cells by kind

# Facets of a positively oriented cell in meshio's order, each seen counter-clockwise from outside.
_FACETS: dict[str, list[tuple[int, ...]]] = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)],
    "hexahedron": [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}


def _ring(kind: Kind, corners: Sequence[int]) -> list[int]:
    """Corners in a ring, and between them the nodes on the sides."""
    ring = []
    for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
        on_side = [k for k, some in enumerate(kind.between) if set(some) == {a, b}]
        ring += [a, *(kind.corners + k for k in sorted(on_side, key=lambda k: kind.between[k].count(b)))]
    return ring


@cache
def _outlines(name: str) -> NDArray[np.int64]:
    """(f, r) facets of a kind of cell: in the plane pairs of neighbours on its rim, in space rings."""
    kind = KINDS[name]
    if kind.dim == 3:
        return np.array([_ring(kind, facet) for facet in _FACETS[kind.base]])
    rim = _ring(kind, list(range(kind.corners)))
    return np.column_stack([rim, np.roll(rim, -1)])


def planar_outlines(name: str, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, r) nodes around each planar cell (m, k), counter-clockwise."""
    return cells[:, _outlines(name)[:, 0]]


def outer_facets(blocks: Blocks) -> list[NDArray[np.int64]]:
    """Facets that no other cell shares, (f, r) for each number r of nodes, seen counter-clockwise from outside.

    Sides of quadratic cells in the plane are two facets each; in space facets have the nodes in the middle of their
    sides between their corners.
    """
    return [some[~_repeated(_labels(some))] for some in _facets(blocks).values()]


def _facets(blocks: Blocks) -> dict[int, NDArray[np.int64]]:
    """All facets of all cells, (f, r) by their number r of nodes."""
    found: dict[int, list[NDArray[np.int64]]] = {}
    for name, cells in blocks.items():
        corners = _outlines(name)
        found.setdefault(corners.shape[1], []).append(cells[:, corners].reshape(-1, corners.shape[1]))
    return {size: np.concatenate(some) for size, some in found.items()}


def outer_nodes(blocks: Blocks) -> NDArray[np.int64]:
    """Nodes on the outside, those inside facets included."""
    nodes = [np.unique(facets) for facets in outer_facets(blocks)]
    for name, cells in blocks.items():
        kind = KINDS[name]
        for k, some in enumerate(kind.between):
            if kind.dim == 3 and len(some) == 4:  # in the middle of a facet of a hexahedron
                (outside,) = outer_facets({kind.base: cells[:, : kind.corners]})
                nodes.append(cells[among(cells[:, list(some)], outside), kind.corners + k])
    return np.unique(np.concatenate(nodes))


def _labels(sets: NDArray[np.int64], times: NDArray[np.uint64] | int = 1) -> NDArray[np.uint64]:
    """(m,) a number for each set (m, k), the sum of random ones of its members: sorted several times faster.

    With odd numbers of `times` for each place, (k,), it is one for each order of the members.
    """
    n = int(sets.max(initial=-1)) + 1
    random = np.random.default_rng(0).integers(0, 2**63, n, dtype=np.uint64)
    return np.asarray((random[sets] * np.asarray(times, dtype=np.uint64)).sum(axis=1))


def among(sets: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether each set is one of the others."""
    label = _labels(np.vstack([sets, others]))
    return contains(np.sort(label[len(sets) :]), label[: len(sets)])


def _repeated(label: NDArray) -> NDArray[np.bool_]:
    """(m,) labels that occur more than once."""
    _, which, count = np.unique(label, return_inverse=True, return_counts=True)
    return count[which] > 1


def tiles(blocks: Blocks) -> bool:
    """Whether positively oriented linear cells lie side by side: any facet bounds one from each side at most.

    Cells made up to explain entries overlap: several small triangles in a quadratic one, for example.
    """
    return not any(_bounding_twice(facets).any() for facets in _facets(blocks).values())


def contested(base: str, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) positively oriented linear cells one of whose facets bounds another cell from the same side."""
    (facets,) = _facets({base: cells}).values()
    return np.asarray(_bounding_twice(facets).reshape(len(cells), len(_outlines(base))).any(axis=1))


def _bounding_twice(facets: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(f,) facets that occur more than once, seen from the same side."""
    r = facets.shape[1]
    if r > 2:  # start with the least node: the order of the others then tells the side, as an edge's does
        facets = np.take_along_axis(facets, (facets.argmin(axis=1)[:, None] + np.arange(r)) % r, axis=1)
    return _repeated(_labels(facets, 2 * np.arange(r, dtype=np.uint64) + np.uint64(1)))


def _boundary_loops(blocks: Blocks) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(b, 2) directed boundary edges of planar cells loop by loop, and (loops + 1,) where each loop begins.

    Where loops touch in a vertex they are taken apart, or joined, as the order of the cells has it.
    """
    (edges,) = outer_facets(blocks)
    successor = np.empty(len(edges), np.int64)
    # As many edges leave a vertex as enter it.
    successor[np.argsort(edges[:, 1], kind="stable")] = np.argsort(edges[:, 0], kind="stable")
    loop, order = loops(successor)
    return edges[order], np.append(np.flatnonzero(np.diff(loop[order], prepend=-1)), len(order)).astype(np.int64)


_FIELD = {"triangle": "triangles", "quad": "quads", "tetra": "tetrahedra", "hexahedron": "hexahedra"}


def fields_of(blocks: Blocks) -> dict[str, Any]:
    """Corners of cells by their names in results, (m, k), their further nodes, and in the plane their boundary."""
    fields: dict[str, Any] = {}
    for name, cells in blocks.items():
        kind = KINDS[name]
        fields[_FIELD[kind.base]] = np.ascontiguousarray(cells[:, : kind.corners])
        if kind.quadratic:
            fields["mid_nodes"] = np.ascontiguousarray(cells[:, kind.corners :])
    if any(KINDS[name].dim == 2 for name in blocks):
        fields["boundary"], fields["boundary_offsets"] = _boundary_loops(blocks)
    return fields
