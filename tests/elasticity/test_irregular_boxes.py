"""Quadrilaterals and hexahedra around irregular vertices, as triangles and tetrahedra cut into boxes have them."""

from itertools import combinations

import numpy as np
import pytest
import skfem
from assembled import eliminated, error, on_plane, permuted_nodes, recover_elasticity, stiffness
from scipy.spatial import Delaunay


def cut_into_boxes(points: np.ndarray, simplices: np.ndarray) -> skfem.Mesh:
    """One box at each corner of each simplex: its corner, middles of edges and facets there, and the centre."""
    d = points.shape[1]
    place: dict[tuple, int] = {}
    cells = []
    for simplex in simplices.tolist():
        for corner in simplex:
            others = [node for node in simplex if node != corner]
            sets = [(corner, *some) for size in range(d + 1) for some in combinations(others, size)]
            cells.append([place.setdefault(tuple(sorted(some)), len(place)) for some in sets])
    x = np.array([points[list(some)].mean(axis=0) for some in place])
    cells = np.array(cells)
    turned = np.linalg.det(x[cells[:, 1 : d + 1]] - x[cells[:, :1]]) < 0
    if d == 2:
        cells[turned] = cells[turned][:, [0, 2, 1, 3]]
        return skfem.MeshQuad(x.T.copy(), cells[:, [0, 1, 3, 2]].T.copy())
    cells[turned] = cells[turned][:, [0, 2, 1, 3, 4, 6, 5, 7]]
    return skfem.MeshHex(x.T.copy(), cells.T.copy())


def scattered(d: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the unit square or cube with its corners, and their Delaunay simplices, flat ones left out."""
    points = np.vstack([np.random.default_rng(0).random((n, d)), np.indices((2,) * d).reshape(d, -1).T])
    simplices = Delaunay(points).simplices
    edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
    thick = np.abs(np.linalg.det(edges)) > 0.05 * np.linalg.norm(edges, axis=2).max(axis=1) ** d
    used, simplices = np.unique(simplices[thick], return_inverse=True)
    return points[used], simplices.reshape(-1, d + 1)


@pytest.mark.parametrize(("kind", "n"), [("quad-q1", 40), ("quad-s2", 40), ("hex-q1", 20), ("hex-s2", 6)])
@pytest.mark.parametrize("clamped", [False, True])
def test_cells_around_irregular_vertices_are_found(kind, n, clamped):
    mesh = cut_into_boxes(*scattered(3 if kind.startswith("hex") else 2, n))
    lam, mu = np.random.default_rng(3).uniform(1, 3, (2, mesh.nelements, 1))
    given = permuted_nodes(stiffness(kind, mesh, lam=lam, mu=mu), seed=2)
    gone = on_plane(given, 0) & clamped
    matrix, nodes = eliminated(given, np.repeat(gone[:, None], given.dim, axis=1))
    found = recover_elasticity(matrix)
    known = np.isfinite(found.points).all(axis=1)
    assert found.certified
    assert error(found.points[known], given.points[nodes[known]]) < 1e-9
    assert len(found.lame)
    whole = {frozenset(cell) for cell in given.cells.tolist() if not gone[cell].any()}
    (cells,) = found.cells.values()
    corners = cells[:, : given.cells.shape[1]]
    seen = {frozenset(cell) for cell in nodes[corners].tolist()}
    assert seen <= whole
    assert len(seen) > 0.6 * len(whole)
