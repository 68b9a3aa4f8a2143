"""Drawings without crossings, to start from: Tutte's, with one boundary loop as the outline.

References
----------
Tutte, "How to draw a graph", Proc. London Math. Soc. 13, 1963.
"""

import numpy as np
from numpy.typing import NDArray

from ..linalg import factorisation, upper_from_edges
from ..topology import Piece


def tutte(piece: Piece, outline: int) -> NDArray[np.complex128]:
    """Positions (n,) in which no triangle is turned over, of mean area 1/2; a vertex closes each loop but the outline.

    That loop is on the unit circle. A ring has two such drawings, and which of them is nearer to the mesh depends on
    where it is. Triangles are flat where the graph is not 3-connected.
    """
    n = piece.n_vertices
    ends, number = [piece.edges], n
    for k in range(piece.n_loops):
        loop = piece.boundary[piece.loop_offsets[k] : piece.loop_offsets[k + 1], 0]
        if k == outline:
            circle = loop
        else:
            ends.append(np.column_stack([loop, np.full(len(loop), number)]))
            number += 1
    edges = np.concatenate(ends)
    z = np.zeros(number, dtype=np.complex128)
    z[circle] = np.exp(2j * np.pi * np.arange(len(circle)) / len(circle))
    fixed = np.zeros(number, dtype=bool)
    fixed[circle] = True
    degree = np.bincount(edges.ravel(), minlength=number).astype(float)
    pull = np.zeros(number, dtype=np.complex128)
    for one, other in (edges.T, edges.T[::-1]):
        pull += np.bincount(one, z[other].real, number) + 1j * np.bincount(one, z[other].imag, number)
    if not fixed.all():
        free = np.cumsum(~fixed) - 1
        inside = free[edges[~fixed[edges].any(axis=1)]]
        inside = inside[np.lexsort(inside.T[::-1])]
        matrix = upper_from_edges(int(free[-1]) + 1, inside, -np.ones(len(inside)), degree[~fixed])
        solver = factorisation(matrix, definite=True)
        solver.factorise(matrix)
        right = np.column_stack([pull[~fixed].real, pull[~fixed].imag])
        z[~fixed] = np.ascontiguousarray(solver.solve(right)) @ np.array([1, 1j])
        solver.release()
    z = z[:n]
    area = areas(piece, z)
    return np.asarray((z if area.sum() > 0 else np.conj(z)) / np.sqrt(np.abs(area).mean()))


def areas(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """(m,) twice the areas of triangles."""
    a, b, c = z[piece.triangles].T
    return np.asarray((np.conj(b - a) * (c - a)).imag)
