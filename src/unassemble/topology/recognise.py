"""Faces, orientation, boundary loops and pieces from the sparsity graph alone (paper, section 2.2)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import NotPlanarError, RecoveryError, TopologyError
from ..words import count_of
from . import planarity
from .cycles import three_cycles
from .embedding import triangular_faces
from .numbering import Numbering, components
from .pieces import planar_pieces
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
        raise _not_planar(n, edges, f"{len(edges)} edges on {n} rows are more than 3 n - 6")
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
    require_planar(n, edges)
    if pieces is not None:  # edges without a triangle do not hinder the rest
        return Topology(n, edges, pieces, "3-cycles")
    triangles, opposite = triangular_faces(n, edges)
    if not len(triangles):
        raise TopologyError(
            f"the graph of the matrix ({count_of(n, 'vertex', 'vertices')}, {count_of(len(edges), 'edge')}) is planar, "
            "but without the entries no cell shows in it: no cycle has three edges"
        )
    pieces = planar_pieces(n, edges, triangles, opposite)
    if pieces is None:
        raise TopologyError(
            "the triangular faces of the planar graph do not glue together to surfaces with a boundary; "
            "a hole or an outer boundary of three edges may have been taken for an element"
        )
    return Topology(n, edges, pieces, "embedding")


def require_planar(n: int, edges: NDArray) -> None:
    """Do nothing for a planar graph.

    Raises
    ------
    NotPlanarError
        With a Kuratowski subgraph as witness.
    """
    if n >= 3 and len(edges) > 3 * n - 6:
        raise _not_planar(n, edges, f"{len(edges)} edges on {n} rows are more than 3 n - 6")
    if not planarity.is_planar(n, edges):
        raise _not_planar(n, edges, "")


def _not_planar(n: int, edges: NDArray, why: str) -> NotPlanarError:
    return _not_planar_witness("", why, planarity.kuratowski_edges(n, edges))


def _not_planar_witness(where: str, why: str, witness: tuple[tuple[int, int], ...]) -> NotPlanarError:
    said = f"{where}the graph of the matrix is not planar" + (f": {why}" if why else "")
    return NotPlanarError(said, witness, why)
