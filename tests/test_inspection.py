from __future__ import annotations

import json

import numpy as np
import pytest
import scipy.sparse as sp

import unassemble
from meshes import SHARED, edge_list, needs_shared, random_mesh, specimen
from unassemble.inspection import inspect_matrix
from unassemble.matrix import check_matrix


@pytest.mark.parametrize("c", [1.0, -2.5e4])
@pytest.mark.parametrize("diagonal", [False, True])
def test_facts_of_a_mesh(c, diagonal):
    true = specimen(*random_mesh(300, seed=1), c=c, diagonal=diagonal)
    facts = inspect_matrix(true.matrix)
    n, m = len(true.points), len(true.triangles)
    edges = edge_list(true.triangles)
    assert (facts.n_rows, facts.n_edges, facts.n_triangles) == (n, len(edges), m)
    assert (facts.n_holes, facts.n_pieces, facts.n_connected) == (2, 1, 1)
    assert facts.n_faces - facts.n_edges + facts.n_rows == 2  # Euler
    assert facts.n_boundary_edges == 2 * len(edges) - 3 * m
    assert facts.n_zero_sums == (0 if diagonal else n)
    assert facts.planar
    assert not facts.witness
    assert not facts.mixed_signs
    assert 0.8 < facts.scale[0] / c < 1.25
    assert facts.operator == "laplacian, linear triangles" + (", plus a diagonal" if diagonal else "")
    assert facts.recoverable.startswith(f"{m:,} triangles on {n:,} points, up to position")


def test_a_checked_matrix_and_the_public_name():
    true = specimen(*random_mesh(100, seed=2))
    assert unassemble.inspect_matrix is inspect_matrix
    assert str(inspect_matrix(check_matrix(true.matrix))) == str(inspect_matrix(true.matrix))


def test_nonplanar_graphs_have_a_witness():
    facts = inspect_matrix(np.full((5, 5), -1.0))
    assert not facts.planar
    assert sorted(facts.witness) == [(i, j) for i in range(5) for j in range(i + 1, 5)]
    assert "subdivision of K5 or K3,3" in str(facts)
    assert facts.n_triangles == 0
    assert facts.recoverable.startswith("nothing")


def test_planar_graphs_without_triangles():
    facts = inspect_matrix(sp.diags_array([[1.0] * 4, [1.0] * 4], offsets=[-1, 1]))
    assert facts.planar
    assert "no triangle" in facts.recoverable
    assert facts.operator == "none that this version knows"


def test_signs_that_no_laplacian_has():
    A = -np.array([[0, 1.0, 1.0], [1.0, 0, -3.0], [1.0, -3.0, 0]])
    facts = inspect_matrix(A)
    assert facts.mixed_signs == (0,)
    assert "look at row 0" in facts.recoverable
    assert "not a Laplacian" in facts.operator
    assert "other sign in row 0" in str(facts)


def test_entries_that_add_up_to_zero_give_no_estimate():
    A = np.array([[0, 1.0, 1.0], [1.0, 0, -2.0], [1.0, -2.0, 0]])
    facts = inspect_matrix(A)
    assert np.isnan(facts.scale).all()
    assert "cannot be estimated" in str(facts)
    assert json.loads(json.dumps(facts.to_dict(), allow_nan=False))["scale"] == [None]


def test_pieces_hinges_loose_rows_and_bare_edges():
    triangle = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]]) / 2
    A = np.zeros((10, 10))
    for rows in ([0, 1, 2], [2, 3, 4], [5, 6, 7]):  # the first two share row 2
        A[np.ix_(rows, rows)] += triangle
    A[7, 8] = A[8, 7] = -1  # an edge of no triangle; row 9 stands alone
    A[9, 9] = 1
    facts = inspect_matrix(A)
    assert (facts.n_pieces, facts.n_hinges, facts.n_connected, facts.n_isolated) == (3, 1, 2, 1)
    assert (facts.n_bare_edges, facts.n_undetermined) == (1, 2)
    text = str(facts)
    for part in (
        "2 connected pieces, and 1 isolated row",
        "3, joined by 1 hinge",
        "1 edge of no triangle",
        "2 rows of",
    ):
        assert part in text
    assert "zero in 7 of 9 rows only" in text
    assert facts.recoverable.startswith("3 triangles on 8 points")
    assert "each of the 3 pieces by itself" in facts.recoverable


def test_square_with_a_vanished_diagonal():
    square = specimen(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
    facts = inspect_matrix(square.matrix)
    assert facts.n_vanished == 1
    assert "1 of these are zero" in str(facts)


@needs_shared
def test_a_third_party_mesh_in_several_pieces():
    with np.load(SHARED / "corpus/planar/pyamg_logo.npz") as mesh:
        true = specimen(mesh["points"][:, :2], mesh["triangles"].astype(np.int64))
    facts = inspect_matrix(true.matrix)
    assert (facts.n_pieces, facts.n_holes, facts.n_vanished) == (5, 2, 1)
