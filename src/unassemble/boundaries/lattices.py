"""Scalar matrices that are a part of a grid."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..cells.undivided import undivided
from ..certify import Terms, certify
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import ConformingMesh, PlanarMesh
from ..scalar.joined import joined
from ..scalar.notes import vanished_notes
from ..scalar.placement import Placement
from ..tolerances import CERTIFIED
from ..topology import Topology
from ..topology.keys import contains, distinct, pair_keys, with_sides
from ..topology.pieces import planar_pieces
from ..words import count_of
from .lattice import Lattice

_RULES = {"quad": "2 x 2 Gauss", "triangle": "degree 2"}


def recover_lattice(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh | None:
    """The grid that a matrix is a part of, certified; None where there is none.

    Its cells are continued by those whose vertices are gone, or have rows of the identity, and the mesh of all has the
    other rows of the matrix, entries and diagonal. That such a mesh exists is proved by this; but others may as well,
    with cells that are no parallelograms.
    """
    if matrix.adds_up.all() or options.method != "conformal" or options.noise is not None:
        return None
    n = matrix.n
    kept = np.bincount(matrix.edges.ravel(), minlength=n) > 0  # others are rows of the identity
    if matrix.replaced is not None:
        kept &= ~matrix.replaced
    own = np.flatnonzero(kept)
    with clock("lattice"):
        lattice = Lattice.of(matrix.among(own)) if len(own) else None
        seats = None if lattice is None or len(lattice.z) == len(own) else seated(matrix, own, lattice)
    if lattice is None or seats is None:
        return None
    if options.scale is not None and abs(lattice.scale / options.scale - 1) > CERTIFIED:
        return None
    row, status = seats
    cells = row[lattice.cells]
    topology = _topology(n, matrix.edges[kept[matrix.edges].any(axis=1)], cells, bilinear=lattice.bilinear)
    if topology is None or (topology.multiplicity[own] == 0).any():
        return None
    (piece,), tensor = topology.pieces, placement.tensor
    status[topology.multiplicity == 0] = 1
    with clock("place"):
        placement, loose = placement.upon(topology, [status[piece.vertices] == 0])
        z = np.full(n + int((row >= n).sum()), np.nan, dtype=np.complex128)
        z[row] = (lattice.z - lattice.z.mean()) / np.ptp(lattice.z.real)  # of size one: else digits are lost below
        placed, notes = placement.apply(piece, z[piece.vertices])
        mesh = joined(topology, [placed], np.array([lattice.scale / placement.stretch]), placement.operator)
        affine = np.column_stack([z, np.conj(z), np.ones(len(z))])
        gone = affine[n:] @ np.linalg.lstsq(affine[piece.vertices], placed, rcond=None)[0]
    with clock("certify"):
        points = np.append(mesh.points @ [1, 1j], gone)
        a, b, c = points[cells[0, :3]]
        cells = cells if (np.conj(b - a) * (c - a)).imag > 0 else cells[:, ::-1]  # turned over as a whole
        error = _backward_error(matrix, own, tensor.to_laplacian(points) if tensor else points, cells, lattice)
    if not error <= CERTIFIED:
        return None
    if options.triangulate:
        mesh = mesh.triangulated()
    if lattice.bilinear:
        quads = cells[(cells < n).all(axis=1)]
        more = {"triangles": quads[:0, :3], "quads": quads, "quadrature": _RULES["quad"], "straight": True}
        mesh = ConformingMesh(**(vars(mesh) | more))
    return replace(
        mesh,
        node_status=status,
        status="ambiguous" if lattice.like_mass else "certified",
        uniqueness="ambiguous" if lattice.like_mass else "conventional",
        reason=(
            f"the grid, continued by {count_of(len(gone), 'vertex that has', 'vertices that have')} no row, gives "
            f"the matrix back to {error:.1e} (relative), row sums included"
        ),
        backward_error=error,
        timings=clock.timings,
        warnings=(*matrix.warnings, *_notes(lattice, status), *loose, *notes, *vanished_notes(topology)),
        eliminated_points=np.column_stack([gone.real, gone.imag]),
    )


def _notes(lattice: Lattice, status: NDArray[np.int8]) -> list[str]:
    notes = [
        "this is the only mesh of parallelograms that are all alike, or of halves of these; others, bent next to the "
        "unknowns that were eliminated, may fit as well"
    ]
    if lattice.added.any():
        size = np.median(lattice.added)
        alike = (np.abs(lattice.added - size) <= CERTIFIED * np.abs(size)).all()
        what = f"{size:.6g} times the identity" if alike else "a multiple of the lumped mass matrix"
        notes.append(f"{what} was added to the matrix")
        if lattice.like_mass:
            notes[-1] += "; with a consistent mass matrix in its place triangles of other shapes fit as well"
    if k := int((status == 2).sum()):
        notes.append(
            f"{count_of(k, 'position is', 'positions are')} plausible and no more (`node_status` 2): next to corners, "
            "two rows that were replaced can change places"
        )
    return notes


def _backward_error(
    matrix: OperatorMatrix, own: NDArray[np.int64], z: NDArray, cells: NDArray[np.int64], lattice: Lattice
) -> float:
    """Of entries, and of diagonal entries, which say how much is gone, of the rows `own`, (k,).

    Relative to the largest off-diagonal entry of each row; infinite where a cell is flat or turned over. `z` are the
    points that the Laplacian has, those of the vertices that are gone last.
    """
    diagonal, size = np.zeros(len(z)), np.full(len(z), np.inf)
    diagonal[own], size[own] = matrix.diagonal[own] - lattice.added, matrix.row_size[own]
    name, shapes = ("quad", cells) if lattice.bilinear else ("triangle", _divided(cells))
    points, factors = np.column_stack([z.real, z.imag]), {name: np.full(len(shapes), lattice.scale)}
    found = certify(matrix.edges, matrix.entries, points, {name: shapes}, factors, rules=_RULES, terms=Terms(diagonal))
    errors = np.abs(found.differences) / size[found.pairs].min(axis=1)
    return np.inf if len(found.flipped) else float(errors[(found.pairs < matrix.n).all(axis=1)].max())


def _topology(n: int, stored: NDArray[np.int64], cells: NDArray[np.int64], *, bilinear: bool) -> Topology | None:
    """The cells that have all their vertices; None unless they are one piece.

    Cells of four that are not `bilinear` are divided as entries are `stored`, (e, 2), or are polygons.
    """
    cells, across = cells[(cells < n).all(axis=1)], np.empty(0, np.int64)
    if cells.shape[1] == 4 and not bilinear:
        key = stored @ [n, 1]
        turned = contains(key, pair_keys(n, cells[:, 1], cells[:, 3]))
        cells = np.where(turned[:, None], np.roll(cells, 1, axis=1), cells)
        across = pair_keys(n, cells[:, 0], cells[:, 2])
        across = distinct(across[~contains(key, across)])
    triangles = _divided(cells)
    edges, _, opposite = with_sides(n, np.empty((0, 2), np.int64), triangles)
    pieces = planar_pieces(n, edges, triangles, opposite)
    if pieces is None or len(pieces) != 1:
        return None
    vanished = np.isin(np.arange(len(edges)), np.searchsorted(edges @ [n, 1], across))
    polygons = undivided(pieces, vanished)[1]
    return Topology(n, edges, pieces, "3-cycles", vanished=np.flatnonzero(vanished), polygons=polygons)


def _divided(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles, with squares (m, 4) divided in two."""
    return cells[:, [0, 1, 2, 0, 2, 3][: 3 * (cells.shape[1] - 2)]].reshape(-1, 3)


