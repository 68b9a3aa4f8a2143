"""All meshes that a small weighted graph can belong to, by trying every set of cells: a slow oracle.

A cell is a cycle of the graph, or a path whose ends are joined by a vanished side, the diameter of the circle through
its vertices. Of the library only the gluing of triangles and the cotangents are used.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import networkx
import numpy as np
import scipy.linalg
import scipy.sparse as sp

from unassemble.planar import edge_weights
from unassemble.topology import planar_pieces

Cell = tuple[int, ...]
LONGEST = 6


def matrix_of(n: int, weights: dict[tuple[int, int], float]) -> sp.csr_array:
    """-w in both triangles."""
    i, j = np.array(list(weights)).T
    w = np.array(list(weights.values()))
    return sp.coo_array((np.r_[-w, -w], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()


def named(cell: Cell) -> Cell:
    """One name for all rotations and both directions."""
    k = cell.index(min(cell))
    turned = [*cell[k:], *cell[:k]]
    return tuple(turned if turned[1] < turned[-1] else [turned[0], *turned[:0:-1]])


def all_meshes(n: int, weights: dict[tuple[int, int], float], c: float | None = None) -> list[frozenset[Cell]]:
    """The cells of every mesh of one piece that has these entries; `c` if it is known."""
    graph = networkx.Graph(list(weights))
    found = []
    for cells in _choices(graph):
        if fits(n, weights, [path for path, _ in cells], c):
            found.append(frozenset(named(path) for path, _ in cells))
    return found


def _cells(graph: networkx.Graph) -> list[tuple[Cell, bool]]:
    """Paths of the graph, and whether they close."""
    cells = []

    def extend(path: list[int]) -> None:
        if len(path) >= 3:
            closed = graph.has_edge(path[0], path[-1])
            once = (path[0] == min(path) and path[1] < path[-1]) if closed else path[0] < path[-1]
            if once:
                cells.append((tuple(path), closed))
        if len(path) < LONGEST:
            for vertex in graph[path[-1]]:
                if vertex not in path:
                    extend([*path, vertex])

    for vertex in graph:
        extend([vertex])
    return cells


def _choices(graph: networkx.Graph) -> Iterator[list[tuple[Cell, bool]]]:
    """Sets of cells with one or two on every edge, one on every vanished side."""
    cells = _cells(graph)
    sides = [[frozenset(side) for side in pairwise((*path, path[0]) if closed else path)] for path, closed in cells]
    gone = [None if closed else frozenset((path[0], path[-1])) for path, closed in cells]
    count = {frozenset(edge): 0 for edge in graph.edges}
    seen = set()

    def room(k: int, chosen: list[int]) -> bool:
        return k not in chosen and all(count[side] < 2 for side in sides[k]) and (
            gone[k] is None or gone[k] not in [gone[j] for j in chosen]
        )  # fmt: skip

    def search(chosen: list[int], first: int) -> Iterator[list[int]]:
        bare = next((edge for edge, number in count.items() if not number), None)
        if bare is None and frozenset(chosen) not in seen:
            seen.add(frozenset(chosen))
            yield chosen
        start = first if bare is None else 0
        for k in range(start, len(cells)):
            if (bare is None or bare in sides[k]) and room(k, chosen):
                for side in sides[k]:
                    count[side] += 1
                yield from search([*chosen, k], k + 1 if bare is None else 0)
                for side in sides[k]:
                    count[side] -= 1

    for chosen in search([], 0):
        yield [cells[k] for k in chosen]


def fits(n: int, weights: dict[tuple[int, int], float], cells: list[Cell], c: float | None) -> bool:
    """Whether these cells make one planar mesh with these weights: the least quotient of the pencil, and its vector."""
    given = {frozenset(edge) for edge in weights}
    triangles = []
    for cell in cells:
        turns = (cell[k:] + cell[:k] for k in range(len(cell)))
        fan = next((t for t in turns if not any(frozenset((t[0], v)) in given for v in t[2:-1])), None)
        if fan is None:
            return False
        triangles += [(fan[0], p, q) for p, q in pairwise(fan[1:])]
    corner = np.array(triangles)
    ends = np.sort(corner[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [n, 1]
    keys = np.union1d(ends, np.array(list(weights)) @ [n, 1])
    edges = np.column_stack([keys // n, keys % n])
    pieces = planar_pieces(n, edges, corner, np.searchsorted(keys, ends))
    if not pieces or len(pieces) > 1 or pieces[0].n_vertices < n or len(pieces[0].edges) < len(edges):
        return False
    piece = pieces[0]
    w = np.array([weights.get((int(i), int(j)), 0.0) for i, j in np.sort(piece.vertices[piece.edges], axis=1)])
    A, T = np.zeros((n, n)), np.zeros((n, n), complex)
    i, j = piece.edges.T
    A[i, j] = A[j, i] = -w
    A -= np.diag(A.sum(axis=1))
    a, b = piece.boundary.T
    np.add.at(T, (a, b), 1 / 4j)
    np.add.at(T, (b, a), -1 / 4j)
    if np.linalg.eigvalsh(A[1:, 1:])[0] < 1e-12:
        return False
    values, vectors = scipy.linalg.eigh(T[1:, 1:], A[1:, 1:] / 2)
    scale, z = 1 / values[-1], np.r_[0, vectors[:, -1]]
    corners = z[piece.triangles] / np.abs(z).max()
    sides = np.roll(corners, -1, axis=1) - corners
    with np.errstate(all="ignore"):
        misfit = np.abs(scale * edge_weights(piece, z) - w).max() / np.abs(w).max()
        angles = np.angle(-np.roll(sides, 1, axis=1) / sides)
    around = np.bincount(piece.triangles.ravel(), np.abs(angles).ravel())
    return bool(
        misfit < 1e-9
        and ((np.conj(sides[:, 0]) * sides[:, 1]).imag > 1e-9).all()
        and (around < 2 * np.pi + 1e-6).all()
        and (c is None or abs(scale / c - 1) < 1e-9)
    )
