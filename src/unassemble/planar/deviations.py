"""Standard deviations of recovered coordinates, the diagonal of sigma^2 (J'J)^+, and of the factor c."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg.responses import SamplingOptions, noise_blocks
from ..topology import Piece
from .cotangent import edge_weights
from .normal import Jacobian, NormalEquations, WeightJacobian, distant_pair
from .side_by_side import SideBySide


def coordinate_covariances(
    piece: Piece,
    z: NDArray,
    *,
    beside: float | None,
    stretch: NDArray | None = None,
    spread: NDArray | None = None,
    pins: NDArray | None = None,
    options: SamplingOptions | None = None,
) -> NDArray[np.float64]:
    """Covariance of each vertex for independent noise of standard deviation 1 in the weights w = -A_ij / c.

    The estimate z responds to noise r by y = (J'J)^+ J' r, in the gauge in which a change has no component along
    translations, rotation and scaling. Responses to every single entry add up to the covariance exactly;
    above `options.exact_up_to` edges random sign patterns stand in for them.

    Parameters
    ----------
    piece : Piece
    z : (n,) complex128
        The Laplacian's frame.
    beside : float or None
        What other pieces, fitted with the same c, say of it: the inverse of the variance of log c for such noise. None
        where c was not fitted.
    stretch : (2, 2) float64, optional
        Linear map from that frame to the one in which covariances are wanted.
    spread : (e,) float64, optional
        Standard deviations of the weights relative to that, for which z is the least-squares estimate.
    pins : (k,) int, optional
        Vertices that are held, where two do not fix all similarities.
    options : SamplingOptions, optional

    Returns
    -------
    (n, 2, 2) float64
    """
    jacobian = WeightJacobian(piece, z, spread)
    weights = edge_weights(piece, z) / jacobian.spread
    pins = distant_pair(z) if pins is None else pins
    return covariances(jacobian, weights, z, pins, beside=beside, stretch=stretch, options=options)


def covariances(
    jacobian: Jacobian,
    weights: NDArray,
    z: NDArray,
    pins: NDArray,
    *,
    beside: float | None,
    stretch: NDArray | None = None,
    nodes: Callable[[NDArray], NDArray] = np.asarray,
    options: SamplingOptions | None = None,
) -> NDArray[np.float64]:
    """Those of any model of the weights; see :func:`coordinate_covariances`.

    Parameters
    ----------
    jacobian : Jacobian
        By parameters, which are positions of some vertices.
    weights : (e,) float64
        w at z, over their standard deviations.
    z : (n,) complex128
        All vertices.
    pins : (k,) int
        Parameters that are held.
    beside, stretch, options
        As there.
    nodes : callable
        Displacements of all vertices, (n, k), for those of the parameters.
    """
    equations = NormalEquations(jacobian, pins)
    slope = jacobian.transpose(weights)
    response = equations.solve(slope)
    complement = float(weights @ weights) - float(np.vdot(slope, response).real) + (beside or 0.0)
    gauge = _gauge(z)
    root = np.eye(2) if stretch is None else stretch
    total = np.zeros((len(z), 2, 2))
    for noise in noise_blocks(len(weights), options or SamplingOptions()):
        y = equations.solve(np.column_stack([jacobian.transpose(column) for column in noise.T]))
        if beside is not None and complement > 0:
            along = (weights @ noise - np.real(slope.conj() @ y)) / complement
            y = y - response[:, None] * along
        total += _spread(nodes(y), gauge, root)
    if beside is not None and complement > 0:
        total += _spread(nodes(response[:, None]) * np.sqrt(beside) / complement, gauge, root)
    equations.release()
    return total


def _spread(moves: NDArray, gauge: NDArray, root: NDArray) -> NDArray[np.float64]:
    """(n, 2, 2) sums of the products of some displacements (n, k), without their similarities."""
    flat = np.stack([moves.real, moves.imag], axis=1).reshape(2 * len(moves), -1)
    flat -= gauge @ (gauge.T @ flat)
    moved = root @ flat.reshape(len(moves), 2, -1)
    return moved @ moved.transpose(0, 2, 1)


def factor_deviations(
    pieces: Sequence[Piece], positions: Sequence[NDArray], spreads: Sequence[NDArray | None]
) -> NDArray[np.float64]:
    """Standard deviations of log c for independent noise in the weights, positions being fitted as well.

    1 / |w - J (J'J)^+ J'w|: what of the weights no displacement explains tells c.

    Parameters
    ----------
    pieces : sequence of Piece
    positions : sequence of (n,) complex128
        Each in the Laplacian's frame, of any size.
    spreads : sequence of (e,) float64 or None
        Standard deviations of the weights, in units of c; 1 by default.

    Returns
    -------
    (pieces,) float64
        Infinite where the weights do not tell c.
    """
    try:
        return _factor_deviations(pieces, positions, spreads)
    except SolverError:  # flat triangles; those of one piece should not stop the others
        if len(pieces) == 1:
            return np.array([np.inf])
        one_by_one = zip(pieces, positions, spreads, strict=True)
        return np.concatenate([factor_deviations([p], [z], [s]) for p, z, s in one_by_one])


def _factor_deviations(
    pieces: Sequence[Piece], positions: Sequence[NDArray], spreads: Sequence[NDArray | None]
) -> NDArray[np.float64]:
    union = SideBySide.of(pieces, positions)
    given = zip(pieces, spreads, strict=True)
    spread = np.concatenate([np.ones(len(piece.edges)) if s is None else s for piece, s in given])
    jacobian = WeightJacobian(union.piece, union.z, spread)
    weights = edge_weights(union.piece, union.z) / spread
    equations = NormalEquations(jacobian, union.pins)
    left = weights - jacobian.forward(equations.fitted(jacobian, weights))
    equations.release()
    told = np.add.reduceat(weights * left, union.edges[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(told > 0, 1 / np.sqrt(told), np.inf)


def _gauge(z: NDArray) -> NDArray:
    """Orthonormal basis (2n, 4) of displacements that change no angle."""
    one, d = np.ones(len(z)), z - z.mean()
    fields = (one + 0j, 1j * one, d, 1j * d)
    columns = [np.stack([f.real, f.imag], axis=1).ravel() for f in fields]
    return np.linalg.qr(np.column_stack(columns))[0]
