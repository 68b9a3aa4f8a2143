"""Random meshes in which it is hard to tell cells from holes, a family for each difficulty; and matrices of no mesh."""

from __future__ import annotations

from collections.abc import Callable

import networkx
import numpy as np
import scipy.sparse as sp
from irregular import largest_piece
from numpy.typing import NDArray

from dense_mesh import signed_areas
from domains import bisected, cut_cells, stairs
from glued import glued
from meshes import Specimen, delaunay, random_mesh, specimen
from vanishing import Mesh, forgotten, refined, squares, triangular_holes, used


def pierced(rng: np.random.Generator) -> Mesh:
    """Every eighth triangle removed, of random or jittered points."""
    n = int(rng.integers(100, 800))
    if rng.random() < 0.5:
        points, triangles = random_mesh(n, int(rng.integers(10**6)), holes=False)
    else:
        points, triangles = delaunay(rng.random((n, 2)), longest=4 / np.sqrt(n))
    return without(points, triangles, rng, 1 / 8)


def crossed(rng: np.random.Generator) -> Mesh:
    """Crossed squares, of which a random part is left."""
    return squares(_mask(rng, 2, 9, rng.uniform(0, 0.7)), crossed=True)


def kites(rng: np.random.Generator) -> Mesh:
    """Four right triangles of arbitrary legs about each of some points, every other one of a grid of uneven steps."""
    k, m = rng.integers(3, 12, 2)
    x, y = (np.cumsum(rng.uniform(0.5, 1.5, count)) for count in (k, m))
    i, j = (index.ravel() for index in np.meshgrid(np.arange(1, k - 1), np.arange(1, m - 1), indexing="ij"))
    hub = ((i + j) % 2 == 0) & (rng.random(len(i)) >= rng.uniform(0, 0.6))
    hub[0] |= not hub.any()
    i, j = i[hub], j[hub]
    rim = [(i + 1) * m + j, i * m + j + 1, (i - 1) * m + j, i * m + j - 1]
    triangles = [np.column_stack([i * m + j, one, two]) for one, two in zip(rim, [*rim[1:], rim[0]], strict=True)]
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return used(points, np.concatenate(triangles))


def lattice(rng: np.random.Generator) -> Mesh:
    """Lattices of equilateral, right or arbitrary triangles with many holes, and pieces that hang by a vertex."""
    k = int(rng.integers(4, 14))
    x, y = np.meshgrid(np.arange(k), np.arange(k), indexing="ij")
    number = np.arange(k * k).reshape(k, k)
    points = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    kind = rng.integers(3)
    if kind != 1:
        points = points @ np.array([[1, 0], [0.5, np.sqrt(0.75)]])
    if kind == 2:
        points += rng.uniform(-0.2, 0.2, points.shape)
    a, b, c, d = (q.ravel() for q in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.column_stack([a, b, d]), np.column_stack([b, c, d])])
    return without(points, triangles, rng, rng.uniform(0.05, 0.45))


