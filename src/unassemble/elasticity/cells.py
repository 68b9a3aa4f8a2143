"""Elements, recognised by re-assembly.

With the positions known, the matrix is linear in the Lame coefficients of the cells: each candidate, a clique of the
graph,
gets two unknowns, and a sparse least-squares problem on the entries between nodes tells which candidates carry
material.
The residual is the certificate. Material may differ from cell to cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..linalg import threads
from .cliques import Graph, boxes, ordered_boxes, simplices
from .elements import element_blocks
from .homogeneous import reassembled
from .nodal import NodalMatrix, determined, valid_pairs
from .surface import tiles

_KINDS = {2: ("triangles", "quads"), 3: ("tetrahedra", "hexahedra")}
MESHIO = {"triangles": "triangle", "quads": "quad", "tetrahedra": "tetra", "hexahedra": "hexahedron"}
_FITS = 1e-9
_EMPTY = 1e-7  # of the largest coefficient; candidates below carry no material
_LINEAR = {2: 8, 3: 20}  # blocks per row, at most, in meshes of linear simplices; others have too many cliques to try
_MOST = 400_000  # candidates beyond which nobody waits for the answer


@dataclass(frozen=True, eq=False)
class Cells:
    """Elements of a mesh.

    Attributes
    ----------
    kind : {"", "triangles", "quads", "tetrahedra", "hexahedra"}
        Empty where no element was recognised.
    cells : (m, k) int64
        Nodes, in meshio's order, positively oriented.
    lame : (m, 2) float64
        lambda and mu of each cell, up to one common factor (the unknown size of the body).
    backward_error : float
        Largest difference between an entry and the re-assembled one, relative to the largest off-diagonal entry of
        its row.
    """

    kind: str
    cells: NDArray[np.int64]
    lame: NDArray[np.float64]
    backward_error: float

    @property
    def recognised(self) -> bool:
        """Whether the cells re-assemble to the given matrix."""
        return bool(self.kind)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return len(self.cells)


def no_cells(d: int) -> Cells:
    """Nothing recognised."""
    return Cells("", np.empty((0, d + 1), np.int64), np.empty((0, 2)), float("nan"))


def recognise_cells(nodal: NodalMatrix, points: NDArray[np.float64], ratio: float | None = None) -> Cells:
    """Find linear simplices, or multilinear boxes, that re-assemble to the matrix.

    With lambda / mu known to be one number, `ratio`, one material is tried first, which is quick.

    Entries between two nodes that both miss a neighbour are left out, since cells that lost a node to a support
    contribute to them. Cells all of whose entries are left out cannot be seen and are not reported.
    """
    d = nodal.dim
    known = determined(points)
    live = (np.abs(nodal.data).max(axis=(1, 2)) > 1e-13 * nodal.size[nodal.node]) & known[nodal.node]
    live &= known[nodal.indices]
    pattern = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    if pattern.nnz <= nodal.n:
        return no_cells(d)
    graph = Graph(pattern)
    entries = _Entries.of(nodal)
    box = boxes(graph, d) if pattern.nnz <= nodal.n * 3**d else np.empty((0, 2**d), np.int64)
    if len(box) and len(np.unique(box)) > 0.9 * known.sum() and len(box) < _MOST // 4:
        box = ordered_boxes(box, points)
        for order in (2, 3, 4, 1):
            found = _fit(nodal, points, box, order, entries, _KINDS[d][1], ratio)
            if found.recognised:
                return found
    if nodal.n * (2 if d == 2 else 8) > _MOST or pattern.nnz > nodal.n * _LINEAR[d]:
        return no_cells(d)
    return _fit(nodal, points, _oriented(simplices(graph, d), points), 1, entries, _KINDS[d][0], ratio)


@dataclass(frozen=True, eq=False)
class _Entries:
    """Blocks above the diagonal that complete cells alone explain."""

    key: NDArray[np.int64]
    value: NDArray[np.float64]
    size: NDArray[np.float64]

    @classmethod
    def of(cls, nodal: NodalMatrix) -> _Entries:
        complete = np.asarray(valid_pairs(nodal).all(axis=(1, 2)))
        i, j = nodal.node.astype(np.int64), nodal.indices.astype(np.int64)
        off = np.abs(nodal.data).max(axis=(1, 2))
        off[i == j] = 0
        largest = np.maximum.reduceat(off, nodal.indptr[:-1])
        use = (i < j) & (complete[i] | complete[j])
        return cls(i[use] * nodal.n + j[use], nodal.data[use], np.minimum(largest[i[use]], largest[j[use]]))


def _oriented(cells: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Positive simplices; flat ones are left out."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    volume = np.linalg.det(edges)
    size = np.linalg.norm(edges, axis=2).max(axis=1) ** points.shape[1]
    cells = cells[np.abs(volume) > 1e-9 * size]
    mirrored = volume[np.abs(volume) > 1e-9 * size] < 0
    cells[mirrored, -2:] = cells[mirrored, -1:-3:-1]
    return cells


def _homogeneous(
    points: NDArray, cells: NDArray, order: int, entries: _Entries, kind: str, ratio: float
) -> Cells | None:
    """All candidates, of one material; None where they do not fit."""
    blocks, seen = reassembled(points, cells, order, ratio, entries.key)
    square = float((blocks * blocks).sum())
    if not square:
        return None
    mu = float((blocks * entries.value).sum()) / square
    error = float(np.abs((mu * blocks - entries.value) / entries.size[:, None, None]).max())
    lame = np.tile([ratio * mu, mu], (int(seen.sum()), 1))
    if not error <= _FITS or not _are_elements(kind, cells[seen], lame):
        return None
    return Cells(kind, cells[seen], lame, error)


def _fit(
    nodal: NodalMatrix,
    points: NDArray,
    cells: NDArray,
    order: int,
    entries: _Entries,
    kind: str,
    ratio: float | None,
) -> Cells:
    """One material, or least squares for the coefficients of all candidates."""
    d = nodal.dim
    if not len(cells) or not len(entries.key):
        return no_cells(d)
    found = None if ratio is None else _homogeneous(points, cells, order, entries, kind, ratio)
    if found is not None:
        return found
    operator = _assembly(nodal, points, cells, order, entries)
    target = (entries.value / entries.size[:, None, None]).ravel()
    weight = np.sqrt(np.asarray(operator.power(2).sum(axis=0)).ravel())
    seen = weight > 0
    scaled = operator[:, np.flatnonzero(seen)] @ sp.diags_array(1 / weight[seen])
    with threads(1):  # its many short vectors are not worth waking threads for
        answer = sp.linalg.lsmr(scaled, target, atol=1e-15, btol=1e-15, conlim=0, maxiter=600)[0]
    lame = np.zeros(2 * len(cells))
    lame[seen] = answer / weight[seen]
    error = float(np.abs(operator @ lame - target).max())
    pairs = lame.reshape(-1, 2)
    carries = np.abs(pairs).max(axis=1) > _EMPTY * np.abs(pairs).max()
    if not error <= _FITS or not _are_elements(kind, cells[carries], pairs[carries]):
        return no_cells(d)
    return Cells(kind, cells[carries], pairs[carries], error)


def _are_elements(kind: str, cells: NDArray[np.int64], lame: NDArray[np.float64]) -> bool:
    """Whether cells have shear moduli of one sign and do not overlap; made-up ones do one or the other.

    A quadratic triangle, for one, is a combination of small linear ones and a large one with a negative modulus.
    """
    mu = lame[:, 1]
    return bool((mu > 0).all() or (mu < 0).all()) and tiles(MESHIO[kind], cells)


def _assembly(nodal: NodalMatrix, points: NDArray, cells: NDArray, order: int, entries: _Entries) -> sp.csr_array:
    """(entries d d, 2 cells) what each coefficient adds to each entry, relative to the entry's row."""
    d, k = nodal.dim, cells.shape[1]
    blocks = element_blocks(points, cells, order)
    a, b = np.triu_indices(k, 1)
    i, j = cells[:, a], cells[:, b]
    flip = i > j
    key = np.minimum(i, j) * nodal.n + np.maximum(i, j)
    place = np.minimum(np.searchsorted(entries.key, key), len(entries.key) - 1)
    there = entries.key[place] == key
    rows, columns, values = [], [], []
    for number, block in enumerate(blocks):
        part = block[:, a, b]
        part = np.where(flip[..., None, None], part.transpose(0, 1, 3, 2), part)
        part = part / entries.size[place][..., None, None]
        cell = np.broadcast_to(np.arange(len(cells))[:, None], key.shape)[there]
        rows.append((place[there][:, None] * d * d + np.arange(d * d)).ravel())
        columns.append(np.repeat(2 * cell + number, d * d))
        values.append(part[there].reshape(-1))
    shape = (len(entries.key) * d * d, 2 * len(cells))
    return sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
