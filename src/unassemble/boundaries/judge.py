"""Which vertices the whole entries determine.

Displacements that change no whole entry, to first order, are the null space of their Jacobian, c taken along.
Similarities are in it, of a piece as a whole; what else there is moves the vertices that are not determined. The null
space is found by inverse iteration on a block of vectors that grows until its last one is not in it.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import SolverError
from ..linalg import UpperTriangle, factorisation
from ..planar.cotangent import weight_gradient
from ..topology import Piece
from .fit import jacobian_rows

_SHIFT = 1e-13  # of the normal matrix, relative to its typical diagonal entry
_SOFT = 1e-11  # eigenvalue, relative likewise, below which a displacement counts as free: entries know it to 1e-10
_MOVES = 1e-9  # of the length of edges: what a null vector of length 1 may move a vertex that is determined
_SOLVES = 4
_MOST = 256  # null vectors


def determined(piece: Piece, z: NDArray, whole: NDArray[np.bool_], *, known_scale: bool = False) -> NDArray[np.bool_]:
    """(n,) vertices, up to a similarity of all of them.

    Parameters
    ----------
    piece : Piece
    z : (n,) complex128
        Positions at which whole entries fit.
    whole : (e,) bool
    known_scale : bool
        Whether c is given.
    """
    n = piece.n_vertices
    length = np.abs(z[piece.edges[:, 1]] - z[piece.edges[:, 0]])
    size = np.bincount(piece.edges.ravel(), np.repeat(length, 2), n) / np.bincount(piece.edges.ravel(), minlength=n)
    held = np.zeros(n, dtype=bool)
    held[piece.stencil[:, whole]] = True
    if not held.any():
        return held
    gradient = np.where(whole, weight_gradient(piece, z), 0) * size[piece.stencil]
    free = _null_space(jacobian_rows(n, [(gradient, piece.stencil)]), _slope(piece, z, whole, known_scale), held)
    if free is None:
        return np.zeros(n, dtype=bool)
    return _moving_alike(piece, z, free * size[:, None], size, held)


def _slope(piece: Piece, z: NDArray, whole: NDArray, known_scale: bool) -> NDArray[np.float64]:
    from ..planar.cotangent import edge_weights

    return np.where(whole, edge_weights(piece, z), 0.0) * (not known_scale)


def _null_space(jacobian: sp.bsr_array, slope: NDArray, held: NDArray[np.bool_]) -> NDArray[np.complex128] | None:
    """(n, k) displacements, in lengths of edges; None where there are too many.

    With c free the column of its logarithm is projected out, which is a matter of rank one.
    """
    product = UpperTriangle.of(jacobian.T.tobsr() @ jacobian)
    data, start = product.data.copy(), product.indptr[:-1]
    typical = float(np.median(np.diagonal(data[start][held], axis1=1, axis2=2)))
    data[start] += _SHIFT * typical * np.eye(2)
    data[start[~held]] += typical * np.eye(2)
    matrix = product.with_data(data)
    solver = factorisation(matrix, definite=True)
    try:
        solver.factorise(matrix)
        pull = jacobian.T @ slope
        response = solver.solve(pull)
        left = float(slope @ slope - pull @ response)

        def inverse(block: NDArray) -> NDArray:
            x = solver.solve(np.ascontiguousarray(block))
            return x + np.outer(response, pull @ x) / left if left > 0 else x

        rng, block = np.random.default_rng(0), np.empty((2 * len(held), 0))
        count = 16
        while count <= min(_MOST, 2 * int(held.sum())):
            block = np.linalg.qr(np.hstack([block, rng.standard_normal((len(pull), count - block.shape[1]))]))[0]
            for _ in range(_SOLVES):
                block = np.linalg.qr(inverse(block))[0]
            image = jacobian @ block
            image -= np.outer(slope, slope @ image) / max(float(slope @ slope), 1e-300)
            _, values, turn = np.linalg.svd(image, full_matrices=False)
            null = values**2 <= _SOFT * typical
            if not null.all():
                return np.ascontiguousarray(block @ turn[null].T).T.copy().view(np.complex128).T
            count *= 2
    except SolverError:
        return None
    finally:
        solver.release()
    return None


def _moving_alike(piece: Piece, z: NDArray, free: NDArray, size: NDArray, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) the vertices about the one farthest from the rim that every displacement moves by one similarity."""
    n = piece.n_vertices
    graph = sp.coo_array((np.ones(len(piece.edges), np.int8), piece.edges.T), shape=(n, n)).tocsr()
    graph = graph + graph.T
    outside = np.union1d(piece.boundary.ravel(), np.flatnonzero(~held))
    depth = csgraph.dijkstra(graph, unweighted=True, indices=outside, min_only=True)
    deepest = int(np.where(held, depth, -1).argmax())
    alike = np.zeros(n, dtype=bool)
    alike[[deepest, *graph.indices[graph.indptr[deepest] : graph.indptr[deepest + 1]]]] = True
    basis = np.column_stack([np.ones(n), z / np.abs(z).max()])
    while True:
        fit = np.linalg.lstsq(basis[alike], free[alike], rcond=None)[0]
        moves = np.abs(free - basis @ fit).max(axis=1, initial=0.0)
        now = held & (moves <= _MOVES * size)
        if now.sum() <= alike.sum():
            return now & alike if (alike & ~now).any() else now
        alike = now
