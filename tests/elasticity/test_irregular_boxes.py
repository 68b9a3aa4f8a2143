"""Quadrilaterals and hexahedra around irregular vertices: opposite corners share more than their cell."""

import numpy as np
import pytest
import skfem
from assembled import eliminated, error, on_plane, permuted_nodes, stiffness

from unassemble.elasticity import recover_elasticity


def with_insets(counts: tuple[int, int]) -> skfem.MeshQuad:
    """A grid some of whose squares hold a smaller one, whose four corners have three neighbours each."""
    grid = skfem.MeshQuad.init_tensor(*(np.linspace(0, 1, k) for k in counts))
    step = 0.15 * np.random.default_rng(0).uniform(-1, 1, grid.p.shape) / max(counts)
    points, cells = grid.p + step, grid.t
    chosen = np.flatnonzero(np.arange(cells.shape[1]) % 3 == 1)
    for cell in chosen:
        outer = cells[:, cell]
        centre = points[:, outer].mean(axis=1, keepdims=True)
        inner = points.shape[1] + np.arange(4)
        points = np.hstack([points, centre + 0.45 * (points[:, outer] - centre)])
        around = [[outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k]] for k in range(4)]
        cells = np.hstack([cells, inner[:, None], np.array(around).T])
    return skfem.MeshQuad(points, np.delete(cells, chosen, axis=1))


def raised(flat: skfem.MeshQuad, layers: int) -> skfem.MeshHex:
    """Layers of hexahedra on quadrilaterals, in scikit-fem's order of corners."""
    heights = np.linspace(0, 0.6, layers + 1)
    n = flat.p.shape[1]
    points = np.vstack([np.tile(flat.p, layers + 1), np.repeat(heights, n)])
    below = np.hstack([flat.t + n * k for k in range(layers)])
    return skfem.MeshHex(points, np.vstack([below, below + n])[[0, 1, 3, 4, 2, 5, 7, 6]])


@pytest.mark.parametrize("kind", ["quad-q1", "quad-s2", "hex-q1", "hex-s2"])
@pytest.mark.parametrize("clamped", [False, True])
def test_cells_around_irregular_vertices_are_found(kind, clamped):
    mesh = raised(with_insets((4, 3)), 2) if kind.startswith("hex") else with_insets((5, 4))
    lam, mu = np.random.default_rng(3).uniform(1, 3, (2, mesh.nelements, 1))
    given = permuted_nodes(stiffness(kind, mesh, lam=lam, mu=mu), seed=2)
    gone = on_plane(given, 0) & clamped
    matrix, nodes = eliminated(given, np.repeat(gone[:, None], given.dim, axis=1))
    found = recover_elasticity(matrix)
    known = np.isfinite(found.points).all(axis=1)
    assert error(found.points[known], given.points[nodes[known]]) < 1e-9
    assert found.cells.certified
    whole = {frozenset(cell) for cell in given.cells.tolist() if not gone[cell].any()}
    corners = found.cells.cells[:, : given.cells.shape[1]]
    seen = {frozenset(cell) for cell in nodes[corners].tolist()}
    assert seen <= whole
    assert len(seen) > 0.8 * len(whole)
