"""Faces, orientation, boundary loops and pieces from the sparsity graph alone (paper, section 2.2)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import NotPlanarError, RecoveryError, TopologyError
from ..words import count_of
from . import planarity
from .boundary import boundary_corners, following, loops
from .cycles import three_cycles
from .embedding import triangular_faces
from .keys import distinct
from .numbering import Numbering
from .obstruction import obstruction_text
from .orientation import Gluing, glue, orient, reglue
from .separating import not_faces
from .surface import Piece, Topology


def recognise(n: int, edges: NDArray, numbering: Numbering | None = None) -> Topology:
    """Find the triangles of a planar mesh in its graph.

    3-cycles with something on both sides are no faces. If every edge lies on at most two of the others, and these
    glue together to orientable surfaces with the Euler number of a sphere with as many holes as there are
    boundary loops, then the surfaces are planar and those 3-cycles are faces: no planarity test is needed, and no
    tri-connectivity. Otherwise a planar embedding is computed, and its triangular faces are the elements.

    Where that fails and the graph has several connected components each is tried by itself; those without a mesh
    are listed in ``failures``.

    Parameters
    ----------
    n : int
        Number of vertices.
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    numbering : Numbering, optional
        Of the same graph: in which to work, and which pieces keep where they are the whole graph.

    Raises
    ------
    NotPlanarError
        With a Kuratowski subgraph as witness.
    TopologyError
        If no component has triangles that fit together.
    """
    if numbering is None:
        numbering = Numbering(np.arange(n), np.arange(len(edges)), edges)
    try:
        return _recognise_numbered(n, edges, [numbering])
    except (NotPlanarError, TopologyError):
        parts = components(n, edges)
        if len(parts) == 1:
            raise
        return _recognise_numbered(n, edges, parts)


def surfaces(n: int, edges: NDArray, numbering: Numbering | None = None) -> Topology:
    """The surfaces that 3-cycles make; no planarity test, and edges or whole components may be left over.

    Parameters
    ----------
    n, edges, numbering
        As for :func:`recognise`.
    """
    pieces = _surfaces_of(numbering or Numbering(np.arange(n), np.arange(len(edges)), edges))
    if pieces is None:
        pieces = [piece for part in components(n, edges) for piece in _surfaces_of(part) or ()]
    pieces.sort(key=lambda piece: int(piece.vertices.min()))
    return Topology(n, edges, tuple(pieces), "3-cycles")


def _surfaces_of(part: Numbering) -> list[Piece] | None:
    try:
        pieces = triangulated(len(part.vertices), part.edges)
    except NotPlanarError:
        return None
    return None if pieces is None else [in_whole(piece, part) for piece in pieces]


def in_whole(piece: Piece, part: Numbering) -> Piece:
    """A piece of a part of the graph, in the numbering of the whole."""
    return replace(piece, vertices=part.vertices[piece.vertices], edge_rows=part.edge_rows[piece.edge_rows])


def components(n: int, edges: NDArray) -> list[Numbering]:
    """Connected components with edges, each in a numbering of its own, largest first."""
    graph = sp.coo_array((np.ones(len(edges), np.int8), edges.T), shape=(n, n))
    count, label = csgraph.connected_components(graph, directed=False)
    parts = []
    for rows in sorted(_groups(label[edges[:, 0]], count), key=len, reverse=True):
        if len(rows):
            vertices, ends = np.unique(edges[rows], return_inverse=True)
            parts.append(Numbering(vertices, rows, ends.reshape(-1, 2)))
    return parts


def _recognise_numbered(n: int, edges: NDArray, parts: list[Numbering]) -> Topology:
    """Parts of the graph one by one, in the numbering of each; an error where none has a mesh."""
    pieces: list[Piece] = []
    failures: list[RecoveryError] = []
    method = "component by component"
    for part in parts:
        try:
            found = _recognise_whole(len(part.vertices), part.edges)
        except (NotPlanarError, TopologyError) as error:
            failures.append(located(error, part, named=len(parts) > 1))
            continue
        method = found.method if len(parts) == 1 else method
        pieces += [in_whole(piece, part) for piece in found.pieces]
    if len(failures) == len(parts):
        raise failures[0]
    pieces.sort(key=lambda piece: int(piece.vertices.min()))
    return Topology(n, edges, tuple(pieces), method, tuple(map(str, failures)))


def located(error: RecoveryError, part: Numbering, *, named: bool) -> RecoveryError:
    """The same error in the numbering of the whole, on demand with the place of its part of the graph."""
    where = f"in the component of row {part.vertices.min()} ({len(part.vertices)} rows): " if named else ""
    if isinstance(error, NotPlanarError):
        witness = tuple((int(part.vertices[a]), int(part.vertices[b])) for a, b in error.witness)
        return _not_planar_witness(where, error.why, witness)
    return type(error)(where + str(error))


def triangulated(n: int, edges: NDArray) -> tuple[Piece, ...] | None:
    """The surfaces that the 3-cycles of a graph make; None where they make none, or some are no sphere with holes.

    Edges may be left over.

    Raises
    ------
    NotPlanarError
        If there are more edges than a planar graph can have.
    """
    if n >= 3 and len(edges) > 3 * n - 6:
        raise _not_planar(n, edges, f"{len(edges)} edges on {n} rows are more than 3 n - 6; for one, ")
    triangles, opposite = three_cycles(n, edges)
    if (np.bincount(opposite.ravel(), minlength=1) > 2).any():
        face = ~not_faces(n, edges, triangles, opposite)
        triangles, opposite = triangles[face], opposite[face]
    return planar_pieces(n, edges, triangles, opposite) or None


def _recognise_whole(n: int, edges: NDArray) -> Topology:
    """All of the graph at once, or an error."""
    pieces = triangulated(n, edges)
    if pieces is not None and sum(len(piece.edges) for piece in pieces) == len(edges):
        return Topology(n, edges, pieces, "3-cycles")
    if not planarity.is_planar(n, edges):
        raise _not_planar(n, edges, "")
    if pieces is not None:  # edges without a triangle do not hinder the rest
        return Topology(n, edges, pieces, "3-cycles")
    triangles, opposite = triangular_faces(n, edges)
    if not len(triangles):
        raise TopologyError(
            f"the graph of the matrix ({count_of(n, 'vertex', 'vertices')}, {count_of(len(edges), 'edge')}) is planar "
            "but has no triangle: no element can be recognised (if zero entries were dropped, keep them stored)"
        )
    pieces = planar_pieces(n, edges, triangles, opposite)
    if pieces is None:
        raise TopologyError(
            "the triangular faces of the planar graph do not glue together to surfaces with a boundary; "
            "a hole or an outer boundary of three edges may have been taken for an element"
        )
    return Topology(n, edges, pieces, "embedding")


def _not_planar(n: int, edges: NDArray, why: str) -> NotPlanarError:
    return _not_planar_witness("", why, planarity.kuratowski_edges(n, edges))


def _not_planar_witness(where: str, why: str, witness: tuple[tuple[int, int], ...]) -> NotPlanarError:
    text = obstruction_text(witness)
    return NotPlanarError(f"{where}the graph of the matrix is not planar: {why}{text}", witness, why)


def planar_pieces(n: int, edges: NDArray, triangles: NDArray, opposite: NDArray) -> tuple[Piece, ...] | None:
    """Cut triangles into oriented pieces; None where one of them is not a sphere with holes.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
    triangles : (m, 3) int64
        In any orientation.
    opposite : (m, 3) int64
        Rows of `edges` that face the corners.
    """
    if not len(triangles):
        return ()
    gluing = glue(len(edges), opposite)
    if (gluing.count > 2).any():
        return None
    flip, piece, orientable = orient(triangles, gluing)
    if not orientable.all():
        return None
    triangles = np.where(flip[:, None], triangles[:, [0, 2, 1]], triangles)
    opposite = np.where(flip[:, None], opposite[:, [0, 2, 1]], opposite)
    gluing = reglue(gluing, flip)
    corners = boundary_corners(gluing)
    loop, order = loops(following(triangles, opposite, gluing, corners))
    if not _spheres_with_holes(n, edges, triangles, gluing, piece, corners, loop):
        return None
    return _cut(n, edges, triangles, opposite, gluing, piece, corners[order], loop[order])


def _spheres_with_holes(
    n: int, edges: NDArray, triangles: NDArray, gluing: Gluing, piece: NDArray, corners: NDArray, loop: NDArray
) -> bool:
    """Euler's formula for every piece, with a vertex counted once for each fan of triangles about it.

    A vertex with p boundary edges leaving it in a piece has p fans, one if p = 0. A second closed
    fan would be missed here, but counting it could only raise v - e + m, which is at most 2 - loops.
    """
    n_pieces = int(piece.max()) + 1
    n_loops = np.zeros(n_pieces, dtype=np.int64)
    n_edges = np.bincount(piece[gluing.first[gluing.count > 0] // 3], minlength=n_pieces)
    n_triangles = np.bincount(piece, minlength=n_pieces)
    at = _vertices_of_pieces(n, triangles, piece)
    n_vertices = np.bincount(at // n, minlength=n_pieces)
    if len(corners):
        _, one_of_each = np.unique(loop, return_index=True)
        n_loops = np.bincount(piece[corners[one_of_each] // 3], minlength=n_pieces)
        tails = triangles.ravel()[3 * (corners // 3) + (corners + 1) % 3]
        fans = piece[corners // 3] * n + tails
        n_vertices = n_vertices + np.bincount(fans // n, minlength=n_pieces)
        n_vertices -= np.bincount(distinct(fans) // n, minlength=n_pieces)
    return bool(((n_vertices - n_edges + n_triangles == 2 - n_loops) & (n_loops > 0)).all())


def _vertices_of_pieces(n: int, triangles: NDArray, piece: NDArray) -> NDArray:
    """Sorted keys piece * n + vertex of all pairs that occur."""
    if not piece.any():
        seen = np.zeros(n, dtype=bool)
        seen[triangles] = True
        return np.flatnonzero(seen)
    return distinct(piece[:, None] * n + triangles)


def _cut(
    n: int,
    edges: NDArray,
    triangles: NDArray,
    opposite: NDArray,
    gluing: Gluing,
    piece: NDArray,
    corners: NDArray,
    loop: NDArray,
) -> tuple[Piece, ...]:
    """Number each piece by itself."""
    base = 3 * (corners // 3)
    flat = triangles.ravel()
    boundary = np.column_stack([flat[base + (corners + 1) % 3], flat[base + (corners + 2) % 3]])
    n_pieces = int(piece.max()) + 1
    edge_piece = np.where(gluing.count > 0, piece[gluing.first // 3], -1)
    if n_pieces == 1 and len(edges) == (edge_piece == 0).sum() and len(_vertices_of_pieces(n, triangles, piece)) == n:
        offsets = np.append(np.flatnonzero(np.diff(loop, prepend=-1)), len(loop))
        return (
            Piece(np.arange(n), np.arange(len(edges)), edges, triangles, opposite, gluing.faces, boundary, offsets),
        )
    return tuple(
        _local_piece(n, edges, triangles, opposite, boundary, loop, rows)
        for rows in zip(
            _groups(piece, n_pieces),
            _groups(edge_piece, n_pieces),
            _groups(piece[corners // 3], n_pieces),
            strict=True,
        )
    )


def _groups(label: NDArray, n_labels: int) -> list[NDArray]:
    """Rows with label 0, 1, ..., each in increasing order; negative labels are left out."""
    order = np.argsort(label, kind="stable")
    start = np.searchsorted(label[order], np.arange(n_labels + 1))
    return [order[start[k] : start[k + 1]] for k in range(n_labels)]


def _local_piece(
    n: int,
    edges: NDArray,
    triangles: NDArray,
    opposite: NDArray,
    boundary: NDArray,
    loop: NDArray,
    rows: tuple[NDArray, NDArray, NDArray],
) -> Piece:
    of_triangles, of_edges, of_boundary = rows
    vertices, corner_vertices = np.unique(triangles[of_triangles], return_inverse=True)
    local_opposite = np.searchsorted(of_edges, opposite[of_triangles])
    ring = loop[of_boundary]
    return Piece(
        vertices=vertices,
        edge_rows=of_edges,
        edges=np.searchsorted(vertices, edges[of_edges]),
        triangles=corner_vertices.reshape(-1, 3),
        opposite=local_opposite,
        facing=glue(len(of_edges), local_opposite).faces,
        boundary=np.searchsorted(vertices, boundary[of_boundary]),
        loop_offsets=np.append(np.flatnonzero(np.diff(ring, prepend=-1)), len(ring)),
    )
