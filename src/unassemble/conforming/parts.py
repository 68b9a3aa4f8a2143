"""Cells cut into edge-connected parts, oriented, each in a numbering of its own."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.kinds import Kind
from ..errors import TopologyError
from ..matrix import OperatorMatrix
from ..topology import Piece
from ..topology.keys import distinct, found, pair_keys, with_sides
from ..topology.pieces import planar_pieces
from .roles import OrderedCells
from .sets import pairs_of

Blocks = dict[Kind, NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class Part:
    """One edge-connected, oriented part of a mesh; its corners are numbered first."""

    # the part as triangles between corners, quadrilaterals divided; its `vertices` are the rows of all nodes, and its
    # `edges` the sides of cells
    piece: Piece
    n_corners: int
    n_holes: int
    blocks: Blocks  # cells, local nodes, all of one orientation
    edges: NDArray[np.int64]  # (e, 2) pairs i < j of local nodes that a cell has, in lexicographic order
    places: Blocks  # rows of `edges` of all pairs of each cell

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.piece.vertices)

    @property
    def degree(self) -> int:
        """Of the elements, along a side."""
        return max(kind.degree for kind in self.blocks)

    @property
    def rows(self) -> NDArray[np.int64]:
        """(e, 2) rows of the matrix that the edges join."""
        return self.piece.vertices[self.edges]

    def stored_in(self, matrix: OperatorMatrix) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """(e,) places of the edges among those of a matrix, and whether they are there."""
        return found(matrix.edges @ [matrix.n, 1], pair_keys(matrix.n, *self.rows.T))

    def from_corners(self) -> sp.csr_array:
        """(n, n_corners) nodes of straight cells as means of corners."""
        rows, columns, values = [np.arange(self.n_corners)], [np.arange(self.n_corners)], [np.ones(self.n_corners)]
        seen = np.zeros(self.n, dtype=bool)
        seen[: self.n_corners] = True
        for kind, cells in self.blocks.items():
            for k, some in enumerate(kind.between, kind.corners):
                node, first = np.unique(cells[:, k], return_index=True)
                new = ~seen[node]
                node, first = node[new], first[new]
                seen[node] = True
                for corner in some:
                    rows.append(node)
                    columns.append(cells[first, corner])
                    values.append(np.full(len(node), 1 / len(some)))
        place = np.concatenate(rows), np.concatenate(columns)
        return sp.csr_array((np.concatenate(values), place), shape=(self.n, self.n_corners))


def parts_of(shown: OrderedCells) -> list[Part]:
    """The parts of cells in any orientation, in order of their lowest row.

    Nodes are numbered in the order that the cells come with.

    Raises TopologyError if cells do not glue together to surfaces in the plane.
    """
    n = len(shown.order)
    number = np.empty(n, dtype=np.int64)
    number[shown.order] = np.arange(n)
    blocks = {kind: number[cells] for kind, cells in shown.blocks.items()}
    corner, between = np.zeros((2, n), dtype=bool)
    for kind, cells in blocks.items():
        corner[cells[:, : kind.corners]], between[cells[:, kind.corners :]] = True, True
    if (corner & between).any():
        raise TopologyError("rows are corners of some cells and lie between corners of others")
    halves = [0, 1, 2, 0, 2, 3]
    triangles = np.concatenate([cells[:, halves[: 3 * k.corners - 6]].reshape(-1, 3) for k, cells in blocks.items()])
    edges, _, opposite = with_sides(n, np.empty((0, 2), np.int64), triangles)
    pieces = planar_pieces(n, edges, triangles, opposite)
    if not pieces:
        raise TopologyError("the cells that the rows form do not glue together to a surface in the plane")
    label = np.random.default_rng(0).integers(0, 2**63, n, dtype=np.uint64)  # the sum of three tells a triangle
    glued = np.concatenate([piece.vertices[piece.triangles] for piece in pieces])
    owner = np.repeat(np.arange(len(pieces)), [len(piece.triangles) for piece in pieces])
    key = label[glued].sum(axis=1)
    order = np.argsort(key)
    own: list[Blocks] = [{} for _ in pieces]
    for kind, cells in blocks.items():
        place = order[np.searchsorted(key, label[cells[:, :3]].sum(axis=1), sorter=order)]
        start = (glued[place] == cells[:, :1]).argmax(axis=1)
        turned = glued[place, (start + 1) % 3] != cells[:, 1]
        oriented = np.where(turned[:, None], cells[:, reversal(kind)], cells)
        for k, some in enumerate(own):
            some[kind] = oriented[owner[place] == k]
    parts = [_part(shown.order, piece, some) for piece, some in zip(pieces, own, strict=True)]
    return sorted(parts, key=lambda part: int(part.piece.vertices.min()))


def reversal(kind: Kind) -> list[int]:
    """Places of a cell's nodes in the same cell seen from the other side."""
    corner = [0, *range(kind.corners - 1, 0, -1)]
    between = [tuple(sorted(some)) for some in kind.between]
    return corner + [kind.corners + between.index(tuple(sorted(corner[c] for c in some))) for some in kind.between]


def _part(order: NDArray[np.int64], piece: Piece, blocks: Blocks) -> Part:
    """A part in a numbering of its own, corners as the piece has them and all other nodes after these."""
    blocks = {kind: cells for kind, cells in blocks.items() if len(cells)}
    corners = piece.vertices
    number = np.full(len(order), -1)
    number[corners] = np.arange(len(corners))
    rest = distinct(np.concatenate([cells[:, kind.corners :].ravel() for kind, cells in blocks.items()]))
    number[rest] = len(corners) + np.arange(len(rest))
    local = {kind: number[cells] for kind, cells in blocks.items()}
    count = len(corners) + len(rest)
    pairs = [pairs_of(count, cells) for cells in local.values()]
    keys, place = np.unique(np.concatenate([some.ravel() for some in pairs]), return_inverse=True)
    places = np.split(place, np.cumsum([some.size for some in pairs])[:-1])
    rings = [cells[:, : kind.corners] for kind, cells in local.items()]
    sides = distinct(np.concatenate([pair_keys(count, ring, np.roll(ring, -1, axis=1)).ravel() for ring in rings]))
    vertices = order[np.concatenate([corners, rest])]
    return Part(
        replace(piece, vertices=vertices, edges=np.column_stack([sides // count, sides % count])),
        len(corners),
        piece.n_holes,
        local,
        np.column_stack([keys // count, keys % count]),
        {kind: rows.reshape(some.shape) for kind, rows, some in zip(local, places, pairs, strict=True)},
    )
