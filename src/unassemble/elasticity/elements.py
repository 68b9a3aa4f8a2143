"""Element stiffness of isotropic elasticity for unit Lame coefficients."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray


def element_blocks(points: NDArray, cells: NDArray, order: int) -> tuple[NDArray, NDArray]:
    """Blocks of all pairs of corners, for (lambda, mu) = (1, 0) and (0, 1).

    Parameters
    ----------
    points : (n, d) float64
    cells : (m, d + 1) or (m, 2**d) int64
        Simplices with linear functions, or boxes with multilinear ones in meshio's order.
    order : int
        Gauss points per direction, for boxes.

    Returns
    -------
    first, second : (m, k, k, d, d) float64
    """
    d = points.shape[1]
    k = cells.shape[1]
    if k == d + 1:
        local, weights = np.vstack([-np.ones(d), np.eye(d)])[None], np.array([1 / (1, 1, 2, 6)[d]])
    else:
        local, weights = _box_gradients(d, order)
    first = np.zeros((len(cells), k, k, d, d))
    second = np.zeros_like(first)
    for gradient, weight in zip(local, weights, strict=True):
        jacobian = np.einsum("mke,kr->mer", points[cells], gradient)
        g = np.einsum("kr,mre->mke", gradient, np.linalg.inv(jacobian))
        volume = weight * np.abs(np.linalg.det(jacobian))
        outer = np.einsum("m,mic,mjb->mijcb", volume, g, g)
        first += outer
        second += outer.transpose(0, 1, 2, 4, 3)
        second += np.einsum("mijcc->mij", outer)[..., None, None] * np.eye(d)
    return first, second


def _box_gradients(d: int, order: int) -> tuple[NDArray, NDArray]:
    """Gradients of the multilinear functions at Gauss points of the unit box, and weights."""
    node, weight = np.polynomial.legendre.leggauss(order)
    node, weight = (node + 1) / 2, weight / 2
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners = ring if d == 2 else [(*r, z) for z in (0, 1) for r in ring]
    gradients, weights = [], []
    for place in product(range(order), repeat=d):
        s = node[list(place)]
        value = np.array([[s[a] if c[a] else 1 - s[a] for a in range(d)] for c in corners])
        slope = np.array([[1.0 if c[a] else -1.0 for a in range(d)] for c in corners])
        gradients.append(np.stack([slope[:, a] * np.delete(value, a, axis=1).prod(axis=1) for a in range(d)], axis=1))
        weights.append(weight[list(place)].prod())
    return np.array(gradients), np.array(weights)
