"""Pieces from the 3-cycles of the sparsity graph alone (paper, section 2.2), and why a graph is not planar."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import NotPlanarError, RecoveryError
from .cycles import not_faces, three_cycles
from .numbering import LocalNumbering, components
from .pieces import planar_pieces
from .planarity import rotation_system, too_many
from .surface import Piece, Topology


def surfaces(n: int, edges: NDArray, numbering: LocalNumbering | None = None) -> Topology:
    """The surfaces that 3-cycles make; no planarity test, and edges or whole components may be left over.

    3-cycles with something on both sides are no faces. If every edge lies on at most two of the others, and these
    glue together to orientable surfaces with the Euler number of a sphere with as many holes as there are
    boundary loops, then the surfaces are planar and those 3-cycles are faces.

    `n`: number of vertices; `edges` (e, 2): pairs i < j in lexicographic order; `numbering`: of the same graph: in
    which to work, and which pieces keep where they are the whole graph.
    """
    pieces = _surfaces_of(numbering or LocalNumbering(np.arange(n), np.arange(len(edges)), edges))
    if pieces is None:
        pieces = [piece for part in components(n, edges) for piece in _surfaces_of(part) or ()]
    pieces.sort(key=lambda piece: int(piece.vertices.min()))
    return Topology(n, edges, tuple(pieces), "3-cycles")


def _surfaces_of(part: LocalNumbering) -> list[Piece] | None:
    """None where 3-cycles make no surface, or some are no sphere with holes; edges may be left over."""
    n, edges = len(part.vertices), part.edges
    if too_many(n, edges):
        return None
    triangles, opposite = three_cycles(n, edges)
    if (np.bincount(opposite.ravel(), minlength=1) > 2).any():
        face = ~not_faces(n, edges, triangles, opposite)
        triangles, opposite = triangles[face], opposite[face]
    return [
        replace(piece, vertices=part.vertices[piece.vertices], edge_rows=part.edge_rows[piece.edge_rows])
        for piece in planar_pieces(n, edges, triangles, opposite) or ()
    ] or None


def located(error: RecoveryError, part: LocalNumbering, *, named: bool) -> RecoveryError:
    """The same error in the numbering of the whole, on demand with the place of its part of the graph."""
    where = f"in the component of row {part.vertices.min()} ({len(part.vertices)} rows): " if named else ""
    return _not_planar(error.why, where) if isinstance(error, NotPlanarError) else type(error)(where + str(error))


def require_planar(n: int, edges: NDArray) -> None:
    """Do nothing for a planar graph; else raise NotPlanarError."""
    if too_many(n, edges):
        raise _not_planar(f"{len(edges)} edges on {n} rows are more than 3 n - 6")
    if rotation_system(n, edges) is None:
        raise _not_planar()


def _not_planar(why: str = "", where: str = "") -> NotPlanarError:
    return NotPlanarError(f"{where}the graph of the matrix is not planar" + (f": {why}" if why else ""), why)
