"""Many wrong cells, many pieces, a known scale, and matrices of no mesh."""

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

from families import FAMILIES, HOPELESS, member
from meshes import largest_error, largest_error_of_pieces, random_mesh, specimen, triangle_set
from unassemble import RecoveryError, recover
from unassemble.cells import search
from unassemble.cells.covers.program import Program
from unassemble.cells.reading import Reading
from unassemble.cells.small import small_maps
from unassemble.planar.conformal import conformal_map
from unassemble.topology import recognise
from vanishing import forgotten, holes, squares


def _member(family, seed, c):
    return forgotten(specimen(*FAMILIES[family](np.random.default_rng(seed)), c=c, seed=seed))


# Labels have to be relaxed; in the second the pieces close rings, two being mirrored at once.
@pytest.mark.parametrize(("family", "seed"), [("pierced", 11), ("lattice", 24)])
def test_one_triangle_in_eight_is_missing(family, seed):
    known, c = member(family, seed)
    found = recover(known.matrix)
    assert found.status == "certified", found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert found.scale == pytest.approx(c, rel=1e-9)


def test_pieces_that_share_vertices_have_one_factor():
    """Right triangles in a few small pieces: other cells fit as well where each piece may have a c of its own."""
    known, c = member("lattice", 29)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert found.scale == pytest.approx(c, rel=1e-9)
    given = {frozenset(triangle) for triangle in known.triangles.tolist()}
    whole = recover(known.matrix, triangulate=True)
    assert len(whole.triangles) == len(given)
    assert {frozenset(triangle) for triangle in found.triangles.tolist()} <= given  # the others lie in polygons


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("family", ["ring", "polygon", "scattered", "adaptive"])
def test_easy_families(family, seed):
    known = _member(family, seed, -2.5)
    found = recover(known.matrix)
    assert found.status == "certified", found.reason
    assert largest_error_of_pieces(found, known.points) <= 1e-9


@pytest.fixture
def readings(monkeypatch):
    """A list that grows by one with each reading that is solved."""
    solved = []
    original = Reading.of.__func__

    def counted(cls, *arguments):
        solved.append(None)
        return original(cls, *arguments)

    monkeypatch.setattr(Reading, "of", classmethod(counted))
    return solved


@pytest.mark.parametrize("side", [1, 2])
def test_many_holes_of_a_grid_are_told_at_once(side, readings):
    """Angle sums of squares beside holes are 1.2 pi at most, of holes of one square 1.4 pi, all alike."""
    rectangles = [(i, j, side, side) for i in range(2, 38, 5) for j in range(2, 38, 5)]
    found = recover(forgotten(specimen(*squares(holes(40, 40, *rectangles)), c=-3.7)).matrix)
    assert found.certified, found.reason
    assert found.n_polygons == 1600 - len(rectangles) * side**2
    assert len(readings) == 1


@pytest.mark.parametrize(("name", "n"), [("tree", 200), ("dodecahedron", 20), ("random_grid", 60)])
def test_hopeless_matrices_are_given_up_soon(name, n, readings):
    """Counted in readings, since times depend on the machine."""
    try:
        status = recover(HOPELESS[name](n, 0)).status
    except RecoveryError:
        status = "refused"
    assert status in ("ambiguous", "uncertified", "refused")
    assert 0 < len(readings) <= 500


def test_known_scale_is_part_of_the_search():
    known = forgotten(specimen(*squares(holes(6, 5, (2, 2, 1, 1))), c=0.3))
    assert recover(known.matrix, scale=0.3).status == "certified"
    try:
        status = recover(known.matrix, scale=0.6).status
    except RecoveryError:
        status = "refused"
    assert status != "certified"


def test_small_pieces_have_the_same_conformal_map():
    known = specimen(*random_mesh(36, holes=False), c=-7.0)
    upper = forgotten(known).matrix.tocoo()
    above = upper.row < upper.col
    order = np.lexsort((upper.col[above], upper.row[above]))
    edges = np.column_stack([upper.row[above], upper.col[above]])[order].astype(np.int64)
    weights = -upper.data[above][order]
    (piece,) = recognise(known.matrix.shape[0], edges).pieces
    (small,) = small_maps(piece, weights[piece.edge_rows], 1)
    sparse = conformal_map(piece, weights[piece.edge_rows])
    assert small.scale == pytest.approx(-7.0, rel=1e-12)
    assert sparse.scale == pytest.approx(-7.0, rel=1e-12)
    points = small.z.view(np.float64).reshape(-1, 2)
    assert largest_error(points, known.points[piece.vertices]) <= 1e-9
    assert not small_maps(piece, np.zeros(len(piece.edges)), 1)


@pytest.mark.parametrize("shape", [(14, 17), (20, 21)])
def test_grids_of_equal_entries_are_given_up_soon(monkeypatch, shape):
    """The Laplacian of a grid graph: a misfit would lead nowhere, and programs for covers would take minutes."""

    def refused(*_):
        raise AssertionError("labels or covers are being tried")

    monkeypatch.setattr(search, "mended", refused)
    monkeypatch.setattr(Program, "solution", refused)
    graph = networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(*shape))
    order = np.random.default_rng(0).permutation(len(graph))
    matrix = sp.csr_array(networkx.laplacian_matrix(graph), dtype=float)[order][:, order]
    with pytest.raises(RecoveryError, match="network"):
        recover(matrix)
