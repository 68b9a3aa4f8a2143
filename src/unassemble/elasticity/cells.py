"""Elements, recognised by re-assembly.

Candidates for cells are cliques of the graph. With the positions known, the matrix is linear in the Lame coefficients
of each; the residual of the fit is the certificate. Material may differ from cell to cell.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .cliques import Graph, shared_cliques, simplices, straight_simplices
from .entries import Entries, Pairs
from .kinds import KINDS, Kind
from .materials import fits
from .moduli import FITS, Fit, Model
from .nodal import NodalMatrix, determined
from .ordering import ordered
from .piercing import unpierced
from .surface import contested, tiles

_EMPTY = 1e-7  # of the largest coefficient; candidates below carry no material
_COVERED = 0.5  # of the nodes: what cells have to touch before they are tried
_LINEAR = {2: 8, 3: 20}  # blocks per row, at most, in meshes of linear simplices; others have too many cliques to try


@dataclass(frozen=True, eq=False)
class Cells:
    """Elements of a mesh.

    Attributes
    ----------
    kind : str
        meshio's name; empty where no element was recognised.
    cells : (m, k) int64
        Nodes, in meshio's order, positively oriented.
    lame : (m, 2) float64
        lambda and mu of each cell, up to one common factor (the unknown size of the body); empty where they are not
        known.
    backward_error : float
        Largest difference between an entry and the re-assembled one, relative to the largest off-diagonal entry of
        its row; NaN where the cells were read off the graph only.
    varying : bool
        Whether material differs within cells, at the points of the quadrature; `lame` then has the means.
    """

    kind: str
    cells: NDArray[np.int64]
    lame: NDArray[np.float64]
    backward_error: float
    varying: bool = False

    @property
    def recognised(self) -> bool:
        """Whether there are cells."""
        return bool(self.kind)

    @property
    def certified(self) -> bool:
        """Whether the cells re-assemble to the given matrix."""
        return self.recognised and bool(np.isfinite(self.backward_error))

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return len(self.cells)


def no_cells(d: int) -> Cells:
    """Nothing recognised."""
    return Cells("", np.empty((0, d + 1), np.int64), np.empty((0, 2)), float("nan"))


def recognise_cells(nodal: NodalMatrix, points: NDArray[np.float64], ratio: float | None = None) -> Cells:
    """Find cells of one kind that re-assemble to the matrix: simplices or boxes, linear or quadratic.

    With lambda / mu known to be one number, `ratio`, linear simplices of one material are tried first, which is quick.
    Where no material fits, boxes and quadratic cells that lie side by side and of which each entry belongs to one at
    least are returned all the same, without certificate.

    Entries between two nodes that both miss a neighbour are left out, since cells that lost a node to a support
    contribute to them. Cells all of whose entries are left out cannot be seen and are not reported.
    """
    d = nodal.dim
    graph = _graph(nodal, points)
    entries = Entries.of(nodal)
    plain = no_cells(d)
    if not len(entries.key):
        return plain
    for kind, sets in _candidates(graph, points, d):
        cells = ordered(sets, points, kind)
        if kind.linear_simplex:
            cells = _without_pierced(kind, cells, points, graph)
        told = entries.explained_by(Pairs.of(cells, entries), FITS)
        if told is None or not len(told.key):
            continue
        cells = cells[Pairs.of(cells, told).seen]
        for model, fit in fits(points, cells, kind, told, ratio):
            found = _accepted(model, fit)
            if found is not None:
                return found
        if not plain.recognised:
            plain = _by_graph(kind, cells)
    return plain


def _graph(nodal: NodalMatrix, points: NDArray) -> Graph:
    """Pairs of determined nodes with an entry."""
    known = determined(points)
    live = (np.abs(nodal.data).max(axis=(1, 2)) > 1e-13 * nodal.size[nodal.node]) & known[nodal.node]
    live &= known[nodal.indices]
    return Graph(sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n,) * 2))


def _candidates(graph: Graph, points: NDArray, d: int) -> Iterator[tuple[Kind, NDArray[np.int64]]]:
    """Sets of nodes that could be the cells of a kind, those of most nodes first."""
    known = int(determined(points).sum())
    for kind in sorted((kind for kind in KINDS.values() if kind.dim == d), key=lambda kind: -kind.nodes):
        if kind.linear_simplex:
            pattern = len(graph.row) + graph.n
            if pattern <= graph.n * _LINEAR[d]:
                yield kind, simplices(graph, d)
            continue
        sets = shared_cliques(graph, kind.nodes)
        if kind.name == "triangle6":
            sets = np.unique(np.vstack([sets, straight_simplices(graph, points, d)]), axis=0)
        if len(np.unique(sets)) > _COVERED * known:
            yield kind, sets


def _without_pierced(kind: Kind, cells: NDArray[np.int64], points: NDArray, graph: Graph) -> NDArray[np.int64]:
    """Cliques that may be cells; only those that overlap others need a look."""
    doubtful = np.flatnonzero(contested(kind.base, cells))
    return np.delete(cells, doubtful[~unpierced(cells[doubtful], points, graph)], axis=0)


def _by_graph(kind: Kind, cells: NDArray[np.int64]) -> Cells:
    """Cells without certificate, if they lie side by side; cliques of linear simplices are no evidence."""
    if kind.linear_simplex or not len(cells) or not tiles(kind.base, cells[:, : kind.corners]):
        return no_cells(kind.dim)
    return Cells(kind.name, cells, np.empty((0, 2)), float("nan"))


def _accepted(model: Model, fit: Fit) -> Cells | None:
    """Cells that carry material, if they fit, have shear moduli of one sign and do not overlap; made-up ones do.

    A quadratic triangle, for one, is a combination of small linear ones and a large one with a negative modulus.
    """
    kind, lame = model.kind, fit.lame
    if not fit.misfit <= FITS or not lame.any():
        return None
    carries = np.abs(lame).max(axis=1) > _EMPTY * np.abs(lame).max()
    cells, lame = model.cells[carries], lame[carries]
    mu = lame[:, 1]
    if not ((mu > 0).all() or (mu < 0).all()) or not tiles(kind.base, cells[:, : kind.corners]):
        return None
    return Cells(kind.name, cells, lame, fit.misfit, model.varying)