def ring(rng: np.random.Generator) -> Mesh:
    """A ring one element wide."""
    n = int(rng.integers(3, 60))
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    inner = np.column_stack([np.cos(angle), np.sin(angle)])
    angle += rng.uniform(0, 0.6) * 2 * np.pi / n
    outer = rng.uniform(1.3, 2, (n, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    i = np.arange(n)
    j = (i + 1) % n
    triangles = np.concatenate([np.column_stack([i, n + i, j]), np.column_stack([n + i, n + j, j])])
    while not (signed_areas(np.concatenate([inner, outer]) @ [1, 1j], triangles) > 0).all():  # some fold over
        outer *= 1.2
    return np.concatenate([inner, outer]), triangles


def grid(rng: np.random.Generator) -> Mesh:
    """Rectangles, of which a random part is left."""
    return squares(_mask(rng, 3, 14, rng.uniform(0, 0.35)), width=rng.uniform(0.3, 3))


def adaptive(rng: np.random.Generator) -> Mesh:
    """Right triangles refined around random points."""
    return refined(int(rng.integers(2, 6)), int(rng.integers(10**6)))


def separate_holes(rng: np.random.Generator) -> Mesh:
    """Triangular holes that share no vertex."""
    n = int(rng.integers(100, 900))
    return triangular_holes(n, int(n * rng.uniform(0, 0.12)), int(rng.integers(10**6)))


def riddled(rng: np.random.Generator) -> Mesh:
    """A third of all triangles removed, or as many as can be, no two of which share an edge."""
    n = int(rng.integers(500, 1500))
    if rng.random() < 0.5:
        points, triangles = random_mesh(n, int(rng.integers(10**6)), holes=False)
    else:
        points, triangles = delaunay(rng.random((n, 2)), longest=4 / np.sqrt(n))
    return with_many_holes(points, triangles, rng, rng.choice([1 / 3, 1 / 2]))


def gnawed(rng: np.random.Generator) -> Mesh:
    """A third of all triangles removed, whether they share edges or not, the others being one piece."""
    points, triangles = random_mesh(int(rng.integers(300, 1200)), int(rng.integers(10**6)), holes=False)
    return used(points, without_leaves(triangles, rng, len(triangles) // 3))


def without_leaves(triangles: NDArray, rng: np.random.Generator, count: int) -> NDArray:
    """Some triangles fewer: each is a leaf of what is left of a random tree in which neighbours are joined."""
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
    of_side: dict[tuple[int, int], list[int]] = {}
    for k, side in enumerate(sides.tolist()):
        of_side.setdefault(tuple(side), []).append(k // 3)
    pairs = (pair for pair in of_side.values() if len(pair) == 2)
    dual = networkx.Graph([(a, b, {"weight": rng.random()}) for a, b in pairs])
    tree = networkx.minimum_spanning_tree(dual)
    while count > 0:
        leaves = rng.permutation([k for k, degree in tree.degree if degree == 1])[: max(count // 2, 1)]
        tree.remove_nodes_from(leaves.tolist())
        count -= len(leaves)
    return triangles[sorted(tree.nodes)]


def polygon(rng: np.random.Generator) -> Mesh:
    """A polygon divided at random."""
    n = int(rng.integers(3, 30))
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    points = np.column_stack([rng.uniform(0.5, 1.5) * np.cos(angle), np.sin(angle)])

    def divided(corners: list[int]) -> list[list[int]]:
        if len(corners) < 3:
            return []
        k = int(rng.integers(1, len(corners) - 1))
        apex = [corners[0], corners[k], corners[-1]]
        return [apex, *divided(corners[: k + 1]), *divided(corners[k:])]

    return points, np.array(divided(list(range(n))))


def scattered(rng: np.random.Generator) -> Mesh:
    """Delaunay triangles of few random points, long ones left out."""
    return delaunay(rng.random((int(rng.integers(4, 200)), 2)), longest=rng.uniform(0.15, 2))


def integer(rng: np.random.Generator) -> Mesh:
    """Delaunay triangles of points of an integer grid: cells of up to eight corners, right angles at the boundary."""
    side = int(rng.integers(4, 20))
    points = np.unique(rng.integers(0, side, (side * side // 2, 2)), axis=0).astype(np.float64)
    points, triangles = delaunay(points)
    middle = points[triangles].mean(axis=1)
    for hole in rng.uniform(0, side, (int(rng.integers(4)), 2)):
        keep = np.linalg.norm(middle - hole, axis=1) > side / 10
        middle, triangles = middle[keep], triangles[keep]
    return used(points, triangles)


def perforated(rng: np.random.Generator) -> Mesh:
    """The same of few points, up to a fifth of the triangles removed: what is left of a cell has vanished sides."""
    side = int(rng.integers(5, 13))
    points = np.unique(rng.integers(0, side, (side * side // 2, 2)), axis=0).astype(np.float64)
    points, triangles = without(*delaunay(points), rng, rng.uniform(0.05, 0.2))
    return used(points, largest_piece(triangles))


FAMILIES: dict[str, Callable[[np.random.Generator], Mesh]] = {
    family.__name__: family
    for family in (
        pierced,
        crossed,
        kites,
        lattice,
        ring,
        grid,
        adaptive,
        separate_holes,
        riddled,
        gnawed,
        polygon,
        scattered,
        integer,
        perforated,
        glued,
        cut_cells,
        stairs,
        bisected,
    )
}


def member(family: str, seed: int, order: int = 0) -> tuple[Specimen, float]:
    """The matrix of one of them without its vanished entries, and its c; rows and c depend on `order` as well."""
    rng = np.random.default_rng(seed)
    c = float(rng.choice([1.0, -2.5, 1e-3]))
    mesh = FAMILIES[family](rng)
    if order:
        other = np.random.default_rng([seed, order])
        c, seed = float(np.exp(other.normal())), int(other.integers(2**32))
    return forgotten(specimen(*mesh, c=c, seed=seed)), c


def tree(n: int, seed: int = 0) -> sp.csr_array:
    """A random tree with random weights."""
    rng = np.random.default_rng(seed)
    parent = np.array([rng.integers(k) for k in range(1, n)])
    return _weighted(n, np.column_stack([parent, np.arange(1, n)]), rng.uniform(0.2, 2, n - 1))


def dodecahedron(_: int, __: int = 0) -> sp.csr_array:
    """Twelve pentagons, all weights 1."""
    edges = np.array(networkx.dodecahedral_graph().edges)
    return _weighted(20, edges, np.ones(len(edges)))


def planar_graph(n: int, seed: int = 0) -> sp.csr_array:
    """A triangulation without a third of its edges, random weights."""
    rng = np.random.default_rng(seed)
    _, triangles = delaunay(rng.random((n, 2)))
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    edges = edges[rng.random(len(edges)) < 2 / 3]
    return _weighted(n, edges, rng.uniform(0.2, 2, len(edges)))


def random_grid(n: int, seed: int = 0) -> sp.csr_array:
    """A square grid, random weights."""
    k = round(np.sqrt(n))
    edges = np.array(networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(k, k)).edges)
    return _weighted(k * k, edges, np.random.default_rng(seed).uniform(0.2, 2, len(edges)))


def cactus(n: int, seed: int = 0) -> sp.csr_array:
    """Cycles that hang together by single vertices, random weights."""
    rng = np.random.default_rng(seed)
    edges, count = [], 1
    while count < n:
        first, k = int(rng.integers(count)), int(rng.integers(3, 9))
        cycle = [first, *range(count, count + k - 1)]
        edges += list(zip(cycle, cycle[1:] + cycle[:1], strict=True))
        count += k - 1
    return _weighted(count, np.array(edges), rng.uniform(0.2, 2, len(edges)))


HOPELESS: dict[str, Callable[[int, int], sp.csr_array]] = {
    matrix.__name__: matrix for matrix in (tree, dodecahedron, planar_graph, random_grid, cactus)
}


def without(points: NDArray, triangles: NDArray, rng: np.random.Generator, share: float) -> Mesh:
    """A mesh without a share of its triangles, one at least being left."""
    keep = rng.random(len(triangles)) >= share
    keep[0] |= not keep.any()
    return used(points, triangles[keep])


def with_many_holes(points: NDArray, triangles: NDArray, rng: np.random.Generator, share: float) -> Mesh:
    """A mesh without a share of its triangles, or fewer, chosen at random among those whose sides are all inner yet."""
    _, side = np.unique(np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [len(points), 1], return_inverse=True)
    side = side.reshape(-1, 3)
    inner = np.bincount(side.ravel()) == 2
    keep, left = np.ones(len(triangles), dtype=bool), round(share * len(triangles))
    for k in rng.permutation(len(triangles)):
        if left and inner[side[k]].all():
            inner[side[k]] = keep[k] = False
            left -= 1
    return used(points, triangles[keep])


def _mask(rng: np.random.Generator, least: int, most: int, share: float) -> NDArray[np.bool_]:
    mask = rng.random(tuple(rng.integers(least, most, 2))) >= share
    mask[0, 0] |= not mask.any()
    return mask


def _weighted(n: int, edges: NDArray, weights: NDArray) -> sp.csr_array:
    """Minus a graph's weights, rows in their order."""
    i, j = edges.T
    return sp.coo_array((-np.tile(weights, 2), (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
