"""Normal equations of the cotangent weights, with the similarities pinned."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..errors import SolverError
from ..linalg import Factorisation, UpperTriangle, factorisation
from ..tolerances import AGREED, LAST_DIGITS, ROUNDED
from ..topology import Piece
from .cotangent import weight_gradient


class Jacobian:
    """The derivative of weights at given positions, (e, 2 n) in blocks of x and y; displacements are complex (n,)."""

    def __init__(self, matrix: sp.bsr_array):
        self.matrix, self.n = matrix, matrix.shape[1] // 2

    def forward(self, displacement: NDArray) -> NDArray:
        """J d for d (n,) complex: (e,) real; for (n, k) column by column."""
        return np.asarray(self.matrix @ np.ascontiguousarray(displacement.T).view(np.float64).T)

    def transpose(self, change: NDArray) -> NDArray:
        """J' r for r (e,) real: (n,) complex, x in the real part and y in the imaginary one."""
        return np.asarray(self.matrix.T @ change).view(np.complex128)


class WeightJacobian(Jacobian):
    """That of cotangent weights at positions z (n,).

    `spread` (e,): standard deviation of each weight, by which its row is divided; 1 by default.
    """

    def __init__(self, piece: Piece, z: NDArray, spread: NDArray | None = None):
        with np.errstate(invalid="ignore"):  # flat triangles
            gradient = weight_gradient(piece, z) / (1.0 if spread is None else spread)
        blocks = np.stack([gradient.real.T, -gradient.imag.T], axis=-1).reshape(-1, 1, 2)
        vertices, e = piece.stencil.T.astype(np.int32).ravel(), len(piece.edges)
        start = np.arange(0, 4 * e + 1, 4, dtype=np.int32)
        super().__init__(sp.bsr_array((blocks, vertices, start), shape=(e, 2 * len(z))))


class NormalEquations:
    """Factorised J'J with some vertices held fixed, which pins the freedoms of a similarity, or of several.

    `pins` (k,): vertices that stay where they are; the farther apart the better.

    J'J has the square of the condition of J. Of pieces hundreds of times as long as wide its factor has next to no
    digit left, and which displacement comes out depends on the order in which sums are formed. `corrected`, the factor
    is the preconditioner of conjugate gradients on the least-squares problem itself, whose residual is formed by J.
    """

    def __init__(self, jacobian: Jacobian, pins: NDArray, *, corrected: bool = False):
        self._corrected = corrected
        self._free = np.ones(jacobian.n, dtype=bool)
        self._free[pins] = False
        self._factor = self._factorised(_upper_blocks(jacobian.matrix, self._free))

    def renew(self, jacobian: Jacobian) -> None:
        """Factorise anew for other positions; that the pattern was analysed still counts."""
        matrix = _upper_blocks(jacobian.matrix, self._free)
        try:
            self._factor.factorise(matrix)
        except SolverError:
            self._factor.release()
            self._factor = self._factorised(matrix)

    def _factorised(self, matrix: UpperTriangle) -> Factorisation:
        """Cholesky; where slivers spread the entries so far that a pivot comes out negative, with pivoting.

        A preconditioner has to be positive: as much is added to the diagonal as makes it so.
        """
        for share in (0.0, LAST_DIGITS, 10 * LAST_DIGITS, ROUNDED) if self._corrected else (0.0,):
            try:
                return _factor(_heavier(matrix, share), definite=True)
            except SolverError:
                continue
        return _factor(matrix, definite=False)

    def solve(self, rhs: NDArray) -> NDArray:
        """Least displacement equation J'J d = rhs, both (n,) or (n, k) complex."""
        free = np.ascontiguousarray(rhs[self._free].T)  # each right-hand side x0, y0, x1, y1, ...
        solution = self._factor.solve(free.view(np.float64).T)
        result = np.zeros(rhs.shape, dtype=np.complex128)
        result[self._free] = np.ascontiguousarray(solution.T).view(np.complex128).T
        return result

    def fitted(self, jacobian: Jacobian, changes: NDArray) -> NDArray:
        """Displacements d, (n,) or (n, k), that explain changes r, (e,) or (e, k), of weights best: least |J d - r|."""
        if changes.ndim == 1:
            return self.fitted(jacobian, changes[:, None])[:, 0]
        result = self.solve(self._gradients(jacobian, changes))
        return self._conjugate(jacobian, changes, result) if self._corrected else result

    def _gradients(self, jacobian: Jacobian, changes: NDArray) -> NDArray:
        """J' r of each column."""
        return np.column_stack([jacobian.transpose(change) for change in changes.T])

    def _conjugate(self, jacobian: Jacobian, changes: NDArray, start: NDArray) -> NDArray:
        """Least |J d - r| from a start d (n, k), by conjugate gradients, the factor preconditioning, column by column.

        A. Bjorck, Numerical Methods for Least Squares Problems (1996), section 7.4. A column is done where what is to
        come changes J d by next to nothing of the residual; the best d on the way is kept.
        """
        d, best = start.copy(), start.copy()
        left = changes - jacobian.forward(d)
        least = np.linalg.norm(left, axis=0)
        along, before = np.zeros_like(d), np.ones(d.shape[1])
        for k in range(REFINEMENTS):
            gradient = self._gradients(jacobian, left)
            gradient[~self._free] = 0
            solved = self.solve(gradient)
            size = (gradient.conj() * solved).real.sum(axis=0)  # about the square of what J d still changes by
            active = size > (AGREED * least) ** 2
            if not active.any():
                break
            along = solved + along * (np.where(active, size / before, 0.0) if k else 0.0)
            before = np.where(active, size, 1.0)
            step = jacobian.forward(along)
            square = (step * step).sum(axis=0)
            length = np.where(active & (square > 0), size / np.where(square > 0, square, 1.0), 0.0)
            d += length * along
            left -= length * step
            norm = np.linalg.norm(left, axis=0)
            better = norm < least
            best[:, better], least[better] = d[:, better], norm[better]
        return best

    def release(self) -> None:
        """Give the memory of the factor back."""
        self._factor.release()


