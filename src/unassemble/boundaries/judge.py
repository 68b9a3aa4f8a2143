"""Which vertices the whole entries determine, and check.

Displacements that change no whole entry, to first order, are the null space of their Jacobian J, the logarithm of c
taken along. Similarities are in it, of a piece as a whole; what else there is moves the vertices that are not
determined. It is found by inverse iteration on a block of vectors that grows until its last one is not in it.

That is not enough: as many equations as unknowns may have several solutions, and an entry that belongs to no dependency
among the rows of J, y'J = 0, fits whatever it is. What hangs on such entries is no more than plausible. They show in
random vectors from which their image under J was taken: what is left there is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import SolverError
from ..linalg import UpperTriangle, factorisation
from ..planar.cotangent import edge_weights, weight_gradient
from ..topology import Piece
from .fit import jacobian_rows


@dataclass(frozen=True)
class JudgeOptions:
    """What counts as known; squares of singular values are relative to the typical diagonal entry of J'J.

    Attributes
    ----------
    shift : float
        Of J'J, to make it definite.
    soft : float
        Eigenvalue below which a displacement counts as free: entries know it to 1e-10 of the length of edges.
    moves : float
        Part of the length of edges by which a null vector of length 1 may move a vertex that is determined.
    unchecked : float
        What is left of a standard normal number at an entry that nothing checks.
    solves, probes, most : int
        Inverse iterations, random vectors, and null vectors at most.
    parts : int
        Vertices far from the rim about which others are looked for that move with them.
    """

    shift: float = 1e-14
    soft: float = 1e-12
    moves: float = 1e-9
    unchecked: float = 1e-6
    solves: int = 4
    probes: int = 8
    most: int = 256
    parts: int = 8


def determined(
    piece: Piece, z: NDArray, whole: NDArray[np.bool_], *, known_scale: bool = False
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Vertices, up to a similarity of all of them, and the entries that determine and check them.

    Parameters
    ----------
    piece : Piece
    z : (n,) complex128
        Positions at which whole entries fit.
    whole : (e,) bool
    known_scale : bool
        Whether c is given.

    Returns
    -------
    vertices : (n,) bool
    entries : (e,) bool
    """
    n = piece.n_vertices
    length = np.abs(z[piece.edges[:, 1]] - z[piece.edges[:, 0]])
    size = np.bincount(piece.edges.ravel(), np.repeat(length, 2), n) / np.bincount(piece.edges.ravel(), minlength=n)
    gradient = weight_gradient(piece, z) * size[piece.stencil]
    weights = edge_weights(piece, z) * (not known_scale)
    nothing = np.zeros(n, dtype=bool), np.zeros(len(whole), dtype=bool)
    try:
        checked = _Linearised.of(piece, gradient, weights, whole).checked()
        if not checked.any():
            return nothing
        rest = _Linearised.of(piece, gradient, weights, checked)
        free = rest.null_space()
    except SolverError:
        return nothing
    if free is None:
        return nothing
    vertices = _moving_alike(piece, z, free * size[:, None], size, rest.held)
    return vertices, checked & vertices[piece.stencil].all(axis=0)


