"""Cotangent weights of a drawn mesh and their derivatives (paper, equations 1 and 2).

Everything is computed edge by edge from its stencil: tail t, head h and the apexes a, b of the triangles on its left
and right. The angle at the left apex lies between t - a and h - a, that at the right one between h - b and t - b.
"""

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece


def _sides(piece: Piece, z: NDArray) -> tuple[tuple[NDArray, NDArray], tuple[NDArray, NDArray]]:
    """Sides u, w that leave the left apex and the right one of each edge, counter-clockwise; (e,) complex each."""
    tail, head, left, right = z[piece.stencil]
    return (tail - left, head - left), (head - right, tail - right)


def _halved(piece: Piece, left: NDArray, right: NDArray, factor: NDArray | None = None) -> NDArray:
    """Half the sum over both sides of each edge, times factors (m,) of triangles; on the boundary there is no right."""
    with np.errstate(invalid="ignore"):  # flat triangles on both sides
        if factor is not None:
            left, right = factor[piece.facing // 3].T * (left, right)
        return np.asarray((left + np.where(piece.inner, right, 0)) / 2)


def cotangent(u: NDArray, w: NDArray) -> NDArray[np.float64]:
    """Of the angle from side u to side w, complex; not finite at flat triangles."""
    product = np.conj(u) * w
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(product.real / product.imag)


def edge_weights(piece: Piece, z: NDArray, factor: NDArray | None = None) -> NDArray[np.float64]:
    """w_e: half the sum of the cotangents that face each edge (e,), for positions z (n,) complex.

    With factors (m,) each triangle's cotangents count so many times.
    """
    left, right = _sides(piece, z)
    return _halved(piece, cotangent(*left), cotangent(*right), factor)


def corner_sides(triangles: NDArray, z: NDArray) -> tuple[NDArray, NDArray]:
    """(m, 3) sides that leave the corners of triangles (m, 3), complex: to the next corner, and to the one before."""
    corner = z[triangles]
    return np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner


def halves(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """(m, 3) halves of the cotangents of triangles, each with the side that it faces as ``piece.opposite`` has them."""
    return cotangent(*corner_sides(piece.triangles, z)) / 2


def areas(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """(m,) twice the areas of triangles, negative where they run clockwise."""
    a, b, c = z[piece.triangles].T
    return np.asarray((np.conj(b - a) * (c - a)).imag)


def weight_roundings(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """Size of the rounding errors of assembled weights (e,), in units of the machine precision.

    A cotangent is a quotient of products of sides, so its error is about 1 / sin(gamma), far from
    uniform where there are slivers.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # flat triangles
        left, right = (1 / np.abs(_sine(u, w)) for u, w in _sides(piece, z))
    return _halved(piece, left, right)


def _sine(u: NDArray, w: NDArray) -> NDArray[np.float64]:
    return (np.conj(u) * w).imag / (np.abs(u) * np.abs(w))


def corner_gradients(u: NDArray, w: NDArray) -> tuple[NDArray, NDArray]:
    """How half the cotangent of the angle between sides u and w of a corner changes as their other ends move.

    From gamma = arg(w / u), d cot(gamma) = -Im(dw / w - du / u) / sin(gamma)^2.

    Returns `at_u` and `at_w`: g with d cot / 2 = Re(g dz) for the ends of u and w; the corner itself has minus their
    sum.
    """
    factor = 0.5j / _sine(u, w) ** 2
    return -factor / u, factor / w


def weight_gradient(piece: Piece, z: NDArray, factor: NDArray | None = None) -> NDArray[np.complex128]:
    """Derivative of the weights: dw_e = Re sum_k g_ke dz_(v_ke) over the vertices v_ke of ``piece.stencil``.

    Returns (4, e), zero in the last row on the boundary; not finite at flat triangles.
    """
    left, right = _sides(piece, z)
    one, other = (1.0, 1.0) if factor is None else factor[piece.facing // 3].T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        tail, head = (one * g for g in corner_gradients(*left))
        head_right, tail_right = (np.where(piece.inner, other * g, 0) for g in corner_gradients(*right))
    return np.stack([tail + tail_right, head + head_right, -(tail + head), -(tail_right + head_right)])
