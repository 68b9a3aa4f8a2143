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
from ..topology.keys import with_sides
from ..topology.pieces import planar_pieces
from ..words import count_of
from .lattice import Lattice, rows_alike

_RULE = "2 x 2 Gauss"


def recover_lattice(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh | None:
    """The lattice that a matrix is a part of, certified; None where there is none.

    Its cells are continued by those whose vertices are gone, and the mesh of both has the rows of the matrix, entries
    and diagonal. That such a mesh exists is proved by this; but others may as well, with cells that are not alike.
    """
    if not rows_alike(matrix):
        return None
    with clock("lattice"):
        lattice = Lattice.of(matrix)
    if lattice is None or len(lattice.z) == matrix.n or options.method != "conformal":
        return None
    if options.scale is not None and abs(lattice.scale / options.scale - 1) > CERTIFIED:
        return None
    topology = _topology(matrix, lattice)
    if topology is None:
        return None
    with clock("place"):
        (piece,) = topology.pieces
        placed, notes = placement.apply(piece, lattice.z[piece.vertices])
        tensor = placement.tensor
        mesh = JoinedMesh.of(topology, [placed], np.array([lattice.scale / (tensor.root_determinant if tensor else 1)]))
        design = np.column_stack([lattice.z.real, lattice.z.imag, np.ones(len(lattice.z))])
        affine = np.linalg.lstsq(design[: matrix.n], mesh.points, rcond=None)[0]
        gone = design[matrix.n :] @ affine
    with clock("certify"):
        points = np.concatenate([mesh.points, gone])
        a, b, c = (points @ [1, 1j])[lattice.cells[0, :3]]  # the mesh may be turned over as a whole
        cells = lattice.cells if (np.conj(b - a) * (c - a)).imag > 0 else lattice.cells[:, ::-1]
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
        error = _backward_error(matrix, certificate, len(points), lattice.shift)
    if not error <= CERTIFIED:
        return None
    lattice_notes = [
        "this is the only mesh whose cells are all alike; others, bent next to the unknowns that were eliminated, may "
        "fit as well"
    ]
    if lattice.shift:
        lattice_notes.append(f"{lattice.shift:.6g} times the identity was added to the matrix")
    kind: Callable[..., PlanarMesh] = PlanarMesh
    undivided_cells = [] if lattice.neighbours == 8 else vanished_notes(topology)
    fields = mesh.fields(triangulate=options.triangulate and lattice.neighbours != 8)
    if lattice.neighbours == 8:
        kind = partial(ConformingMesh, quads=cells[(cells < matrix.n).all(axis=1)], quadrature=_RULE, straight=True)
        fields = {name: value for name, value in fields.items() if not name.startswith("polygons")}
    return kind(
        **fields,
        points=mesh.points,
        hinges=topology.hinges,
        node_status=np.zeros(matrix.n, np.int8),
        status="certified",
        uniqueness="ambiguous",
        reason=(
            f"the lattice, continued by {count_of(len(gone), 'vertex that has', 'vertices that have')} no row, gives "
            f"the matrix back to {error:.1e} (relative), row sums included"
        ),
        operator=placement.operator,
        backward_error=error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=(*matrix.warnings, *lattice_notes, *notes, *undivided_cells),
        eliminated_points=gone,
    )


def _backward_error(matrix: OperatorMatrix, found: Certificate, n_points: int, shift: float) -> float:
    """Of entries and of diagonal entries, which say how much is gone, of rows that come first among the points.

    Relative to the largest off-diagonal entry of each row; infinite where a triangle is flat or turned over.
    """
    n = matrix.n
    sums = np.zeros(n)
    for end in matrix.edges.T:
        sums += np.bincount(end, matrix.entries, n)
    for end in found.pairs.T:
        sums += np.bincount(end, found.differences, n_points)[:n]
    diagonal = np.abs(shift - sums - matrix.diagonal) / matrix.row_size
    entries = found.misfits[(found.pairs < n).all(axis=1)]
    return np.inf if len(found.flipped) else max(float(entries.max()), float(diagonal.max()))


def _topology(matrix: OperatorMatrix, lattice: Lattice) -> Topology | None:
    """The cells that have all their vertices; None unless they are one piece, with all rows."""
    cells = lattice.cells[(lattice.cells < matrix.n).all(axis=1)]
    triangles, known = _divided(cells), matrix.edges
    if lattice.neighbours == 8:  # without diagonals
        known = np.unique(np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)), axis=0)
    edges, given, opposite = with_sides(matrix.n, known, triangles)
    pieces = planar_pieces(matrix.n, edges, triangles, opposite)
    if pieces is None or len(pieces) != 1 or pieces[0].n_vertices < matrix.n or len(pieces[0].edges) < len(edges):
        return None
    added = np.ones(len(edges), dtype=bool)
    added[given] = False
    return Topology(
        matrix.n, edges, pieces, "3-cycles", vanished=np.flatnonzero(added), polygons=undivided(list(pieces), added)[1]
    )


def _divided(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles, with squares (m, 4) divided in two."""
    return cells[:, [0, 1, 2, 0, 2, 3][: 3 * (cells.shape[1] - 2)]].reshape(-1, 3)
