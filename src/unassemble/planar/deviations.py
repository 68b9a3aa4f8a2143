"""Standard deviations of recovered coordinates, the diagonal of sigma^2 (J'J)^+."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..linalg.responses import SamplingOptions, noise_blocks
from .normal import GaussNewton, Jacobian, NormalEquations


def covariances(
    jacobian: Jacobian,
    weights: NDArray,
    z: NDArray,
    pins: NDArray,
    *,
    free_scale: bool,
    stretch: NDArray | None = None,
    nodes: Callable[[NDArray], NDArray] = np.asarray,
    options: SamplingOptions | None = None,
) -> NDArray[np.float64]:
    """Covariance of each vertex for independent noise of standard deviation 1 in the weights w = -A_ij / c.

    The estimate z responds to noise r by y = (J'J)^+ J' r, in the gauge in which a change has no component along
    translations, rotation and scaling. Responses to every single entry add up to the covariance exactly;
    above `options.exact_up_to` edges random sign patterns stand in for them.

    `jacobian`: by parameters, which are positions of some vertices; `weights` (e,): w at z, over their standard
    deviations; `z` (n,): all vertices, in the Laplacian's frame; `pins` (k,): parameters that are held; `free_scale`:
    whether c was fitted; `stretch` (2, 2): linear map from that frame to the one in which covariances are wanted;
    `nodes`: displacements of all vertices, (n, k), for those of the parameters. Returns (n, 2, 2).
    """
    equations = NormalEquations(jacobian, pins)
    system = GaussNewton(jacobian, equations, weights if free_scale else None)
    one, d = np.ones(len(z)), z - z.mean()
    fields = np.column_stack([one + 0j, 1j * one, d, 1j * d])  # displacements that change no angle
    gauge = np.linalg.qr(np.stack([fields.real, fields.imag], axis=1).reshape(2 * len(z), 4))[0]
    root = np.eye(2) if stretch is None else stretch
    total = np.zeros((len(z), 2, 2))
    for noise in noise_blocks(len(weights), options or SamplingOptions()):
        moves = nodes(system(jacobian, noise))
        flat = np.stack([moves.real, moves.imag], axis=1).reshape(2 * len(moves), -1)
        flat -= gauge @ (gauge.T @ flat)
        moved = root @ flat.reshape(len(moves), 2, -1)
        total += moved @ moved.transpose(0, 2, 1)
    equations.release()
    return total
