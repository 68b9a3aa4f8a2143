"""From matrices of any planar element to their meshes, through the whole pipeline."""

import numpy as np
import pytest
from skfem import MeshQuad, MeshTri, MeshTri2

from conforming.assembled import assembled, cell_sets, largest_error, quadrilaterals, same_but_for_diagonals, with_hole
from meshes import SHARED, needs_shared, random_mesh
from unassemble import ConformingMesh, recover


def triangles(n=300, seed=0):
    points, cells = random_mesh(n, seed)
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def check(known, **options):
    found = recover(known.matrix, **options)
    assert found.status == "certified", found.reason
    assert isinstance(found, ConformingMesh)
    assert cell_sets(found) == known.cells
    assert largest_error(found.points, known.points) <= 1e-9
    return found


@pytest.mark.parametrize("c", [1.0, -1e-3, 1e3, -37.0])
@pytest.mark.parametrize("element", ["P2", "P3", "Q1", "Q2", "S2"])
def test_irregular_meshes(element, c):
    mesh = triangles() if element[0] == "P" else with_hole(quadrilaterals(13, 11))
    found = check(assembled(element, mesh, c=c))
    assert found.element == element
    assert found.scale == pytest.approx(c, rel=1e-11)
    assert found.n_holes == (2 if element[0] == "P" else 1)
    assert found.straight


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_random_meshes_and_row_orders(element, seed):
    mesh = triangles(150 + 40 * seed, seed) if element == "P2" else quadrilaterals(3 + seed, 9, seed=seed)
    check(assembled(element, mesh, seed=seed), scale=1.0 if seed % 2 else None)


def test_known_scale_is_kept():
    known = assembled("Q1", quadrilaterals(8, 8), c=4.0)
    assert check(known, scale=4.0).scale == [4.0]
    wrong = recover(known.matrix, scale=4.1)
    assert wrong.status == "uncertified"


@pytest.mark.parametrize("element", ["P2", "P3", "Q1", "Q2", "S2"])
def test_regular_meshes(element):
    axis = np.linspace(0, 1, 6)
    check(assembled(element, (MeshTri if element[0] == "P" else MeshQuad).init_tensor(axis, axis)))


@pytest.mark.parametrize("element", ["P2", "P3"])
def test_vanishing_entries_need_not_be_stored(element):
    check(assembled(element, triangles(), zeros=False))


def test_cubic_right_triangles_show_without_their_zeros():
    check(assembled("P3", MeshTri().refined(3), zeros=False))


def test_cocircular_quadratic_triangles_show_without_their_zeros():
    """The weight between them vanishes; which diagonal it is the triangles tell, and right angles by the numbers."""
    circle = np.exp(1j * np.array([0.1, 1.2, 2.9, 4.4]))
    kite = np.array([-1, np.exp(-0.7j), 1, np.exp(0.7j)])
    right = np.array([-1, np.exp(-0.7j), 1, np.exp(1.9j)])
    for corners in (circle, kite, right):
        apex = 3 * (corners + np.roll(corners, -1)) / 2  # a triangle on each side
        points = np.concatenate([corners, apex])
        cells = np.array([(0, 1, 2), (0, 2, 3), (0, 4, 1), (1, 5, 2), (2, 6, 3), (3, 7, 0)])
        known = assembled("P2", MeshTri(np.stack([points.real, points.imag]), cells.T), zeros=False)
        assert known.matrix.nnz < assembled("P2", MeshTri(np.stack([points.real, points.imag]), cells.T)).matrix.nnz - 8
        check(known)


@pytest.mark.parametrize("shape", [(3, 4), (12, 9)])
def test_rectangles_of_quadratic_triangles_are_ambiguous_without_their_zeros(shape):
    x, y = (np.linspace(0, 1, n) ** 1.2 for n in shape)
    known = assembled("P2", MeshTri.init_tensor(x, y), c=-3.0, zeros=False)
    found = recover(known.matrix)
    assert (found.status, found.uniqueness) == ("ambiguous", "ambiguous")
    assert found.verdict.reasons[0].startswith("another mesh has the matrix as well")
    assert not any(". " in reason for reason in found.verdict.reasons)  # each is one sentence
    assert found.backward_error < 1e-12
    assert largest_error(found.points, known.points) < 1e-12
    (other,) = found.alternatives
    mine, theirs = ({frozenset(cell) for cell in cells} for cells in (other.cells, other.other_cells))
    assert len(mine) == len(theirs) == 2
    assert frozenset().union(*mine) == frozenset().union(*theirs)
    assert mine <= cell_sets(found)
    assert same_but_for_diagonals(cell_sets(found), known.cells)


def test_cells_beside_a_flat_one_keep_the_order_of_their_nodes():
    points, cells = random_mesh(100)
    middle = np.argmin(np.abs(points - points.mean(axis=0)).sum(axis=1))
    a, b = next(np.delete(cell, k)[:2] for cell in cells for k in range(3) if cell[k] == middle)
    points[middle] = (points[a] + points[b]) / 2 + 1e-4 * (points[middle] - points[a])
    check(assembled("P3", MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))))


@pytest.mark.parametrize("order", [3, 9])
def test_reduced_and_full_quadrature_is_told(order):
    found = check(assembled("Q2", quadrilaterals(9, 7), order=order))
    assert found.quadrature == ("2 x 2 Gauss" if order == 3 else "5 x 5 Gauss")


@pytest.mark.parametrize("order", [4, 5])
def test_curved_triangles(order):
    known = assembled("P2", MeshTri2.init_circle(3), order=order)
    found = check(known)
    assert not found.straight
    assert np.abs(np.linalg.norm(found.points - found.points.mean(axis=0), axis=1).max()) > 0


def test_mid_nodes_are_in_the_order_of_meshio():
    known = assembled("P2", triangles())
    found = check(known)
    corner, middle = found.points[found.triangles], found.points[found.mid_nodes]
    assert middle == pytest.approx((corner + np.roll(corner, -1, axis=1)) / 2, abs=1e-12)


def test_cells_run_counter_clockwise():
    found = check(assembled("Q1", with_hole(quadrilaterals(12, 12))))
    z = found.points[found.quads] @ [1, 1j]
    side = np.roll(z, -1, axis=1) - z
    assert (np.imag(np.conj(side) * np.roll(side, -1, axis=1)) > 0).all()
    along = {
        tuple(pair) for pair in np.stack([found.quads, np.roll(found.quads, -1, axis=1)], -1).reshape(-1, 2).tolist()
    }
    assert all(tuple(pair) in along for pair in found.boundary.tolist())


@pytest.mark.parametrize("shape", [(1, 1), (2, 1), (7, 1), (2, 2)])
def test_few_quadrilaterals(shape):
    check(assembled("Q1", quadrilaterals(*shape, shaken=0.1)))


QUADS = sorted((SHARED / "corpus" / "quad").glob("*.npz"))


@needs_shared
@pytest.mark.parametrize("path", QUADS, ids=lambda path: path.stem)
def test_third_party_quadrilaterals(path):
    with np.load(path) as file:
        data = dict(file)
    points = np.ascontiguousarray(data["points"][:, :2].T)
    kinds = {"triangles": MeshTri, "quads": MeshQuad}
    meshes = [
        kind(points, np.ascontiguousarray(data[name].T), validate=False) for name, kind in kinds.items() if name in data
    ]
    check(assembled("mixed", *meshes, c=-3.0))
