"""Which terms a scalar matrix has besides a Laplacian and any diagonal: told by its row sums, tried in order.

Rows of c L add up to zero. Where they do not, D is whatever it is if the other entries are those of a Laplacian. If
they are not, sums of one sign are those of a mass term, and sums of both those of S c L S, as Jacobi scaling and
equilibration leave it, with an unknown positive diagonal matrix S: L annihilates constants, so that this annihilates
1 / S. Where nothing else stands on the diagonal a positive null vector gives S, up to a factor that only c could tell
it from. With an unknown D there is no such vector, and fewer entries off the diagonal than coordinates and factors.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..conforming.recover import shown_cells
from ..conforming.roles import Cells
from ..errors import GeometryError, RecoveryError
from ..linalg import UpperTriangle, nearly_singular
from ..linalg.definite import STEPS
from ..matrix import OperatorMatrix
from ..planar.piece import left_by_map
from ..recovery import PlanarMesh
from ..tolerances import ALIKE, SUMMED
from ..topology import Topology
from .cells import guessed_from_sums
from .held import Held, Plain
from .settled import less_mass, settled
from .triangles import with_consistent_mass, with_lumped_mass


def recover_with_terms(
    matrix: OperatorMatrix, plain: Plain, clock: Clock, tensor: tuple[float, float, float] | None = None
) -> PlanarMesh:
    """The mesh of a scalar matrix of linear triangles.

    `plain`: recovers a matrix c L + D; knows relative sizes of its pieces if told the squared lengths of edges;
    `tensor`: (kxx, kxy, kyy) to be undone.
    """
    held, found = Held(matrix, tensor), None
    if not held.has_sums.any():
        return plain(matrix)
    with clock("topology"):
        topology = matrix.surfaces
    # Else sides of cells have vanished, or this is no mesh: scaled or not shows by itself.
    triangles = topology.pieces and not len(topology.bare_edges) and topology.multiplicity.all()
    if triangles:
        with clock("conformal"):
            laplacian = _is_laplacian(matrix, topology)
        if laplacian:
            return with_lumped_mass(held, plain(matrix)) if held.sign else plain(matrix)
    with suppress(RecoveryError):
        if not held.sign:
            found = _unscaled(held, plain, clock)
        elif triangles:
            found = with_consistent_mass(held, topology, plain, clock)
    return found or plain(matrix)


def recover_elements_with_terms(
    matrix: OperatorMatrix, of_cells: Callable[[OperatorMatrix, Iterable[Cells]], PlanarMesh], clock: Clock
) -> PlanarMesh | None:
    """The mesh of c L + s M or S c L S, of other elements; None where row sums show neither, or nothing comes near.

    `of_cells`: recovers a matrix c L + D on cells that its rows may form.
    """
    held = Held(matrix)
    if not held.has_sums.any():
        return None
    try:
        told = less_mass(matrix)
        cells = told[1] if told else next(shown_cells(matrix), None)
        if cells is None:
            return None
        if not (told or held.sign):
            scaled = _unscaled(held, lambda left: of_cells(left, shown_cells(left)), clock)
            if scaled is not None:
                return scaled
        # Serendipity functions have integrals of both signs.
        weights = told[2] if told else guessed_from_sums(matrix.row_sums, cells.blocks)
        if np.ptp(np.sign(np.concatenate([some.sum(axis=1) for some in weights.values()]))):
            return None

        def plain(left: OperatorMatrix) -> PlanarMesh:
            return of_cells(left, [cells])

        return settled(held, weights, cells.blocks, plain, patience=0 if told else 9, told=bool(told))
    except RecoveryError:
        return None


def _is_laplacian(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether conformal maps fit the most entries off the diagonal, whatever stands on it."""
    for piece in topology.pieces:
        weights = -matrix.entries[piece.edge_rows]
        found = left_by_map(piece, weights)
        if not found or not np.median(np.abs(found[1] * found[0])) <= ALIKE * np.median(np.abs(weights)):
            return False
    return True


def _unscaled(held: Held, plain: Plain, clock: Clock) -> PlanarMesh | None:
    """The mesh of S c L S; None where no positive vector is annihilated."""
    matrix = held.matrix
    with clock("scaling"):
        null = _positive_null_vector(matrix)
    if null is None:
        return None
    null = null / np.exp(np.log(null).mean())
    i, j = matrix.edges.T
    found = plain(replace(matrix, entries=matrix.entries * null[i] * null[j], diagonal=matrix.diagonal * null**2))
    note = "S and c are known up to a factor that one could give the other: the geometric mean of S is 1"
    return held.with_terms(found, Terms(matrix.diagonal, scaling=1 / null), "S c L S", note)


def _positive_null_vector(matrix: OperatorMatrix) -> NDArray[np.float64] | None:
    """(n,) a vector of positive numbers that the matrix annihilates up to rounding, if there is one."""
    sign = np.sign(matrix.diagonal)
    if not (sign[0] and (sign == sign[0]).all()):
        return None
    unit = 1 / np.sqrt(np.abs(matrix.diagonal))
    scaled = sp.csr_array(sp.diags_array(unit) @ (sign[0] * matrix.csr()) @ sp.diags_array(unit))
    x = np.ones(matrix.n)
    try:
        with nearly_singular(UpperTriangle.of(scaled)) as solver:
            for _ in range(STEPS + 1):
                x = (y := solver.solve(x)) / np.abs(y).max()
    except GeometryError:  # it has eigenvalues of both signs
        return None
    return unit * x if (x > 0).all() and (np.abs(scaled @ x) <= SUMMED * (abs(scaled) @ np.abs(x))).all() else None
