"""A mesh put together from overlapping patches: a start where noise drowns the null vector of the whole.

Noise bends conformal maps the more the longer a mesh is relative to its width; from one end of a channel to the other
the null vector may shrink by more digits than numbers have. On a patch a few edges wide noise does little harm. So
each patch is fitted by itself. Of entries between two vertices on its rim, which contain a triangle outside, half is
supposed, with an error of the size of a cotangent.

Patches are turned and scaled by factors a for which a d is the same for all patches of an edge, d being the edge in
the frame of the patch: log a are potentials on the graph of overlaps, and the positions are potentials of the edges'
means. So no error adds up around holes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..errors import GeometryError, SolverError
from ..linalg import factorisation, upper_from_edges
from ..topology import Piece
from ..topology.keys import pair_keys, with_sides
from ..topology.pieces import planar_pieces
from .cautious import CautiousOptions, cautious_polish, count_flipped
from .conformal import conformal_map
from .polish import PolishedMesh

_RADIUS = 8  # edges from the middle of a patch to its rim: wide enough for its own entries to determine it
_CORE = 6  # up to here edges of a patch count: what is supposed of the rim does not reach so far
_RIM = 30.0  # error of what is supposed, in units of that of the entries: noise that drowns null vectors is about 1%
_NEAR = 0.05**-2  # as for the polish of a whole piece: inverse mean square of a misfit that noise may leave
_FEW = 5  # patches that may fail: their neighbours cover most of them
_EXACT = 1e-100  # of c: a residual that is none
_SHORT = CautiousOptions(max_steps=60, settled=0.1)
_ORDINARY = (0.3, 2.0), (0.1, np.inf)
"""Bounds of the weights that patches begin with, over the median: positive ones always have a conformal map."""


@dataclass(frozen=True, eq=False)
class _Patch:
    """Edges of the whole piece as a patch draws them, and how much it is to be trusted."""

    rows: NDArray[np.int64]
    drawn: NDArray[np.complex128]
    trust: float


def from_patches(piece: Piece, weights: NDArray) -> NDArray[np.complex128]:
    """(n,) positions of a connected piece, in no particular frame.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.

    Raises
    ------
    SolverError
        If too few patches can be fitted, or these do not hang together.
    """
    patches: list[_Patch] = []
    keys = pair_keys(piece.n_vertices, *piece.edges.T)
    for ball, core in _balls(piece):
        patches.extend(_fitted(piece, keys, weights, ball, core))
        far = sum(patch.trust < _NEAR for patch in patches)
        if far > _FEW + len(patches) / 4:  # it is not the length of the mesh that is in the way
            raise SolverError("patches of the mesh do not fit either")
    if not patches:
        raise SolverError("no patch of the mesh can be fitted")
    size = [len(patch.rows) for patch in patches]
    owner, row = np.repeat(np.arange(len(patches)), size), np.concatenate([patch.rows for patch in patches])
    trust = np.repeat([patch.trust for patch in patches], size)
    drawn = np.concatenate([patch.drawn for patch in patches])
    drawn *= np.exp(_turns(owner, row, drawn, trust, len(piece.edges)))[owner]
    total = np.bincount(row, trust, len(piece.edges))
    seen = np.flatnonzero(total)
    mean = np.bincount(row, trust * drawn.real, len(total)) + 1j * np.bincount(row, trust * drawn.imag, len(total))
    mean = mean[seen] / total[seen]
    return _potential(piece.n_vertices, piece.edges[seen], np.abs(mean) ** -2.0, mean)


def _balls(piece: Piece) -> Iterator[tuple[NDArray[np.int64], NDArray[np.bool_]]]:
    """Vertices near each of some middles, increasing, and which of them are nearer; the latter cover all edges."""
    n = piece.n_vertices
    graph = sp.coo_array((np.ones(len(piece.edges)), piece.edges.T), shape=(n, n)).tocsr()
    graph = (graph + graph.T).tocsr()
    far = csgraph.breadth_first_order(graph, 0, directed=False)[0][-1]
    covered = np.zeros(n, dtype=bool)
    for middle in csgraph.breadth_first_order(graph, far, directed=False)[0]:
        if not covered[middle]:
            distance = csgraph.dijkstra(graph, indices=middle, unweighted=True, limit=_RADIUS)
            covered |= distance < _CORE
            ball = np.flatnonzero(distance <= _RADIUS)
            yield ball, distance[ball] <= _CORE


def _fitted(
    piece: Piece, keys: NDArray[np.int64], weights: NDArray, ball: NDArray, core: NDArray[np.bool_]
) -> Iterator[_Patch]:
    """The patches that the triangles in a ball make, as far as they can be fitted; `keys` are those of all edges."""
    inside = np.zeros(piece.n_vertices, dtype=bool)
    inside[ball] = True
    triangles = np.searchsorted(ball, piece.triangles[inside[piece.triangles].all(axis=1)])
    edges, _, opposite = with_sides(len(ball), np.empty((0, 2), np.int64), triangles)
    for part in planar_pieces(len(ball), edges, triangles, opposite) or ():
        ends = ball[part.vertices[part.edges]]
        rows = np.searchsorted(keys, pair_keys(piece.n_vertices, *ends.T))
        own = weights[rows]
        rim = piece.inner[rows] & ~part.inner
        own[rim] /= 2
        kept = core[part.vertices[part.edges]].all(axis=1)
        found = _nearest(part, own, rim)
        if found is not None and kept.any():
            drawn = np.diff(found.z[part.edges], axis=1)[kept, 0]
            yield _Patch(rows[kept], np.where(ends[kept, 0] < ends[kept, 1], drawn, -drawn), _trust(part, found))


def _nearest(part: Piece, weights: NDArray, rim: NDArray[np.bool_]) -> PolishedMesh | None:
    """The first mesh, from several starts, that fits as well as noise may let it, or the one that fits best."""
    typical = np.median(np.abs(weights)) * np.sign(np.median(weights))
    best: PolishedMesh | None = None
    for least, most in _ORDINARY:
        with suppress(GeometryError, SolverError), np.errstate(all="ignore"):
            start = conformal_map(part, np.clip(weights / typical, least, most), sharp=False).z
            found = cautious_polish(part, weights, start, spread=np.where(rim, _RIM, 1.0), options=_SHORT)
            if count_flipped(part, found.z) or not np.isfinite(found.residual):
                continue
            if best is None or _trust(part, found) > _trust(part, best):
                best = found
            if _trust(part, best) >= _NEAR:
                break
    return best


def _trust(part: Piece, found: PolishedMesh) -> float:
    """Inverse mean square of the misfit over c."""
    size = abs(found.scale)
    return len(part.edges) * (size / max(found.residual, _EXACT * size)) ** 2


def _turns(owner: NDArray, row: NDArray, drawn: NDArray, trust: NDArray, edges: int) -> NDArray[np.complex128]:
    """(patches,) log a, such that a d is nearly the same for all patches of an edge."""
    n = int(owner[-1]) + 1
    count, size, direction = (
        sp.csr_array((values, (owner, row)), shape=(n, edges))
        for values in (np.ones(len(row)), np.log(np.abs(drawn)), drawn / np.abs(drawn))
    )
    common = sp.triu(count @ count.T, 1, format="csr")
    common.sort_indices()
    common = common.tocoo()
    ends = np.column_stack(common.coords)
    p, q = ends.T
    cross, along = size @ count.T, direction @ direction.conj().T
    # a_p d_p = a_q d_q: the log of a_q / a_p is that of d_p / d_q.
    ratio = (cross[p, q] - cross[q, p]) / common.data + 1j * np.angle(along[p, q])
    least = trust[np.searchsorted(owner, ends)].min(axis=1)
    weight = common.data * least
    tree = csgraph.minimum_spanning_tree(sp.coo_array((1 / weight, (p, q)), shape=(n, n)))
    kept = np.isin(pair_keys(n, p, q), pair_keys(n, *tree.tocoo().coords))
    first = _potential(n, ends[kept], weight[kept], ratio[kept])
    turns = np.round((first[q] - first[p] - ratio).imag / (2 * np.pi))
    return _potential(n, ends, weight, ratio + 2j * np.pi * turns)


def _potential(n: int, edges: NDArray, weight: NDArray, difference: NDArray) -> NDArray[np.complex128]:
    """(n,) values whose differences along edges (k, 2) come nearest to those given; the last is zero."""
    graph = sp.coo_array((np.ones(len(edges)), edges.T), shape=(n, n))
    if csgraph.connected_components(graph, directed=False)[0] > 1:
        raise SolverError("the patches of the mesh that can be fitted do not hang together")
    if n == 1:
        return np.zeros(1, dtype=np.complex128)
    weight = weight / weight.max()
    flow = weight * difference
    rhs, diagonal = np.zeros(n, dtype=np.complex128), np.bincount(edges.ravel(), np.repeat(weight, 2), n)
    np.add.at(rhs, edges[:, 1], flow)
    np.subtract.at(rhs, edges[:, 0], flow)
    kept = edges[:, 1] < n - 1
    matrix = upper_from_edges(n - 1, edges[kept], -weight[kept], diagonal[:-1])
    factor = factorisation(matrix, definite=True)
    factor.factorise(matrix)
    solution = factor.solve(np.column_stack([rhs.real, rhs.imag])[:-1])
    factor.release()
    return np.append(solution @ np.array([1, 1j]), 0)
