"""Whether a certificate is wrong, by the truth about its mesh.

An answer is judged by what it claims: points of `node_status` 0, piece by piece, up to what the matrix leaves free, and
cells between such points. Nothing is claimed of the others, and nothing by an answer that is not certified.
"""

from __future__ import annotations

import re
from itertools import permutations

import numpy as np
import scipy.sparse as sp
from hostile import gives_back, lengths_give_back, masses
from numpy.typing import NDArray

from unassemble import Body, PlanarMesh, Recovery, Structure, Surface, recover

from .truth import Truth  # it names the folders of the tests

from assembled import ELEMENTS, stiffness  # isort: skip

CLOSE = 1e-6  # of points, relative to the diameter of their piece, where the answer has no error bar
SAME = 1e-11  # of entries, relative to their rows: as near as another assembler comes to the very entries
SIZELESS = ("truss", "elasticity", "structure")  # matrices of displacements alone tell no size
#: What a warning says that names another model with the very entries; that a sign is free does not.
NAMES = re.compile("the same entries|may fit as well|has exactly these entries")


def outcome_of(truth: Truth, found: Recovery) -> tuple[str, str]:
    """``right``, ``alias``, ``ambiguous``, ``uncertified`` or ``WRONG``, and what is wrong.

    An alias is another mesh with the very entries, of which a warning speaks and that is not said to be proved. Where
    the entries were changed such a mesh is right: they are its own then.
    """
    if found.status != "certified":
        return ("ambiguous" if found.status == "ambiguous" else "uncertified"), ""
    wrong = fault_of(truth, found)
    if not wrong:
        return "right", ""
    if not has_the_entries(truth.matrix, found):
        return "WRONG", wrong
    if not truth.intact:
        return "right", ""
    if found.uniqueness == "proved":
        return "WRONG", f"{wrong}; another mesh has the same entries, and this one is said to be proved"
    if not any(NAMES.search(warning) for warning in found.warnings):
        return "WRONG", f"{wrong}; another mesh has the same entries, and no warning says so"
    return "alias", wrong


def fault_of(truth: Truth, found: Recovery) -> str:
    """What an answer claims and is not so, in a few words; empty where all of it is true."""
    node = np.arange(found.n_points) if found.node_of_row is None else found.node_of_row
    placed = np.ones(len(node), dtype=bool) if found.direction_of_row is None else found.direction_of_row >= 0
    true_node = np.full(found.n_points, -1)
    true_node[node] = truth.node
    true_node[node[placed]] = truth.node[placed]
    claimed = found.node_status == 0
    mixed = np.zeros(found.n_points, dtype=bool)  # a row without a direction claims nothing
    np.logical_or.at(mixed, node[placed], (true_node[node] != truth.node)[placed])
    if (mixed & claimed).any():
        return f"node {np.flatnonzero(mixed & claimed)[0]} has rows of several nodes"
    if getattr(found, "areas", None) is not None:
        return "read as a mass matrix"
    if isinstance(found, Surface) or (isinstance(found, PlanarMesh) and truth.gauge == "lengths"):
        return wrong_length(truth, found) or wrong_cells(truth, found, true_node)
    if found.dim > truth.points.shape[1]:
        return f"read as {found.operator!r}, in {found.dim} dimensions of {truth.points.shape[1]}"
    bar = error_bar(truth, found)
    for piece in np.unique(found.component[claimed & (found.component >= 0)]):
        own = np.flatnonzero(claimed & (found.component == piece))
        x, y = found.points[own], truth.points[true_node[own]]
        if not np.isfinite(x).all():
            return "a determined node without coordinates"
        if found.dim < y.shape[1]:
            off = within_plane(x, y, gauge_of(truth, found))
        elif found.operator in SIZELESS and truth.direction is not None:  # axes may have other names
            off = misplaced(x, y[:, axes_of(truth, found, np.isin(node, own))], gauge_of(truth, found))
        else:
            off = misplaced(x, y, gauge_of(truth, found))
        if off > bar:
            return f"points off by {off:.1e} of the diameter, where {bar:.0e} is allowed"
    return wrong_cells(truth, found, true_node)


def gauge_of(truth: Truth, found: Recovery) -> str:
    """What is free: of answers without a size a factor, of planar meshes rotations too."""
    if isinstance(found, PlanarMesh):
        return "similarity"
    if isinstance(found, Structure) and found.operator not in SIZELESS:
        turned = any("in a direction that is free" in warning for warning in found.warnings)
        return "motion" if turned else truth.gauge
    return "homothety"


def misplaced(x: NDArray, y: NDArray, gauge: str) -> float:
    """Largest distance after the best map that is free, relative to the diameter; NaN in truths are left out."""
    x, y = x[:, np.isfinite(y).all(axis=0)], y[:, np.isfinite(y).all(axis=0)]
    extent = np.linalg.norm(np.ptp(y, axis=0))
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    if extent == 0:
        return float(np.abs(x).max() > 1e-12)
    square = max((x * x).sum(), 1e-300)
    if gauge in ("similarity", "motion"):
        u, s, v = np.linalg.svd(x.T @ y)
        x = x @ (u @ v) * (s.sum() / square if gauge == "similarity" else 1.0)
    elif gauge == "homothety":
        x = x * ((x * y).sum() / square)
    return float(np.linalg.norm(x - y, axis=1).max() / extent)


