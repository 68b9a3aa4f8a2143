"""Cotangent weights of a drawn mesh and their derivatives (paper, equations 1 and 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece


def _legs(piece: Piece, z: NDArray) -> tuple[NDArray, NDArray]:
    """Sides u = a - c, w = b - c that leave each corner c, as complex (m, 3)."""
    at = z[piece.triangles]
    return at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at


def edge_weights(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """w_e: half the sum of the cotangents that face each edge (e,), for positions z (n,) complex."""
    u, w = _legs(piece, z)
    product = np.conj(u) * w
    cotangent = (product.real / product.imag).ravel()
    first, second = piece.facing.T
    return (cotangent[first] + np.where(second >= 0, cotangent[second], 0.0)) / 2


def weight_roundings(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """Size of the rounding errors of assembled weights (e,), in units of the machine precision.

    A cotangent is a quotient of products of sides, so its error is about 1 / sin(gamma), far from
    uniform where there are slivers.
    """
    u, w = _legs(piece, z)
    inverse_sine = (np.abs(u) * np.abs(w) / np.abs((np.conj(u) * w).imag)).ravel()
    first, second = piece.facing.T
    return (inverse_sine[first] + np.where(second >= 0, inverse_sine[second], 0.0)) / 2


def corner_gradients(piece: Piece, z: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Half the cotangent at each corner and how it changes as the ends of the facing edge move.

    From gamma = arg(w / u) at the corner between sides u and w,
    d cot(gamma) = -Im(dw / w - du / u) / sin(gamma)^2.

    Returns
    -------
    to_tail, to_head : (m, 3) complex128
        g with d cot / 2 = Re(g dz) for the tail and head of the edge facing the corner; the corner itself
        has minus their sum.
    cotangent : (m, 3) float64
    """
    u, w = _legs(piece, z)
    product = np.conj(u) * w
    factor = 0.5j * (np.abs(u) * np.abs(w) / product.imag) ** 2
    return -factor / u, factor / w, product.real / product.imag


def weight_gradient(piece: Piece, z: NDArray) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
    """Derivative of the weights: dw_e = Re sum_k g_ek dz_(v_ek).

    Returns
    -------
    vertices : (e, 4) int64
        Tail, head and apex in the edge's first triangle, apex in its second (on the boundary the first again).
    g : (e, 4) complex128
        Zero in the last column on the boundary.
    """
    to_tail, to_head, _ = (part.ravel() for part in corner_gradients(piece, z))
    first, second = piece.facing.T
    inner = second >= 0
    second = np.where(inner, second, first)
    flat = piece.triangles.ravel()
    tail = flat[3 * (first // 3) + (first + 1) % 3]
    head = flat[3 * (first // 3) + (first + 2) % 3]
    # The second triangle runs along the edge from head to tail.
    g_tail = to_tail[first] + np.where(inner, to_head[second], 0)
    g_head = to_head[first] + np.where(inner, to_tail[second], 0)
    g_first = -(to_tail + to_head)[first]
    g_second = np.where(inner, -(to_tail + to_head)[second], 0)
    vertices = np.column_stack([tail, head, flat[first], flat[second]])
    return vertices, np.column_stack([g_tail, g_head, g_first, g_second])