Labels = NDArray[np.uint64]


def seated(
    matrix: OperatorMatrix, own: NDArray[np.int64], lattice: Lattice
) -> tuple[NDArray[np.int64], NDArray[np.int8]] | None:
    """Rows of the vertices of a lattice on rows `own`, (k,), and the status of all; None where columns do not fit.

    By the columns that were kept. Two that are the same, as beside a corner of equal squares, can change places, and
    corners may be in no other row; zeros between replaced rows tell these, too, since neighbours are stored only.

    Returns `row` (k + g,) int64, n, n + 1, ... for vertices that have none, and `status` (n,) int8, as in
    :class:`..recovery.Recovery`.
    """
    n, k, size = matrix.n, len(own), matrix.row_size[own]
    beside = np.ones(n, dtype=bool)
    beside[own] = False
    other = np.flatnonzero(beside)
    by_vertex, vertex, labels = _columns(lattice.beyond, size)
    by_row, column, given = _columns(matrix.csr()[own][:, other], size)
    status = beside.astype(np.int8)
    seat = np.full(len(by_vertex), -1)
    if len(column):
        if not np.array_equal(labels, given):
            return None
        number = np.cumsum(beside) - 1
        stored = number[matrix.edges[beside[matrix.edges].all(axis=1)]]
        _seat(seat, by_vertex, by_row, lattice.cells - k, stored)
        status[other[seat[seat >= 0]]] = 0
        left, free = vertex[seat[vertex] < 0], column[~np.isin(column, seat)]
        seat[left], status[other[free]] = free, 2
    row = np.concatenate([own, np.append(other, -1)[seat]])
    gone = row < 0
    row[gone] = n + np.arange(int(gone.sum()))
    return row, status