def within_plane(x: NDArray, y: NDArray, gauge: str) -> float:
    """The same in space, for answers in a plane (n, 2) where the matrix falls into one for bending and one for forces.

    That is so where all nodes are in a plane across an axis, whichever; else the error is infinite.
    """
    flat = np.flatnonzero(np.ptp(y, axis=0) <= 1e-9 * np.linalg.norm(np.ptp(y, axis=0)))
    pairs = [[a, b] for a, b in permutations(range(3), 2) if set(range(3)) - {a, b} <= set(flat.tolist())]
    turned = [y[:, pair] * signs for pair in pairs for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    return min((misplaced(x, one, gauge) for one in turned), default=np.inf)


def axes_of(truth: Truth, found: Recovery, rows: NDArray[np.bool_]) -> list[int]:
    """Which true axis each axis of the answer is, by most rows."""
    d = found.dim
    named = np.zeros((d, d))
    both = rows & (found.direction_of_row < d)
    np.add.at(named, (found.direction_of_row[both], truth.direction[both]), 1)
    return list(max(permutations(range(d)), key=lambda one: named[range(d), one].sum()))


def error_bar(truth: Truth, found: Recovery) -> float:
    """How far off a point may be: what the answer says itself, or the usual."""
    said = getattr(found, "position_error", None)
    if said is not None:
        return max(CLOSE, float(said))
    if getattr(found, "chi_square", None) is None or not isinstance(found, PlanarMesh):
        return CLOSE
    again = recover(truth.matrix, **truth.options, standard_deviations=True)
    extent = np.linalg.norm(np.nanmax(again.points, axis=0) - np.nanmin(again.points, axis=0))
    return max(CLOSE, 10 * (again.largest_deviation or 0.0) / extent)


def wrong_length(truth: Truth, found: Surface | PlanarMesh) -> str:
    """Of sides between determined vertices, piece by piece, up to a factor."""
    if isinstance(found, Surface):
        ends, length = found.edges, found.edge_lengths
    else:
        whole = found.divided()[0]
        ends = np.concatenate([whole[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        length = np.linalg.norm(found.points[ends[:, 0]] - found.points[ends[:, 1]], axis=1)
    known = (found.node_status[ends] == 0).all(axis=1)
    ends, length = ends[known], length[known]
    true = np.linalg.norm(truth.points[ends[:, 0]] - truth.points[ends[:, 1]], axis=1)
    piece = found.component[ends].max(axis=1) if len(ends) else np.empty(0, int)
    allowed = error_bar(truth, found)
    for one in np.unique(piece):
        ratio = length[piece == one] / np.maximum(true[piece == one], 1e-300)
        off = np.ptp(ratio) / np.median(ratio)
        if off > allowed:
            return f"lengths off by {off:.1e}, where {allowed:.0e} is allowed"
    return ""


def wrong_cells(truth: Truth, found: Recovery, true_node: NDArray[np.int64]) -> str:
    """Cells between determined nodes that the truth does not have, or that the answer lacks.

    Polygons stand for all triangles within them, and sides whose entries vanish for either diagonal of what is left
    without them. No cells at all are no claim, nor are members, which are read off the graph.
    A cell that shows in no entry is not missing; nor is one all of whose nodes lack something, as next to supports, or
    are coupled to such, where a warning says that such cells may be missing.
    """
    if truth.cells is None or found.n_cells == 0 or isinstance(found, Structure):
        return ""
    claimed = {int(k) for k in true_node[found.node_status == 0]}
    true = {frozenset(cell): share for cell, share in zip(truth.cells, shares_of(truth), strict=True)}
    own = {frozenset(cell) for some in found.cells.values() for cell in true_node[some].tolist()}
    polygons = polygons_of(found, true_node)
    vanished = vanishing_pairs(truth) if isinstance(found, PlanarMesh) else set()
    for cell in own - set(true):
        if cell <= claimed and not sides(cell) & vanished:
            return f"a cell on nodes {sorted(cell)} that is none"
    excused = lacking(truth) if any("may be missing" in warning for warning in found.warnings) else set()
    for cell, share in true.items():
        if cell <= excused:
            continue
        inside = any(cell <= polygon for polygon in polygons)
        if cell <= claimed and cell not in own and not inside and share > truth.seen and not sides(cell) & vanished:
            return f"no cell on nodes {sorted(cell)}"
    return ""


def shares_of(truth: Truth) -> NDArray[np.float64]:
    return truth.shares if len(truth.shares) else np.ones(len(truth.cells or ()))


def polygons_of(found: Recovery, true_node: NDArray[np.int64]) -> list[frozenset[int]]:
    """Cells that a planar mesh leaves undivided."""
    if not found.n_polygons:
        return []
    parts = np.split(found.polygons_data, found.polygons_offsets[1:-1])
    return [frozenset(true_node[part].tolist()) for part in parts]


def lacking(truth: Truth) -> set[int]:
    """Nodes of a body that lack a row, or have one that does not annihilate translations; and what they couple to."""
    matrix, direction = truth.matrix, truth.direction
    if direction is None:
        return set()
    d = truth.points.shape[1]
    labels = (direction[:, None] == np.arange(d)).astype(float)
    moved = (np.abs(matrix @ labels) > 1e-9 * (abs(matrix) @ labels).sum(axis=1)[:, None]).any(axis=1)
    few = np.bincount(truth.node, minlength=len(truth.points)) < d
    few[truth.node[moved]] = True
    entry = matrix.tocoo()
    beside = few.copy()
    beside[truth.node[entry.row[few[truth.node[entry.col]] & (entry.data != 0)]]] = True
    return set(np.flatnonzero(beside).tolist())


def sides(cell: frozenset[int]) -> set[frozenset[int]]:
    """Pairs of nodes of a cell."""
    return {frozenset((a, b)) for a in cell for b in cell if a < b}


def vanishing_pairs(truth: Truth) -> set[frozenset[int]]:
    """Pairs in a cell whose entry is zero but for rounding."""
    off = abs(truth.matrix - sp.diags_array(truth.matrix.diagonal())).tocsr()
    largest = off.max(axis=1).toarray().ravel()
    pairs = {pair for cell in truth.cells or () for pair in sides(frozenset(cell))}
    row_of = dict(zip(truth.node.tolist(), range(len(truth.node)), strict=True))
    gone = set()
    for pair in pairs:
        i, j = (row_of.get(k, -1) for k in pair)
        if i >= 0 and j >= 0 and off[i, j] <= 1e-9 * max(largest[i], largest[j]):
            gone.add(pair)
    return gone


def has_the_entries(matrix: sp.csr_array, found: Recovery) -> bool:
    """Whether scikit-fem assembles the very entries on the mesh that was found."""
    given = sp.csr_array(matrix)
    if isinstance(found, Body):
        return body_has_the_entries(given, found)
    if isinstance(found, Surface):
        return lengths_give_back(found, given, SAME)
    if not isinstance(found, PlanarMesh) or found.areas is not None or found.vector_valued:
        return False
    if found.row_scaling is not None:
        back = sp.diags_array(1 / found.row_scaling)
        given = sp.csr_array(back @ given @ back)
    if found.reaction and not gives_back(found, given, SAME):
        given = sp.csr_array(given - found.reaction * masses(found))
    return gives_back(found, given, SAME)


def body_has_the_entries(given: sp.csr_array, found: Body) -> bool:
    """The same of elastic bodies of one kind of cell, each with Lame coefficients of its own.

    Pairs of determined nodes are compared. Cells are not in the answer where they have lost a node: there it is no.
    """
    kinds = {"triangle": "tri-p1", "triangle6": "tri-p2", "quad": "quad-q1", "quad8": "quad-s2", "quad9": "quad-q2",
             "tetra": "tet-p1", "tetra10": "tet-p2"}  # fmt: skip
    if len(found.cells) != 1 or not set(found.cells) <= set(kinds) or len(found.lame) != found.n_cells:
        return False
    ((name, cells),) = found.cells.items()
    d, size = found.dim, found.n_points * found.dim
    total = sp.csr_array((size, size))
    for cell, lame in zip(cells, found.lame, strict=True):
        rows = (cell[:, None] * d + np.arange(d)).ravel()
        local = element_matrix(kinds[name], found.points[cell], *lame.tolist())
        place = np.repeat(rows, len(rows)), np.tile(rows, len(rows))
        total = total + sp.coo_array((local.ravel(), place), shape=(size, size))
    known = np.flatnonzero((found.node_status[found.node_of_row] == 0) & (found.direction_of_row < d))
    own = (found.node_of_row * d + found.direction_of_row)[known]
    apart = found.node_of_row[known][:, None] != found.node_of_row[known]
    a, b = given[known][:, known].toarray() * apart, sp.csr_array(total)[own][:, own].toarray() * apart
    largest = np.abs(a).max(axis=1, initial=0.0)
    factor = (a * b).sum() / max((b * b).sum(), 1e-300)
    return bool((np.abs(a - factor * b) <= SAME * largest[:, None]).all())


def element_matrix(kind: str, points: NDArray, lam: float, mu: float) -> NDArray[np.float64]:
    """The matrix of one straight cell, node by node, by scikit-fem; corners come first, in order around."""
    corners = {"tri": 3, "quad": 4, "tet": 4}[kind.split("-")[0]]
    mesh = ELEMENTS[kind][0](points[:corners].T.copy(), np.arange(corners)[:, None])
    one = stiffness(kind, mesh, lam=lam, mu=mu)
    nearest = np.linalg.norm(one.points[:, None] - points[None], axis=2).argmin(axis=0)
    d = points.shape[1]
    rows = (nearest[:, None] * d + np.arange(d)).ravel()
    return one.matrix.toarray()[np.ix_(rows, rows)]


def checked(truth: Truth) -> tuple[str, str]:
    """What comes of a matrix, and what is wrong."""
    return outcome_of(truth, recover(truth.matrix, **truth.options))
