"""Chordless cycles against networkx."""

import networkx
import numpy as np
import pytest

from unassemble.topology import chordless_four_cycles

GRAPHS = {
    "grid": networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(4, 5)),
    "wheel": networkx.wheel_graph(6),
    "sparse": networkx.gnm_random_graph(40, 55, seed=2),
}


def cycles_of(cycles):
    """Each as its set of sides."""
    return sorted(sorted(tuple(sorted(side)) for side in zip(c, np.roll(c, -1).tolist(), strict=True)) for c in cycles)


@pytest.mark.parametrize("name", GRAPHS)
def test_four_cycles(name):
    """Where few share two opposite vertices all are found."""
    graph = GRAPHS[name]
    edges = np.array(sorted(tuple(sorted(edge)) for edge in graph.edges), dtype=np.int64).reshape(-1, 2)
    expected = [c for c in networkx.chordless_cycles(graph, length_bound=4) if len(c) == 4]
    found = chordless_four_cycles(len(graph), edges, np.ones(len(edges), bool))
    assert cycles_of(found.tolist()) == cycles_of(expected)


def test_only_usable_edges():
    graph = networkx.cycle_graph(4)
    edges = np.array(sorted(tuple(sorted(edge)) for edge in graph.edges))
    assert len(chordless_four_cycles(4, edges, np.ones(4, bool))) == 1
    assert len(chordless_four_cycles(4, edges, np.arange(4) > 0)) == 0