@dataclass(frozen=True, eq=False)
class _Linearised:
    """J of some entries, in lengths of edges, and the column of log c.

    Attributes
    ----------
    jacobian : (e, 2 n) sparse
        Zero for other entries.
    slope : (e,) float64
    entries : (e,) bool
    held : (n,) bool
        Vertices that some of the entries depend on.
    """

    jacobian: sp.bsr_array
    slope: NDArray[np.float64]
    entries: NDArray[np.bool_]
    held: NDArray[np.bool_]

    @classmethod
    def of(cls, piece: Piece, gradient: NDArray, weights: NDArray, entries: NDArray[np.bool_]) -> _Linearised:
        """For gradients (4, e) over the stencils of edges."""
        held = np.zeros(piece.n_vertices, dtype=bool)
        held[piece.stencil[:, entries]] = True
        jacobian = jacobian_rows(len(held), [(np.where(entries, gradient, 0), piece.stencil)])
        return cls(jacobian, np.where(entries, weights, 0.0), entries, held)

    def _with_inverse(self, use: Callable[[Callable[[NDArray], NDArray], float], NDArray | None]) -> NDArray | None:
        """What becomes of the inverse of J'J, made definite by a small shift, and its typical diagonal entry.

        With c free its column is projected out, which is a matter of rank one.
        """
        product = UpperTriangle.of(self.jacobian.T.tobsr() @ self.jacobian)
        data, start = product.data.copy(), product.indptr[:-1]
        typical = float(np.median(np.diagonal(data[start][self.held], axis1=1, axis2=2)))
        data[start] += np.where(self.held, JudgeOptions.shift, 1.0)[:, None, None] * typical * np.eye(2)
        matrix = product.with_data(data)
        solver = factorisation(matrix, definite=True)
        try:
            solver.factorise(matrix)
            pull = self.jacobian.T @ self.slope
            response = solver.solve(pull)
            left = float(self.slope @ self.slope - pull @ response)

            def inverse(block: NDArray) -> NDArray:
                x = solver.solve(np.ascontiguousarray(block))
                return x + np.outer(response, pull @ x) / left if left > 0 else x

            return use(inverse, typical)
        finally:
            solver.release()

    def _without_slope(self, image: NDArray) -> NDArray:
        """Columns (e, k) less their component along the column of log c."""
        size = float(self.slope @ self.slope)
        return image - np.outer(self.slope, self.slope @ image) / size if size else image

    def checked(self) -> NDArray[np.bool_]:
        """(e,) entries that others say something about."""

        def use(inverse: Callable[[NDArray], NDArray], typical: float) -> NDArray:
            y = np.random.default_rng(1).standard_normal((len(self.slope), JudgeOptions.probes)) * self.entries[:, None]
            for _ in range(3):  # what the shift leaves, and rounding
                y = self._without_slope(y)
                y = y - self._without_slope(self.jacobian @ inverse(self.jacobian.T @ y))
            return np.asarray(np.abs(y).max(axis=1) > JudgeOptions.unchecked)

        found = self._with_inverse(use)
        assert found is not None
        return found

    def null_space(self) -> NDArray[np.complex128] | None:
        """(n, k) displacements, in lengths of edges; None where there are too many."""

        def use(inverse: Callable[[NDArray], NDArray], typical: float) -> NDArray | None:
            rng, block, count = np.random.default_rng(0), np.empty((2 * len(self.held), 0)), 16
            own = np.repeat(self.held, 2)
            while count <= min(JudgeOptions.most, int(own.sum())):
                more = rng.standard_normal((len(own), count - block.shape[1])) * own[:, None]
                block = np.linalg.qr(np.hstack([block, more]))[0]
                for _ in range(JudgeOptions.solves):
                    block = np.linalg.qr(inverse(block))[0]
                _, values, turn = np.linalg.svd(self._without_slope(self.jacobian @ block), full_matrices=False)
                null = values**2 <= JudgeOptions.soft * typical
                if not null.all():
                    return np.ascontiguousarray((block @ turn[null].T).T).view(np.complex128).T
                count *= 2
            return None

        return self._with_inverse(use)


def _moving_alike(piece: Piece, z: NDArray, free: NDArray, size: NDArray, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) the most vertices that every displacement moves by one similarity: about one of those far from the rim.

    Beyond a neck others may move by another one.
    """
    n = piece.n_vertices
    graph = sp.coo_array((np.ones(len(piece.edges), np.int8), piece.edges.T), shape=(n, n)).tocsr()
    graph = graph + graph.T
    outside = np.union1d(piece.boundary.ravel(), np.flatnonzero(~held))
    depth = np.where(held, csgraph.dijkstra(graph, unweighted=True, indices=outside, min_only=True), -1)
    basis = np.column_stack([np.ones(n), z / np.abs(z).max()])
    best = np.zeros(n, dtype=bool)
    for _ in range(JudgeOptions.parts):
        deepest = int(depth.argmax())
        alike = np.zeros(n, dtype=bool)
        alike[[deepest, *graph.indices[graph.indptr[deepest] : graph.indptr[deepest + 1]]]] = True
        depth[alike] = -1
        while True:
            fit = np.linalg.lstsq(basis[alike], free[alike], rcond=None)[0]
            moves = np.abs(free - basis @ fit).max(axis=1, initial=0.0)
            now = held & (moves <= JudgeOptions.moves * size)
            if now.sum() <= alike.sum():
                alike = np.zeros(n, dtype=bool) if (alike & ~now).any() else now
                break
            alike = now
        depth[alike] = -1
        best = alike if alike.sum() > best.sum() else best
        if 2 * best.sum() > held.sum():
            break
    return best
