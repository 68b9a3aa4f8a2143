"""Wrong entries are named at once: no choice of cells is sought that would explain them."""

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import largest_error, random_mesh, specimen
from unassemble import recover
from unassemble.cells import in_doubt
from unassemble.matrix import check_matrix
from unassemble.planar.conformal import conformal_map
from unassemble.planar.piece import PieceMesh
from unassemble.planar.robust import robust_fit
from unassemble.scalar.wrong_entries import wrong_entries
from unassemble.topology import surfaces
from vanishing import forgotten, holes, squares, triangular_holes

MESHES = {
    "triangles": random_mesh(300, seed=4),
}


def changed(matrix, factors):
    """The matrix with some entries above the diagonal, and those below, multiplied; and their rows and columns."""
    upper = sp.triu(matrix, 1).tocoo()
    value = upper.data.copy()
    value[list(factors)] *= list(factors.values())
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    pairs = sorted([int(upper.row[k]), int(upper.col[k])] for k in factors)
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape), pairs


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("name", MESHES)
def test_one_wrong_entry_is_named_and_the_mesh_is_right(name, factor):
    known = forgotten(specimen(*MESHES[name], c=-2.5))
    matrix, pairs = changed(known.matrix, {100: factor})
    found = recover(matrix)
    assert found.status == "uncertified"
    assert found.suspects.tolist() == pairs
    assert f"entry of rows {pairs[0][0]} and {pairs[0][1]} stands out" in found.reason
    assert largest_error(found.points, known.points) < 1e-10


@pytest.mark.parametrize("options", [{"scale": 1.0}, {"refine": False}, {"noise": 1e-7}], ids=str)
def test_options(options):
    known = specimen(*random_mesh(300, seed=4))
    matrix, pairs = changed(known.matrix, {200: 2.0})
    found = recover(matrix, **options)
    assert found.status == "uncertified"
    assert found.suspects.tolist() == pairs


def test_several_wrong_entries():
    known = specimen(*random_mesh(300, seed=4))
    matrix, pairs = changed(known.matrix, {50: 2.0, 200: 0.5, 400: -1.0, 650: 3.0})
    found = recover(matrix)
    assert sorted(found.suspects.tolist()) == pairs
    assert largest_error(found.points, known.points) < 1e-10


def bow(seed):
    """Two random meshes that meet in one vertex, with a right angle between them there."""
    points, triangles = random_mesh(60, seed)
    z, n = points @ [1, 1j], len(points)
    h = int(np.argmax(z.real))
    z = z - z[h]
    edges, count = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0,
                             return_counts=True)  # fmt: skip
    rim = edges[(count == 1) & (edges == h).any(axis=1)]
    near = rim[rim != h]
    a, b = near[np.argmax(z[near].imag)], near[np.argmin(z[near].imag)]
    other = 0.8 * z * (z[a] / abs(z[a])) * -1j / (z[b] / abs(z[b]))
    number = np.r_[n + np.arange(h), h, n + np.arange(h, n - 1)]
    z = np.append(z, np.delete(other, h))
    return np.column_stack([z.real, z.imag]), np.vstack([triangles, number[triangles], [a, h, number[b]]])


@pytest.mark.parametrize("seed", [3, 5])
def test_a_cell_between_two_pieces_is_no_wrong_entry_in_each(seed):
    """Without it one edge of each does not fit; they share a vertex."""
    known = forgotten(specimen(*bow(seed), seed=seed))
    matrix = check_matrix(known.matrix)
    topology = surfaces(matrix.n, matrix.edges)

    def attempt(piece):
        found = conformal_map(piece, -matrix.entries[piece.edge_rows])
        return PieceMesh(found.z, found.scale)

    assert len(topology.pieces) == 2
    doubtful = in_doubt(matrix, topology, attempt)
    assert doubtful.all()
    found, doubtful = wrong_entries(matrix, topology, attempt, doubtful, None)
    assert not found
    assert doubtful.all()


def test_sides_of_a_hole_are_no_wrong_entries():
    """They are what does not fit if the hole is taken for a cell."""
    known = specimen(*triangular_holes(200, 1))
    upper = sp.triu(known.matrix, 1).tocoo()
    order = np.lexsort((upper.col, upper.row))
    edges = np.column_stack([upper.row, upper.col])[order].astype(np.int64)
    (piece,) = surfaces(len(known.points), edges).pieces
    weights = -upper.data[order][piece.edge_rows]
    start = conformal_map(piece, weights).z
    fit = robust_fit(piece, weights, start, lambda misfit: bool((misfit < 1e-6).all()))
    assert len(fit.aside) == 3
    assert np.isin(piece.opposite, fit.aside).all(axis=1).sum() == 1
    assert recover(known.matrix).certified


def test_entries_are_not_blamed_where_others_do_not_fit_either():
    """Eight entries about the middle of squares: whatever few are left out, the others do not fit."""
    known = forgotten(specimen(*squares(holes(6, 5))))
    upper = sp.triu(known.matrix, 1).tocoo()
    centre = (known.points[upper.row] + known.points[upper.col]) / 2
    near = np.argsort(np.linalg.norm(centre - known.points.mean(axis=0), axis=1))[:8]
    factors = np.random.default_rng(0).uniform(1.2, 1.6, len(near))
    matrix, _ = changed(known.matrix, dict(zip(near.tolist(), factors.tolist(), strict=True)))
    found = recover(matrix)
    assert found.status == "uncertified"
    assert not len(found.suspects)
    assert found.reason.startswith("no set of cells was found that fits: ")
    rows = found.reason.split("misfit in ")[1].split(".")[0].removeprefix("the rows ").removeprefix("row ")
    assert {int(row) for row in rows.split(", ")} & set(found.worst_entries[0][:2])
