from __future__ import annotations

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

import unassemble
from meshes import SHARED, edge_list, needs_shared, random_mesh, specimen
from unassemble import recover
from unassemble.inspection import inspect_matrix
from unassemble.matrix import check_matrix
from vanishing import forgotten, half_jittered, holes, polar, squares, triangular_holes


@pytest.mark.parametrize("c", [1.0, -2.5e4])
@pytest.mark.parametrize("diagonal", [False, True])
def test_facts_of_a_mesh(c, diagonal):
    true = specimen(*random_mesh(300, seed=1), c=c, diagonal=diagonal)
    facts = inspect_matrix(true.matrix)
    n, m = len(true.points), len(true.triangles)
    edges = edge_list(true.triangles)
    assert (facts.n_rows, facts.n_edges, facts.n_triangles) == (n, len(edges), m)
    assert (facts.n_holes, facts.n_pieces, facts.n_connected) == (2, 1, 1)
    assert facts.n_triangles + 1 + facts.n_holes - facts.n_edges + facts.n_rows == 2  # Euler
    assert facts.n_boundary_edges == 2 * len(edges) - 3 * m
    assert facts.n_zero_sums == (0 if diagonal else n)
    assert facts.planar
    assert not facts.mixed_signs
    assert facts.operator == "laplacian, linear triangles" + (", plus a diagonal" if diagonal else "")
    assert facts.recoverable.startswith(f"{m:,} triangles on {n:,} points, up to position")


def test_a_checked_matrix_and_the_public_name():
    true = specimen(*random_mesh(100, seed=2))
    assert unassemble.inspect_matrix is inspect_matrix
    assert str(inspect_matrix(check_matrix(true.matrix))) == str(inspect_matrix(true.matrix))


def test_nonplanar_graphs():
    facts = inspect_matrix(np.full((5, 5), -1.0))
    assert not facts.planar
    assert "K5" not in str(facts)
    assert facts.n_triangles == 0
    assert facts.recoverable.startswith("nothing")


def test_planar_graphs_without_cells():
    facts = inspect_matrix(sp.diags_array([[1.0], [1.0]], offsets=[-1, 1]))
    assert facts.planar
    assert facts.cells_from == ""
    assert facts.recoverable.startswith("nothing: ")
    assert facts.operator == "none that is known"


GRIDS = {
    "five-point stencil": (squares(holes(7, 5)), 0, 35, 0, 0),
    "L-shape": (squares(holes(10, 10, (5, 5, 5, 5))), 0, 75, 0, 0),
    "annulus": (polar(4, 12, 0.5), 0, 48, 0, 1),
    "crossed squares": (squares(holes(9, 9), crossed=True), 36, 144, 36, 0),
    "triangles and squares": (half_jittered(10), 100, 50, 0, 0),
}


@pytest.mark.parametrize("name", GRIDS)
def test_cells_that_the_graph_does_not_show(name):
    """What is likely before anything is solved is what recovery finds here."""
    mesh, n_triangles, n_polygons, n_vanished_sides, n_holes = GRIDS[name]
    known = forgotten(specimen(*mesh, c=2.0, diagonal=True))
    facts, found = inspect_matrix(known.matrix), recover(known.matrix)
    assert not facts.obstacle
    assert facts.cells_from == "entries"
    assert (facts.n_triangles, facts.n_polygons) == (n_triangles, n_polygons)
    assert (len(found.triangles), found.n_polygons) == (n_triangles, n_polygons)
    assert (facts.n_vanished_sides, facts.n_holes, facts.n_pieces) == (n_vanished_sides, n_holes, 1)
    assert facts.n_boundary_edges == len(found.boundary)
    n_edges = facts.n_edges + facts.n_vanished_sides
    assert n_triangles + n_polygons + 1 + n_holes - n_edges + facts.n_rows == 2  # Euler
    assert (facts.n_bare_edges, facts.n_undetermined) == (0, 0)
    assert facts.recoverable.startswith("likely ")
    assert f"{n_polygons:,} cells of more than three vertices" in str(facts)
    assert "read from the entries" in str(facts)


@pytest.mark.parametrize("graph", [networkx.path_graph(6), networkx.random_labeled_tree(12, seed=1)])
def test_paths_and_trees_are_right_triangles(graph):
    facts = inspect_matrix(-networkx.to_scipy_sparse_array(graph).astype(float))
    assert facts.planar
    assert not facts.obstacle
    assert facts.n_triangles == facts.n_vanished_sides >= 3
    assert facts.cells_from == "entries"


def test_holes_of_three_edges_are_left_to_recovery():
    known = specimen(*triangular_holes(100, 3))
    facts = inspect_matrix(known.matrix)
    assert facts.cells_from == "graph"
    assert facts.n_triangles == len(known.triangles) + 3
    assert "leaves some open if it has to" in str(facts)
    assert recover(known.matrix).n_holes == 3


def test_components_are_read_by_themselves():
    """A triangle by itself keeps its cell; the other component is a square, the third an edge."""
    A = np.zeros((9, 9))
    for i, j in [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (5, 6), (3, 6), (7, 8)]:
        A[i, j] = A[j, i] = -0.5
    facts = inspect_matrix(A)
    assert (facts.n_triangles, facts.n_polygons, facts.n_pieces) == (1, 1, 2)
    assert (facts.n_bare_edges, facts.n_undetermined) == (1, 2)


def test_signs_that_no_laplacian_has():
    A = -np.array([[0, 1.0, 1.0], [1.0, 0, -3.0], [1.0, -3.0, 0]])
    facts = inspect_matrix(A)
    assert facts.mixed_signs == (0,)
    assert "look at row 0" in facts.recoverable
    assert "not a Laplacian" in facts.operator


def test_pieces_hinges_loose_rows_and_bare_edges():
    triangle = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]]) / 2
    A = np.zeros((11, 11))
    for rows in ([0, 1, 2], [2, 3, 4], [5, 6, 7]):  # the first two share row 2
        A[np.ix_(rows, rows)] += triangle
    A[8, 9] = A[9, 8] = -1  # an edge of no triangle; row 10 stands alone
    A[10, 10] = 1
    facts = inspect_matrix(A)
    assert (facts.n_pieces, facts.n_hinges, facts.n_connected, facts.n_isolated) == (3, 1, 3, 1)
    assert (facts.n_bare_edges, facts.n_undetermined) == (1, 3)
    text = str(facts)
    for part in (
        "3 connected pieces, and 1 isolated row",
        "3, joined by 1 hinge",
        "1 edge of no cell",
        "3 rows of no cell",
    ):
        assert part in text
    assert "zero in 8 of 10 rows only" in text
    assert facts.recoverable.startswith("3 triangles on 8 points")
    assert "each of the 3 pieces by itself" in facts.recoverable


def test_square_with_a_vanished_diagonal():
    square = specimen(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
    facts = inspect_matrix(square.matrix)
    assert facts.n_vanished == 1
    assert "1 of these is zero" in str(facts)


@needs_shared
def test_a_third_party_mesh_in_several_pieces():
    with np.load(SHARED / "corpus/planar/pyamg_logo.npz") as mesh:
        true = specimen(mesh["points"][:, :2], mesh["triangles"].astype(np.int64))
    facts = inspect_matrix(true.matrix)
    assert (facts.n_pieces, facts.n_holes, facts.n_vanished) == (5, 2, 1)
