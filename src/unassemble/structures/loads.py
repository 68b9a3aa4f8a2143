"""Whether positions would still be told if every node bore a load of its own.

A structure in equilibrium under loads f that keep their direction has a tangent stiffness that is not indifferent to
rigid rotations: a rotation w turns the internal forces with it and leaves the loads behind, so that node i needs the
force w x f_i, whatever its elements are and however axial forces or membrane stresses run through them. The same holds
of springs between nodes, of any stiffness, that act on displacements alone: their f_i is the sum of the pulls that they
would have between the nodes if they were of length zero without load. (E.g. Argyris, Comput. Methods Appl. Mech. Engrg.
32, 1982, 85-155, section 4, has the skew part of the stiffness of a node under load.)

So with G[a, w] the force of a node along axis a under a unit rotation about axis w, loads add an unknown skew matrix to
G: forces along the axis of rotation, and the sums G[a, w] + G[w, a], are all that says where the nodes are whether
there are loads or not. Where the equations of moments hold too they contradict loads. Forces alone do not: regular
lattices under loads satisfy them exactly, in a wrong size.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError
from ..nodes.shape import set_aside
from ..tolerances import SINGULAR, SMALL
from .equations import Equations, joined
from .layouts import Layout
from .least_squares import least_squares
from .placed import PlacedNodes, pieces


def without_loads(given: Equations, layout: Layout) -> Equations:
    """Of equations for coordinates those, or sums of two, that loads at nodes do not enter.

    Equations of moments, of differences of two rows, and of members are as they are.
    """
    b, moves = layout.block_size, len(layout.displacements)
    own = given.row >= 0
    force = own & (given.row % b < moves)
    axis = np.full(len(given.row), -1)
    axis[force] = np.asarray(layout.displacements)[given.row[force] % b]
    about = np.full(len(given.row), -1)
    about[own] = np.asarray(layout.turning)[given.rotation[own]]
    parts = [given[~force | (axis == about)]]
    for first, second in combinations(range(3), 2):
        one = np.flatnonzero((axis == first) & (about == second))
        other = np.flatnonzero((axis == second) & (about == first))
        _, i, j = np.intersect1d(given.row[one] // b, given.row[other] // b, return_indices=True)
        parts.append(_added(given[one[i]], given[other[j]]))
    return joined(*parts)


def _added(one: Equations, other: Equations) -> Equations:
    """Sums of equations as they were before they were divided by their sizes; relative to the larger of these."""
    size = np.maximum(one.size, other.size)
    left, right = one.size / size, other.size / size
    operator = sp.csr_array(sp.diags_array(left) @ one.operator + sp.diags_array(right) @ other.operator)
    unknown = np.full(len(size), -1)
    return Equations(
        operator,
        left * one.right + right * other.right,
        size,
        left * one.lever + right * other.lever,
        unknown,
        unknown,
        left * one.mixed + right * other.mixed,
    )


def told_under_loads(
    given: Equations, layout: Layout, found: PlacedNodes, edges: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) nodes whose positions, as found, these equations determine even if every node bears a load."""
    d, told = layout.dim, np.zeros(len(found.points), dtype=bool)
    left = without_loads(given, layout)
    common = d + (not layout.rotations)
    for piece in pieces(left.operator, d, edges):
        if len(piece.nodes) < 2:
            continue
        try:
            _, _, fields, values, _ = least_squares(piece.operator, np.zeros(len(piece.rows)), d)
        except GeometryError:
            continue
        of_piece = found.component[piece.nodes]
        gap = min((found.evidence[k].gap for k in np.unique(of_piece[of_piece >= 0])), default=np.inf)
        free = fields[..., values <= max(SINGULAR, SMALL * gap)]
        loose = np.zeros(len(piece.nodes), dtype=bool)
        if free.shape[2] > common:
            free, loose = set_aside(free, common)
        if free.shape[2] <= common:
            told[piece.nodes[~loose]] = True
    return told