def _columns(entries: sp.csr_array, size: NDArray[np.float64]) -> tuple[Labels, NDArray[np.int64], Labels]:
    """Labels of columns, (g,), 0 for empty ones; the others, (h,), in the order of labels and entries; and theirs.

    Labels are the same for columns that have the same entries, in rows of entries of `size`, (k,).
    """
    rng = np.random.default_rng(0)
    label, weight = rng.integers(2**63, size=len(size), dtype=np.uint64), rng.uniform(1, 2, len(size))
    found = entries.tocoo()
    some = np.abs(found.data) > CERTIFIED * size[found.row]
    row, column = found.row[some], found.col[some]
    labels = np.zeros(entries.shape[1], np.uint64)
    np.add.at(labels, column, label[row])
    value, near = (np.bincount(column, weight[row] * part, len(labels)) for part in (found.data[some], size[row]))
    order = np.lexsort((value, labels))
    order = order[labels[order] > 0]
    larger = np.diff(value[order], prepend=-np.inf) > CERTIFIED * near[order]
    labels[order] += np.cumsum(larger).astype(np.uint64)
    return labels, order, labels[order]


def _seat(
    seat: NDArray[np.int64], by_vertex: Labels, by_row: Labels, cells: NDArray[np.int64], stored: NDArray[np.int64]
) -> None:
    """Fill in the rows of vertices, (g,), as long as labels and seated neighbours tell one row and one vertex.

    `by_vertex` (g,) and `by_row` (r,) are labels, `stored` (e, 2) pairs of rows; corners of `cells` (m, k) that are
    none of these vertices are negative.
    """
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = distinct(pair_keys(len(seat), *sides[(sides >= 0).all(axis=1)].T))
    sides = np.column_stack(np.divmod(keys, len(seat)))
    label = np.random.default_rng(1).integers(2**63, size=len(by_row), dtype=np.uint64)
    at = np.full(len(by_row), -1)
    while True:
        known = np.flatnonzero(seat >= 0)
        at[seat[known]] = known
        vertex, row = _alone(by_vertex, sides, seat, label[seat]), _alone(by_row, stored, at, label)
        _, one, other = np.intersect1d(vertex[0], row[0], assume_unique=True, return_indices=True)
        if not len(one):
            return
        seat[vertex[1][one]] = row[1][other]


def _alone(
    labels: Labels, ends: NDArray[np.int64], seated: NDArray[np.int64], own: Labels
) -> tuple[Labels, NDArray[np.int64]]:
    """Sums of labels (k,) and those that seated neighbours have of their `own`, where no other is the same; and where.

    Of those not `seated`, (k,) negative.
    """
    sums, own = labels.copy(), np.where(seated >= 0, own, 0)
    for one, other in ends.T, ends.T[::-1]:
        np.add.at(sums, one, own[other])
    sums[seated >= 0] = 0
    value, place, count = np.unique(sums, return_index=True, return_counts=True)
    some = (count == 1) & (value > 0)
    return value[some], place[some]
