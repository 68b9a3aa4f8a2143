"""The outside of a mesh: facets that belong to one cell only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology.boundary import loops

# Facets of a positively oriented cell in meshio's order, each seen counter-clockwise from outside.
_FACETS = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)],
    "hexahedron": [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}


def outer_facets(kind: str, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(f, k) facets that no other cell shares.

    Parameters
    ----------
    kind : {"triangle", "quad", "tetra", "hexahedron"}
    cells : (m, corners) int64
    """
    corners = np.array(_FACETS[kind])
    facets = cells[:, corners].reshape(-1, corners.shape[1])
    _, which, count = np.unique(np.sort(facets, axis=1), axis=0, return_inverse=True, return_counts=True)
    return facets[count[which.ravel()] == 1]


def tiles(kind: str, cells: NDArray[np.int64]) -> bool:
    """Whether positively oriented cells lie side by side: any facet bounds one from each side at most.

    Cells made up to explain entries overlap: several small triangles in a quadratic one, for example.
    """
    corners = np.array(_FACETS[kind])
    facets = cells[:, corners].reshape(-1, corners.shape[1])
    if facets.shape[1] > 2:  # start with the least node: the order of the others then tells the side, as an edge's does
        start = facets.argmin(axis=1)[:, None]
        facets = np.take_along_axis(facets, (start + np.arange(facets.shape[1])) % facets.shape[1], axis=1)
    return len(np.unique(facets, axis=0)) == len(facets)


def boundary_loops(kind: str, cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Directed boundary edges of planar cells loop by loop, and where each loop begins.

    Where loops touch in a vertex they are taken apart, or joined, as the order of the cells has it.

    Returns
    -------
    boundary : (b, 2) int64
    offsets : (loops + 1,) int64
    """
    edges = outer_facets(kind, cells)
    if not len(edges):
        return edges.reshape(0, 2), np.zeros(1, np.int64)
    successor = np.empty(len(edges), np.int64)
    # As many edges leave a vertex as enter it.
    successor[np.argsort(edges[:, 1], kind="stable")] = np.argsort(edges[:, 0], kind="stable")
    loop, order = loops(successor)
    return edges[order], np.append(np.flatnonzero(np.diff(loop[order], prepend=-1)), len(order)).astype(np.int64)
