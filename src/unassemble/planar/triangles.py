"""Pieces of a single triangle, many at a time: three weights and their angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..tolerances import ROUNDED
from ..topology import Piece
from .piece import PieceMesh


def lone_triangles(
    pieces: Sequence[Piece], weights: NDArray, scale: float | None = None, spread: NDArray | None = None
) -> dict[Piece, PieceMesh]:
    """Exact positions of pieces that are one triangle each.

    The halves g = cot / 2 of the angles of a triangle satisfy g1 g2 + g2 g3 + g3 g1 = 1/4, and three numbers that do,
    the sum of any two positive, are such halves. So three weights with positive sums belong to one triangle and one c.

    Parameters
    ----------
    pieces : sequence of Piece
    weights : (e,) float64
        -A_ij of each edge of the whole graph.
    scale : float, optional
        c, where it is known: triangles that have another are left out.
    spread : (e,) float64, optional
        Standard deviations of the entries' errors up to a common factor; by default those of rounding, as in
        :func:`~unassemble.planar.cotangent.weight_roundings`.

    Returns
    -------
    dict
        From some of the pieces, those to which this applies, to positions with the first side from 0 to 1.
    """
    lone = [piece for piece in pieces if len(piece.triangles) == 1]
    if not lone:
        return {}
    corners = np.concatenate([piece.triangles for piece in lone])
    opposite = np.concatenate([piece.opposite for piece in lone])
    rows = np.stack([piece.edge_rows for piece in lone])
    facing = np.take_along_axis(weights[rows], opposite, axis=1)
    a, b, c = facing.T
    largest = np.abs(facing).max(axis=1)
    with np.errstate(all="ignore"):
        relative = facing / largest[:, None]
        form = (relative * np.roll(relative, -1, axis=1)).sum(axis=1)
        factor = 2 * np.sqrt(form) * largest * np.sign(a + b)
        sums = np.stack([a + b, b + c, c + a])
        usable = ((sums > 0).all(axis=0) | (sums < 0).all(axis=0)) & (
            form > ROUNDED
        )  # below, in units of the largest weight, rounding decides about c
        if scale is not None:
            usable &= np.abs(factor / scale - 1) < ROUNDED
            factor = np.full_like(factor, scale)
        cotangents = 2 * facing / factor[:, None]
        height = 1 / (cotangents[:, 0] + cotangents[:, 1])
        apex = height * (cotangents[:, 0] + 1j)
    z = np.zeros(corners.shape, dtype=np.complex128)
    np.put_along_axis(z, corners, np.column_stack([np.zeros_like(apex), np.ones_like(apex), apex]), axis=1)
    usable &= np.isfinite(z).all(axis=1)
    if spread is None:
        errors = np.empty(facing.shape)
        np.put_along_axis(errors, opposite, np.sqrt(1 + cotangents**2) / 2, axis=1)
    else:
        errors = spread[rows]
    return {lone[k]: PieceMesh(z[k], float(factor[k]), spread=errors[k]) for k in np.flatnonzero(usable).tolist()}
