"""Wrong entries are named at once: no choice of cells is sought that would explain them."""

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import largest_error, random_mesh, specimen
from unassemble import recover
from unassemble.cells import search, triangles_only
from unassemble.planar.conformal import conformal_map
from unassemble.planar.robust import robust_fit
from unassemble.topology import recognise
from vanishing import forgotten, half_jittered, holes, refined, squares, triangular_holes

MESHES = {
    "triangles": random_mesh(300, seed=4),
    "five-point stencil": squares(holes(12, 9)),
    "crossed squares with holes": squares(holes(9, 8, (3, 3, 1, 1), (5, 4, 2, 2)), crossed=True),
    "adaptive": refined(4, 1),
    "triangles and squares": half_jittered(10),
}


def changed(matrix, factors):
    """The matrix with some entries above the diagonal, and those below, multiplied; and their rows and columns."""
    upper = sp.triu(matrix, 1).tocoo()
    value = upper.data.copy()
    value[list(factors)] *= list(factors.values())
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    pairs = sorted([int(upper.row[k]), int(upper.col[k])] for k in factors)
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape), pairs


@pytest.fixture
def no_repairs(monkeypatch):
    """What takes long is not begun."""

    def refused(*_):
        raise AssertionError("labels are being tried")

    for module, name in ((search, "_repaired"), (search, "mended"), (triangles_only, "mended")):
        monkeypatch.setattr(module, name, refused)


@pytest.mark.usefixtures("no_repairs")
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


@pytest.mark.usefixtures("no_repairs")
@pytest.mark.parametrize("options", [{"scale": 1.0}, {"refine": False}, {"noise": 1e-7}], ids=str)
def test_options(options):
    known = specimen(*random_mesh(300, seed=4))
    matrix, pairs = changed(known.matrix, {200: 2.0})
    found = recover(matrix, **options)
    assert found.status == "uncertified"
    assert found.suspects.tolist() == pairs


@pytest.mark.usefixtures("no_repairs")
def test_several_wrong_entries():
    known = specimen(*random_mesh(300, seed=4))
    matrix, pairs = changed(known.matrix, {50: 2.0, 200: 0.5, 400: -1.0, 650: 3.0})
    found = recover(matrix)
    assert sorted(found.suspects.tolist()) == pairs
    assert largest_error(found.points, known.points) < 1e-10


def test_sides_of_a_hole_are_no_wrong_entries():
    """They are what does not fit if the hole is taken for a cell."""
    known = specimen(*triangular_holes(200, 1))
    upper = sp.triu(known.matrix, 1).tocoo()
    order = np.lexsort((upper.col, upper.row))
    edges = np.column_stack([upper.row, upper.col])[order].astype(np.int64)
    (piece,) = recognise(len(known.points), edges).pieces
    weights = -upper.data[order][piece.edge_rows]
    start = conformal_map(piece, weights).z
    fit = robust_fit(piece, weights, start, lambda misfit: bool((misfit < 1e-6).all()))
    assert len(fit.aside) == 3
    assert np.isin(piece.opposite, fit.aside).all(axis=1).sum() == 1
    assert recover(known.matrix).certified
