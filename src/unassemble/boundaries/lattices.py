"""Scalar matrices that have lost rows."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..cells.undivided import undivided
from ..certify import Certificate, certify
from ..certify_elements import certify_elements
from ..clock import Clock
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import ConformingMesh, PlanarMesh
from ..scalar.joined import JoinedMesh
from ..scalar.notes import vanished_notes
from ..scalar.placement import Placement
from ..tolerances import CERTIFIED
from ..topology import Topology
from ..topology.keys import contains, pair_keys, with_sides
from ..topology.pieces import planar_pieces
from ..words import count_of
from .lattice import Lattice, sides_of
from .seats import seated

_RULE = "2 x 2 Gauss"


def recover_lattice(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh | None:
    """The lattice that a matrix is a part of, certified; None where there is none.

    Its cells are continued by those whose vertices are gone, or have rows of the identity, and the mesh of all has the
    other rows of the matrix, entries and diagonal. That such a mesh exists is proved by this; but others may as well,
    with cells that are not alike, or no rectangles.
    """
    if matrix.adds_up.all() or options.method != "conformal" or options.noise is not None:
        return None
    n, tensor = matrix.n, placement.tensor
    kept = np.bincount(matrix.edges.ravel(), minlength=n) > 0  # others are rows of the identity
    if matrix.replaced is not None:
        kept &= ~matrix.replaced
    own = np.flatnonzero(kept)
    with clock("lattice"):
        lattice = Lattice.of(matrix.among(own)) if len(own) else None
        seats = None if lattice is None else seated(matrix, own, lattice)
    if lattice is None or seats is None or len(lattice.z) == len(own):
        return None
    if options.scale is not None and abs(lattice.scale / options.scale - 1) > CERTIFIED:
        return None
    row, status = seats
    topology = _topology(matrix, own, row[lattice.cells], bilinear=lattice.neighbours == 8)
    if topology is None or (topology.multiplicity[own] == 0).any():
        return None
    (piece,) = topology.pieces
    status[topology.multiplicity == 0] = 1
    with clock("place"):
        placement, loose = placement.upon(n, [(np.arange(n), status == 0)])
        z = np.full(n + int((row >= n).sum()), np.nan, dtype=np.complex128)
        z[row] = lattice.z
        placed, notes = placement.apply(piece, z[piece.vertices])
        mesh = JoinedMesh.of(topology, [placed], np.array([lattice.scale / placement.stretch]))
        design = np.column_stack([z.real, z.imag, np.ones(len(z))])
        gone = design[n:] @ np.linalg.lstsq(design[piece.vertices], mesh.points[piece.vertices], rcond=None)[0]
    with clock("certify"):
        points, cells = np.concatenate([mesh.points, gone]), row[lattice.cells]
        a, b, c = (points @ [1, 1j])[cells[0, :3]]  # the mesh may be turned over as a whole
        cells = cells if (np.conj(b - a) * (c - a)).imag > 0 else cells[:, ::-1]
        if lattice.neighbours == 8:
            seen = tensor.to_laplacian(points @ [1, 1j]) if tensor else points @ [1, 1j]
            certificate = certify_elements(
                matrix.edges, matrix.entries, np.column_stack([seen.real, seen.imag]), {"quad": cells},
                {"quad": np.full(len(cells), lattice.scale)}, {"quad": _RULE},
            )  # fmt: skip
        else:
            triangles = _divided(cells)
            factor = np.full(len(triangles), float(mesh.scale[0]))
            certificate = certify(matrix.edges, matrix.entries, points, triangles, factor, placement.coefficients)
        error = _backward_error(matrix, own, certificate, len(points), lattice.added)
    if not error <= CERTIFIED:
        return None
    kind: Callable[..., PlanarMesh] = PlanarMesh
    undivided_cells = [] if lattice.neighbours == 8 else vanished_notes(topology)
    fields = mesh.fields(triangulate=options.triangulate and lattice.neighbours != 8)
    if lattice.neighbours == 8:
        kind = partial(ConformingMesh, quads=cells[(cells < n).all(axis=1)], quadrature=_RULE, straight=True)
        fields = {name: value for name, value in fields.items() if not name.startswith("polygons")}
    name = "grid" if lattice.rectangles else "lattice"
    return kind(
        **fields,
        points=mesh.points,
        hinges=topology.hinges,
        node_status=status,
        status="certified",
        uniqueness="ambiguous",
        reason=(
            f"the {name}, continued by {count_of(len(gone), 'vertex that has', 'vertices that have')} no row, gives "
            f"the matrix back to {error:.1e} (relative), row sums included"
        ),
        operator=placement.operator,
        backward_error=error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=(*matrix.warnings, *_lattice_notes(lattice, status), *loose, *notes, *undivided_cells),
        eliminated_points=gone,
    )


def _lattice_notes(lattice: Lattice, status: NDArray[np.int8]) -> list[str]:
    only = "of rectangles" if lattice.rectangles else "whose cells are all alike"
    notes = [f"this is the only mesh {only}; others, bent next to the unknowns that were eliminated, may fit as well"]
    if lattice.added.any():
        size = np.median(lattice.added)
        alike = (np.abs(lattice.added - size) <= CERTIFIED * np.abs(size)).all()
        what = f"{size:.6g} times the identity" if alike else "a multiple of the lumped mass matrix"
        notes.append(f"{what} was added to the matrix")
    if k := int((status == 2).sum()):
        notes.append(
            f"{count_of(k, 'position is', 'positions are')} plausible and no more (`node_status` 2): next to corners, "
            "two rows that were replaced can change places"
        )
    return notes


def _backward_error(
    matrix: OperatorMatrix, own: NDArray[np.int64], found: Certificate, n_points: int, added: NDArray
) -> float:
    """Of entries and of diagonal entries, which say how much is gone, of the rows `own`, (k,), with `added` (k,).

    Relative to the largest off-diagonal entry of each row; infinite where a triangle is flat or turned over.
    """
    n, size = matrix.n, np.full(n_points, np.inf)
    size[own] = matrix.row_size[own]
    sums = matrix.row_sums[own] - matrix.diagonal[own]
    for end in found.pairs.T:
        sums += np.bincount(end, found.differences, n_points)[own]
    diagonal = np.abs(added - sums - matrix.diagonal[own]) / size[own]
    entries = np.abs(found.differences) / size[found.pairs].min(axis=1)
    entries = entries[(found.pairs < n).all(axis=1)]
    return np.inf if len(found.flipped) else max(float(entries.max()), float(diagonal.max()))


def _topology(
    matrix: OperatorMatrix, own: NDArray[np.int64], cells: NDArray[np.int64], *, bilinear: bool
) -> Topology | None:
    """The cells that have all their vertices; None unless they are one piece with all entries of rows `own`, (k,)."""
    n, cells = matrix.n, cells[(cells < matrix.n).all(axis=1)]
    key = matrix.edges @ [n, 1]
    if cells.shape[1] == 4:
        turned = contains(key, pair_keys(n, cells[:, 1], cells[:, 3]))  # divided as entries are stored
        cells = np.where(turned[:, None], np.roll(cells, 1, axis=1), cells)
    triangles = _divided(cells)
    known = matrix.edges[np.isin(matrix.edges, cells).all(axis=1) & np.isin(matrix.edges, own).any(axis=1)]
    if bilinear:  # without diagonals
        known = sides_of(cells)
    edges, given, opposite = with_sides(n, known, triangles)
    pieces = planar_pieces(n, edges, triangles, opposite)
    if pieces is None or len(pieces) != 1 or len(pieces[0].edges) < len(edges):
        return None
    added = np.ones(len(edges), dtype=bool)
    added[given] = False
    return Topology(
        n, edges, pieces, "3-cycles", vanished=np.flatnonzero(added), polygons=undivided(list(pieces), added)[1]
    )


def _divided(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles, with squares (m, 4) divided in two."""
    return cells[:, [0, 1, 2, 0, 2, 3][: 3 * (cells.shape[1] - 2)]].reshape(-1, 3)