class GaussNewton:
    """Steps of the linearised problem min |J d + g w - r| over displacements d and log-scale g.

    `weights` (e,): w, over their standard deviations; None where the scale is known.
    """

    def __init__(self, jacobian: Jacobian, equations: NormalEquations, weights: NDArray | None):
        self._equations, self._weights = equations, weights
        if weights is not None:
            self._response = equations.fitted(jacobian, weights)
            # What J cannot explain of w; nothing but rounding means that c and the shape are confounded.
            left = float(weights @ (weights - jacobian.forward(self._response)))
            self._complement = left if left > LAST_DIGITS * float(weights @ weights) else 0.0

    def __call__(self, jacobian: Jacobian, misfit: NDArray) -> NDArray:
        """Displacements d, (n,) or (n, k) complex, for misfits r, (e,) or (e, k).

        The scale follows from them by least squares.
        """
        move = self._equations.fitted(jacobian, misfit)
        if self._weights is None or not self._complement:
            return move
        log_scale = self._weights @ (misfit - jacobian.forward(move)) / self._complement
        return move - np.multiply.outer(self._response, log_scale)


def _factor(matrix: UpperTriangle, *, definite: bool) -> Factorisation:
    """Raises SolverError where a pivot is zero, or not positive although it should be."""
    factor = factorisation(matrix, definite=definite)
    try:
        factor.factorise(matrix)
    except SolverError:
        factor.release()
        raise
    return factor


def _heavier(matrix: UpperTriangle, share: float) -> UpperTriangle:
    """With a share of each row's diagonal entry added to it."""
    if not share:
        return matrix
    data, first = matrix.data.copy(), matrix.indptr[:-1]  # the blocks of the diagonal
    for k in range(matrix.block):
        data[first, k, k] *= 1 + share
    return matrix.with_data(data)


def _upper_blocks(jacobian: sp.bsr_array, free: NDArray) -> UpperTriangle:
    """Upper triangle of J'J in 2 x 2 blocks, without the pinned vertices."""
    product = jacobian.T.tobsr() @ jacobian
    product.sort_indices()
    number = np.cumsum(free) - 1
    row = np.repeat(np.arange(len(free)), np.diff(product.indptr))
    kept = (product.indices >= row) & free[row] & free[product.indices]
    n = int(free.sum())
    indptr = np.zeros(n + 1, dtype=np.int32)
    np.cumsum(np.bincount(number[row[kept]], minlength=n), out=indptr[1:])
    return UpperTriangle(product.data[kept], number[product.indices[kept]].astype(np.int32), indptr)


def distant_pair(z: NDArray) -> NDArray:
    """Two vertices far apart: the farthest from the centroid, and the farthest from that one."""
    first = int(np.argmax(np.abs(z - z.mean())))
    return np.array([first, int(np.argmax(np.abs(z - z[first])))])
