"""Elements: which kinds there are, their nodes and matrices, and which cells a sparsity graph with positions shows.

Nothing here knows what a matrix belongs to: scalar and vector-valued operators use the same kinds, shape functions,
element matrices and candidates.
"""

from .candidates import candidates
from .cliques import Graph
from .kinds import KINDS
from .ordering import ordered, ordered_boxes
from .reference import (
    assembled,
    elasticity,
    exact_rule,
    mass,
    planar_rules,
    reference_nodes,
    rules,
    shape_functions,
    shape_gradients,
    volumes,
)
from .surface import outer_facets, outer_nodes

__all__ = [
    "KINDS",
    "Graph",
    "assembled",
    "candidates",
    "elasticity",
    "exact_rule",
    "mass",
    "ordered",
    "ordered_boxes",
    "outer_facets",
    "outer_nodes",
    "planar_rules",
    "reference_nodes",
    "rules",
    "shape_functions",
    "shape_gradients",
    "volumes",
]
