"""Element stiffness of isotropic elasticity for unit Lame coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .kinds import Kind
from .reference import Rule, shape_gradients


def element_blocks(points: NDArray, cells: NDArray, kind: Kind, rule: Rule) -> tuple[NDArray, NDArray]:
    """Blocks of all pairs of nodes, for (lambda, mu) = (1, 0) and (0, 1).

    Parameters
    ----------
    points : (n, d) float64
    cells : (m, k) int64
        Isoparametric, in meshio's order.
    kind : Kind
    rule : (q, d) and (q,) float64
        Quadrature in the reference element.

    Returns
    -------
    first, second : (m, k, k, d, d) float64
        ``first[e, i, j, c, b]`` is the integral of d_c phi_i d_b phi_j.
    """
    m, k, d = len(cells), kind.nodes, kind.dim
    g, volume = _gradients(points, cells, kind, rule)
    g = g.reshape(m, len(volume.T), k * d)
    # One product of matrices per cell: its columns are the quadrature points.
    outer = (g * volume[..., None]).transpose(0, 2, 1) @ g
    first = outer.reshape(m, k, d, k, d).transpose(0, 1, 3, 2, 4)
    trace = np.trace(first, axis1=3, axis2=4)
    return first, first.transpose(0, 1, 2, 4, 3) + trace[..., None, None] * np.eye(d)


def point_blocks(points: NDArray, cells: NDArray, kind: Kind, rule: Rule) -> NDArray[np.float64]:
    """The same point by point of the quadrature: (2 q, m, k, k, d, d), first for lambda, then for mu."""
    g, volume = _gradients(points, cells, kind, rule)
    first = np.einsum("mq,mqic,mqjb->qmijcb", volume, g, g, optimize=True)
    trace = np.trace(first, axis1=4, axis2=5)
    return np.concatenate([first, first.swapaxes(4, 5) + trace[..., None, None] * np.eye(kind.dim)])


def point_volumes(points: NDArray, cells: NDArray, kind: Kind, rule: Rule) -> NDArray[np.float64]:
    """(m, q) shares of each cell's volume that the quadrature points stand for."""
    volume = _gradients(points, cells, kind, rule)[1]
    return volume / volume.sum(axis=1, keepdims=True)


def _gradients(points: NDArray, cells: NDArray, kind: Kind, rule: Rule) -> tuple[NDArray, NDArray]:
    """(m, q, k, d) gradients of the shape functions in space, and (m, q) weights."""
    at, weights = rule
    local = shape_gradients(kind, at)
    jacobian = np.einsum("mke,qkr->mqer", points[cells], local, optimize=True)
    size = np.abs(np.linalg.det(jacobian))
    flat = size <= 1e-14 * np.linalg.norm(jacobian, axis=(2, 3)) ** kind.dim
    jacobian[flat] = np.eye(kind.dim)  # not a cell: whatever it adds does not fit
    return np.einsum("qkr,mqre->mqke", local, np.linalg.inv(jacobian), optimize=True), size * weights
