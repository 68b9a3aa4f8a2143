"""The answer does not depend on the order of the rows, and it is one true sentence: Laplacians of graphs."""

import re

import networkx
import numpy as np
import pytest

from exhaustive import all_meshes
from families import member
from unassemble import RecoveryError, recover

GRAPHS = {
    "grid": networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(4, 4)),
    "oblong grid": networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(3, 5)),
    "path": networkx.path_graph(20),
    "star": networkx.star_graph(5),
    "large star": networkx.star_graph(10),
    "tree": networkx.random_labeled_tree(12, seed=1),
    "binary tree": networkx.balanced_tree(2, 3),
    "pentagon": networkx.cycle_graph(5),
    "cycle": networkx.cycle_graph(8),
    "large cycle": networkx.cycle_graph(30),
    "wheel": networkx.wheel_graph(8),
    "triangle and a path": networkx.lollipop_graph(3, 5),
    "cube": networkx.cubical_graph(),
    "complete graph": networkx.complete_graph(4),
    "edge": networkx.path_graph(2),
}


def laplacian(graph, seed):
    n = len(graph)
    row = np.random.default_rng(seed).permutation(n)
    return networkx.laplacian_matrix(graph, nodelist=range(n)).toarray().astype(float)[np.ix_(row, row)]


def answer(matrix):
    """Status and reason, or kind and message of the error, without the numbers and the cells of another mesh."""
    try:
        found = recover(matrix)
    except RecoveryError as error:
        return type(error).__name__, str(error)
    reason = re.sub(r"the cells .*", "", found.reason)
    status = "certified" if found.certified else "uncertified"  # ambiguous where the other mesh is found
    return status, re.sub(r"\d+(\.\d+)?(e[-+]\d+)?", "#", reason)


@pytest.mark.parametrize("name", GRAPHS)
def test_laplacians_of_graphs(name):
    (certified,) = {answer(laplacian(GRAPHS[name], seed))[0] == "certified" for seed in range(3)}
    assert not certified or name == "wheel"


def test_a_graph_that_happens_to_be_a_mesh():
    """Squares of one colour of a board of nine that leaves out its corners, and halves of squares there; with c
    unknown there are more, and nothing but a graph to go by."""
    found = recover(laplacian(GRAPHS["grid"], 0), scale=2.0)
    assert found.backward_error < 1e-12
    assert found.n_polygons == len(found.triangles) == 4
    assert not found.certified  # squares that touch might be halved
    with pytest.raises(RecoveryError, match="the Laplacian of a graph without weights"):
        recover(laplacian(GRAPHS["grid"], 0))


def test_what_is_said_of_graphs_that_are_no_mesh():
    with pytest.raises(RecoveryError, match="none has its entries: they may belong to no mesh, as those of a network"):
        recover(laplacian(GRAPHS["cube"], 0))
    with pytest.raises(RecoveryError, match="none has its entries"):
        recover(laplacian(GRAPHS["edge"], 0))


@pytest.mark.parametrize("order", range(4))
def test_kites_that_hang_on_vertices_in_other_orders(order):
    """Four with one c: that is all that speaks for it, and there is a mesh in one piece with another."""
    known, _ = member("kites", 3008, order)
    assert answer(known.matrix)[0] != "certified"


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("graph", [networkx.lollipop_graph(3, 4), networkx.path_graph(6)], ids=str)
def test_pieces_that_may_be_one_are_not_certified(graph, seed):
    """Equal entries make equal factors c in pieces; yet the whole has readings in one piece."""
    assert all_meshes(len(graph), dict.fromkeys(map(tuple, graph.edges), 1.0))
    assert answer(laplacian(graph, seed))[0] != "certified"
