"""Blocks, told by networkx as well."""

import networkx
import numpy as np
import pytest

from unassemble.topology.blocks import blocks


@pytest.mark.parametrize("seed", range(40))
def test_blocks(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 40))
    graph = networkx.gnm_random_graph(n, int(rng.integers(n - 1, 1.6 * n + 1)), seed=seed)
    graph = networkx.Graph(graph.subgraph(max(networkx.connected_components(graph), key=len)))
    graph = networkx.convert_node_labels_to_integers(graph)
    edges = np.array(sorted(tuple(sorted(edge)) for edge in graph.edges), dtype=np.int64).reshape(-1, 2)
    label = blocks(len(graph), edges)
    found = {frozenset(map(tuple, edges[label == one].tolist())) for one in set(label.tolist())}
    known = networkx.biconnected_component_edges(graph)
    assert found == {frozenset(tuple(sorted(edge)) for edge in block) for block in known}
