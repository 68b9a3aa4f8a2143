"""Elements, recognised by re-assembly.

Candidates for cells are cliques of the graph. With the positions known, the matrix is linear in the Lame coefficients
of each; the residual of the fit is the certificate. Material may differ from cell to cell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...elements.candidates import Block, candidates
from ...elements.cliques import Graph
from ...elements.surface import tiles
from ...nodes.nodal import NodalMatrix, determined, surrounded, valid_pairs
from ...tolerances import CERTIFIED, LAST_DIGITS
from .entries import BlockEntries, Pairs
from .fits import fits


@dataclass(frozen=True, eq=False)
class RecognisedCells:
    """Elements of a mesh."""

    # (m, k) by kind, meshio's names and order, positively oriented; empty where none was recognised
    blocks: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    # (n_cells, 2) lambda and mu, up to the unknown size of the body; empty where they are not known
    lame: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    # largest difference between an entry and the re-assembled one, relative to the largest of its row
    backward_error: float = float("nan")
    shown: NDArray[np.bool_] | None = None  # (n, d) unknowns whose row has an entry that re-assembles and is not zero
    hidden: int = 0  # cells so weak beside others of their nodes that rounding hides their material

    @property
    def certified(self) -> bool:
        """Whether the cells re-assemble to the given matrix."""
        return bool(self.blocks) and bool(np.isfinite(self.backward_error))

    def among(self, nodes: NDArray[np.bool_]) -> RecognisedCells:
        """The cells all of whose nodes are among some, (n,) bool."""
        kept = [nodes[cells].all(axis=1) for cells in self.blocks.values()]
        if all(some.all() for some in kept):
            return self
        parts = zip(self.blocks.items(), kept, strict=True)
        blocks = {kind: cells[some] for (kind, cells), some in parts if some.any()}
        lame = self.lame[np.concatenate(kept)] if len(self.lame) else self.lame
        return replace(self, blocks=blocks, lame=lame)


def coupled(nodal: NodalMatrix, points: NDArray[np.float64], least: float = LAST_DIGITS) -> Graph:
    """Pairs of determined nodes with an entry that is not zero, or that lack some, which may not have been zero.

    Zero is what is no more than `least` of the rows of both.
    """
    known, lacking = determined(points), np.asarray((nodal.row_of < 0).any(axis=1))
    i, j = nodal.node, nodal.indices
    live = np.abs(nodal.data).max(axis=(1, 2)) > least * np.minimum(nodal.size[i], nodal.size[j])  # symmetric
    live |= lacking[i] | lacking[j]
    live &= known[i] & known[j]
    return Graph(sp.csr_array((np.ones(live.sum()), (i[live], j[live])), shape=(nodal.n,) * 2))


def recognise_cells(
    nodal: NodalMatrix, points: NDArray[np.float64], ratio: float | None = None, allowed: float = CERTIFIED
) -> RecognisedCells:
    """Find cells that re-assemble to the matrix: of one kind, or triangles beside quadrilaterals.

    Entries may be off by what is `allowed`, relative to the largest of their row.

    With lambda / mu known to be one number, `ratio`, linear simplices of one material are tried first, which is quick.
    Where no material fits, boxes and quadratic cells that lie side by side and of which each entry belongs to one at
    least are returned all the same, without certificate.

    Entries between two nodes that both miss a neighbour are left out, since cells that lost a node to a support
    contribute to them. Cells all of whose entries are left out cannot be seen and are not reported. First neighbours
    that lack some of their directions only, as on rollers, and those of nodes with a penalty count as being there,
    which fewer rows can tell.
    """
    graph, known = coupled(nodal, points), determined(points)
    every = coupled(nodal, points, 0.0)  # weak cells between stiff ones may have less than the last digits
    ways = [BlockEntries.of(nodal, known, likely, allowed) for likely in (surrounded(nodal, valid_pairs(nodal)), None)]
    ways = ways if (ways[0].complete != ways[0].sure).any() else ways[:1]
    found = RecognisedCells()
    for couplings in (graph, every) if len(every.row) > len(graph.row) else (graph,):
        for entries in ways:
            other = _recognised(points, couplings, entries, ratio)
            if other.certified:
                return other
            found = found if found.blocks else other
    return found


def _recognised(
    points: NDArray[np.float64], graph: Graph, entries: BlockEntries, ratio: float | None
) -> RecognisedCells:
    """Cells that explain most entries.

    Cells that hide next to supports are excused, and those of another kind must not pass for such.
    """
    best, most = RecognisedCells(), 0
    for blocks in candidates(graph, points) if len(entries.key) else ():
        told = entries.explained_by([Pairs.of(one.cells, entries) for one in blocks], graph)
        if told is None or len(told.key) <= most:
            continue
        seen = [replace(one, cells=one.cells[Pairs.of(one.cells, told).seen]) for one in blocks]
        if not all(len(one.cells) for one in seen):
            continue
        found = next(
            (cells for fit in fits(points, seen, told, ratio) if (cells := _accepted(*fit, told.allowed))), None
        )
        if found is not None:
            best, most = replace(found, shown=told.shown()), len(told.key)
        elif not best.blocks and not any(one.kind.linear_simplex for one in seen) and tiles(_linear(seen)):
            # without certificate; that cliques lie side by side is no evidence of linear simplices
            best = RecognisedCells({one.kind.name: one.cells for one in seen})
        if most == len(entries.key):
            break
    return best


def _linear(blocks: Sequence[Block]) -> dict[str, NDArray[np.int64]]:
    """The linear cells on the same corners."""
    return {one.kind.base: one.cells[:, : one.kind.corners] for one in blocks}


def _accepted(
    blocks: Sequence[Block], lame: NDArray[np.float64], misfit: float, hidden: int, allowed: float
) -> RecognisedCells | None:
    """Cells that carry material, if they fit, have shear moduli of one sign and do not overlap; made-up ones do.

    A quadratic triangle, for one, is a combination of small linear ones and a large one with a negative modulus.
    """
    if not (misfit <= allowed and lame.any() and np.isfinite(lame).all()):
        return None
    carries = lame.any(axis=1)
    parts = np.split(carries, np.cumsum([len(one.cells) for one in blocks])[:-1])
    blocks = [replace(one, cells=one.cells[part]) for one, part in zip(blocks, parts, strict=True) if part.any()]
    mu = lame[carries, 1]
    if not ((mu > 0).all() or (mu < 0).all()) or not tiles(_linear(blocks)):
        return None
    return RecognisedCells({one.kind.name: one.cells for one in blocks}, lame[carries], misfit, hidden=hidden)
