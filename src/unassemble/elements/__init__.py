"""Elements: which kinds there are, their nodes and matrices, and which cells a sparsity graph with positions shows.

Nothing here knows what a matrix belongs to: scalar and vector-valued operators use the same kinds, shape functions,
element matrices and candidates.
"""

from .candidates import candidates as candidates
from .cliques import Graph as Graph
from .kinds import KINDS as KINDS
from .ordering import ordered as ordered, ordered_boxes as ordered_boxes
from .reference import (
    assembled as assembled,
    elasticity as elasticity,
    exact_rule as exact_rule,
    mass as mass,
    planar_rules as planar_rules,
    reference_nodes as reference_nodes,
    rules as rules,
    shape_functions as shape_functions,
    shape_gradients as shape_gradients,
    volumes as volumes,
)
from .surface import outer_facets as outer_facets, outer_nodes as outer_nodes
