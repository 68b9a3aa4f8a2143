"""Meshes and matrices for measurements: made by scipy and scikit-fem, not by the code under test."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay
from skfem import Basis, ElementTriP1, MeshTri
from skfem.models import laplace

ISLANDS = ((0.30, 0.30, 0.08), (0.70, 0.40, 0.10), (0.50, 0.75, 0.06))


def irregular_mesh(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Delaunay mesh of about n jittered lattice points in the unit square with three islands.

    Returns
    -------
    points : (v, 2) float64
    triangles : (m, 3) int64
    """
    k = int(np.sqrt(n))
    rng = np.random.default_rng(seed)
    column, row = np.meshgrid(np.arange(k), np.arange(k))
    lattice = np.column_stack([(column + 0.5 * (row % 2)).ravel(), row.ravel()])
    points = (lattice + rng.uniform(-0.25, 0.25, lattice.shape)) / k
    # Nothing flat along the hull, and no island shore of three edges.
    triangles = Delaunay(points).simplices.astype(np.int64)
    centre = points[triangles].mean(axis=1)
    kept = np.abs(centre - 0.5).max(axis=1) < 0.5 - 1.5 / k
    for x, y, radius in ISLANDS:
        kept &= np.hypot(centre[:, 0] - x, centre[:, 1] - y) > radius
    triangles = largest_piece(triangles[kept])
    used, corner = np.unique(triangles, return_inverse=True)
    return points[used], corner.reshape(-1, 3)


def largest_piece(triangles: np.ndarray) -> np.ndarray:
    """The triangles of the largest edge-connected piece: cutting islands out can leave some that hang by a vertex."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    _, side = np.unique(sides[:, 0] * (sides.max() + 1) + sides[:, 1], return_inverse=True)
    incidence = sp.coo_array((np.ones(len(side)), (np.arange(len(side)) // 3, side))).tocsr()
    _, label = connected_components(incidence @ incidence.T, directed=False)
    return triangles[label == np.bincount(label).argmax()]


def laplacian(points: np.ndarray, triangles: np.ndarray, c: float, seed: int = 1) -> tuple[sp.csr_array, np.ndarray]:
    """c L with rows in random order.

    Returns
    -------
    matrix : (v, v) csr_array
    points : (v, 2) float64
        In the order of the rows.
    """
    mesh = MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))
    stiffness = laplace.assemble(Basis(mesh, ElementTriP1())).tocoo()
    place = np.random.default_rng(seed).permutation(len(points))
    matrix = sp.coo_array((c * stiffness.data, (place[stiffness.row], place[stiffness.col])), shape=stiffness.shape)
    return matrix.tocsr(), points[np.argsort(place)]
