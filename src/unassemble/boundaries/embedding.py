"""Drawings without crossings, to start from: Tutte's, with one boundary loop as the outline.

References
----------
Tutte, "How to draw a graph", Proc. London Math. Soc. 13, 1963.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..linalg import UpperTriangle, factorisation
from ..planar.cotangent import areas
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
    z = np.zeros(number, dtype=np.complex128)
    z[circle] = np.exp(2j * np.pi * np.arange(len(circle)) / len(circle))
    free = np.ones(number, dtype=bool)
    free[circle] = False
    z = relaxed(np.concatenate(ends), z, free)[:n]
    area = areas(piece, z)
    return np.asarray((z if area.sum() > 0 else np.conj(z)) / np.sqrt(np.abs(area).mean()))


def relaxed(edges: NDArray, z: NDArray[np.complex128], free: NDArray[np.bool_]) -> NDArray[np.complex128]:
    """The same positions (n,), those that are `free`, (n,) bool, at the means of their neighbours.

    `edges` (e, 2) may repeat one, as a loop does that comes to a vertex twice. Raises SolverError.
    """
    graph = sp.coo_array((np.ones(len(edges)), edges.T), shape=(len(z), len(z))).tocsr()
    laplacian = sp.csr_array(csgraph.laplacian(graph + graph.T))[free]
    if free.any():
        matrix = UpperTriangle.of(sp.csr_array(laplacian[:, free]))
        solver = factorisation(matrix, definite=True)
        solver.factorise(matrix)
        pull = -(laplacian[:, ~free] @ z[~free])
        z = z.copy()
        z[free] = np.ascontiguousarray(solver.solve(np.column_stack([pull.real, pull.imag]))) @ np.array([1, 1j])
        solver.release()
    return z
