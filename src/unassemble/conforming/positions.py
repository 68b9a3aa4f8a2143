"""Positions of corners from the conformal pencil, whatever the element (theory: any conforming element).

Where cells are straight, coordinates are determined by those of corners, z = P z_c, and the form M restricted to such
fields, P' M P, is the one of linear elements on the corners: with quadratic or cubic triangles that of P1, exactly. So
one problem of the size of the corners serves all orders, and its null space is that of linear elements.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..planar.conformal import ConformalOptions, smooth_start
from ..planar.pencil import ConformalPencil, ShiftedSearch
from ..tolerances import SUMMED
from ..topology.keys import distinct
from .parts import Part
from .sets import pairs_of


def among_corners(part: Part, weights: NDArray) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Pairs of corners, lexicographic, and the weights of L restricted to straight cells.

    `weights` (e,): -A_ij of the part's edges.
    """
    if part.degree == 1:
        return part.edges, weights
    n, c = part.n, part.n_corners
    i, j = part.edges.T
    sums = np.bincount(part.edges.ravel(), np.repeat(weights, 2), n)
    place = np.concatenate([i, j, np.arange(n)]), np.concatenate([j, i, np.arange(n)])
    whole = sp.csr_array((np.concatenate([-weights, -weights, sums]), place), shape=(n, n))
    to_nodes = part.from_corners()
    reduced = sp.csr_array(to_nodes.T @ (whole @ to_nodes))
    pairs = [pairs_of(c, cells[:, : kind.corners]).ravel() for kind, cells in part.blocks.items()]
    keys = distinct(np.concatenate(pairs))
    edges = np.column_stack([keys // c, keys % c])
    return edges, -np.asarray(reduced[edges[:, 0], edges[:, 1]]).ravel()


def corner_positions(part: Part, weights: NDArray, scale: float | None) -> tuple[NDArray[np.complex128], float]:
    """Positions of corners up to a similarity, and c.

    `weights` (e,): -A_ij of the part's edges; `scale`: c, where it is known.

    Raises GeometryError if no map of positive area is found, or the entries make no positive energy.
    """
    edges, weights = among_corners(part, weights)
    unit = float(np.sign(weights.sum()) * np.median(np.abs(weights[weights != 0]))) if weights.any() else 0.0
    if not unit:
        raise GeometryError("the off-diagonal entries add up to zero, those of a Laplacian cannot")
    relative = weights / unit
    sums = np.bincount(edges.ravel(), np.repeat(relative, 2), part.n_corners)
    if not (np.isfinite(relative).all() and (sums > SUMMED).all()):
        row = int(part.piece.vertices[np.argmin(sums)])
        raise GeometryError(f"the entries do not make a positive energy in row {row}: they belong to no planar mesh")
    piece, options = part.piece, ConformalOptions()
    pencil = ConformalPencil(part.n_corners, edges, piece.boundary, relative)
    search = ShiftedSearch(pencil, options.krylov_steps)
    start = smooth_start(part.n_corners, piece.boundary, piece.loop_offsets)
    if scale is not None:
        z, c, _ = search.at(scale / unit * (1 - options.margin), start, steps=2)
        return search.corrected(z, c), scale
    # Half the energy alone is definite, and from there the cluster of holomorphic maps is seen as one.
    z, c, spread = search.at(0.0, start)
    whole = 1 / unit  # c = 1 is common
    while search.factorisations < options.max_factorisations:
        distance = min(max(4 * spread, options.margin), 0.3)
        likely = abs(c / whole - 1) <= distance
        z, c, spread = search.at(whole * (1 - options.margin) if likely else c * (1 - distance), z)
        whole = np.inf
        if (distance <= 1e-9 or likely) and spread < 1e-12:
            break
    return search.corrected(z, c), float(c * unit)
