"""Element matrices: mass and isotropic elasticity, from one set of shape functions and any quadrature.

An isoparametric cell maps the reference element by x(t) = sum_k x_k phi_k(t). With J = dx/dt, gradients in space are
J^-T times those in the reference element, and |det J| is the volume that goes with a weight.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import LAST_DIGITS
from .kinds import Kind
from .reference import Rule, shape_functions, shape_gradients


def mass(points: NDArray[np.float64], cells: NDArray[np.int64], kind: Kind, rule: Rule) -> NDArray[np.float64]:
    """(m, k, k) integrals of phi_i phi_j."""
    at, weights = rule
    total = np.zeros((len(cells), kind.nodes, kind.nodes))
    for value, slopes, weight in zip(shape_functions(kind, at), shape_gradients(kind, at), weights, strict=True):
        size = np.abs(np.linalg.det(points[cells].transpose(0, 2, 1) @ slopes))
        total += (size * weight)[:, None, None] * np.outer(value, value)
    return total


def elasticity(
    points: NDArray[np.float64], cells: NDArray[np.int64], kind: Kind, rule: Rule
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, k, k, d, d) blocks of isotropic elasticity for (lambda, mu) = (1, 0) and (0, 1), by i, j, c, b.

    The strain energy lambda tr(e)^2 / 2 + mu e : e gives int lambda d_c phi_i d_b phi_j + mu d_b phi_i d_c phi_j +
    delta_cb mu grad phi_i . grad phi_j.
    """
    m, k, d = len(cells), kind.nodes, kind.dim
    at, weights = rule
    local = shape_gradients(kind, at)
    jacobian = np.einsum("mke,qkr->mqer", points[cells], local, optimize=True)
    size = np.abs(np.linalg.det(jacobian))
    jacobian[size <= LAST_DIGITS * np.linalg.norm(jacobian, axis=(2, 3)) ** d] = np.eye(d)  # flat, and of no weight
    g = np.einsum("qkr,mqre->mqke", local, np.linalg.inv(jacobian), optimize=True).reshape(m, len(weights), k * d)
    outer = (g * (size * weights)[..., None]).transpose(0, 2, 1) @ g  # one product of matrices per cell: fast
    first = outer.reshape(m, k, d, k, d).transpose(0, 1, 3, 2, 4)
    trace = np.trace(first, axis1=3, axis2=4)
    return first, first.transpose(0, 1, 2, 4, 3) + trace[..., None, None] * np.eye(kind.dim)


def assembled(blocks: NDArray[np.float64], cells: NDArray[np.int64], n: int) -> sp.csr_array:
    """The matrix of n nodes that element matrices (m, k, k) add up to; node by node, if of blocks: (m, k, k, d, d)."""
    d = blocks.shape[-1] if blocks.ndim == 5 else 1
    unknowns = (cells[:, :, None] * d + np.arange(d)).reshape(len(cells), -1)
    size = unknowns.shape[1]
    flat = (blocks.transpose(0, 1, 3, 2, 4) if blocks.ndim == 5 else blocks).reshape(len(cells), size, size)
    row, column = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
    return sp.csr_array((flat.ravel(), (row.ravel(), column.ravel())), shape=(n * d, n * d))
