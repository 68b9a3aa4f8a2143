"""Which terms a scalar matrix has besides a Laplacian and any diagonal: told by its row sums, tried in order.

S c L S, as Jacobi scaling and equilibration leave it, with an unknown positive diagonal matrix S: L annihilates
constants, so that this annihilates 1 / S. Where nothing else stands on the diagonal a positive null vector gives S, up
to a factor that only c could tell it from. With an unknown D there is no such vector, and fewer entries off the
diagonal than coordinates and factors.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..errors import GeometryError, RecoveryError
from ..linalg import UpperTriangle, nearly_singular
from ..linalg.definite import STEPS
from ..matrix import OperatorMatrix
from ..planar.piece import left_by_map
from ..reaction import Skeleton
from ..recovery import PlanarMesh
from ..tolerances import ALIKE, SUMMED
from ..topology import Topology, surfaces
from .held import Held, Plain, RowSums
from .mass import mass_alone, with_consistent_mass, with_lumped_mass


def recover_with_terms(
    matrix: OperatorMatrix, plain: Plain, clock: Clock, tensor: tuple[float, float, float] | None = None
) -> PlanarMesh:
    """The mesh of a scalar matrix.

    Rows of c L add up to zero. Where they do not, D is whatever it is if the other entries are those of a Laplacian.
    If they are not, sums of one sign are those of a mass term, and sums of both those of S c L S.

    `plain`: recovers a matrix c L + D; knows relative sizes of its pieces if told the squared lengths of edges;
    `tensor`: (kxx, kxy, kyy) to be undone.
    """
    sums = RowSums(matrix)
    if not sums.there.any():
        return plain(matrix)
    with clock("topology"):
        topology = surfaces(matrix.n, matrix.edges)
    held, found = Held(matrix, tensor), None
    # Else sides of cells have vanished, or this is no mesh: scaled or not shows by itself.
    triangles = topology.pieces and not len(topology.bare_edges) and topology.multiplicity.all()
    if triangles:
        with clock("conformal"):
            laplacian = _is_laplacian(matrix, topology)
        if laplacian:
            return with_lumped_mass(held, plain(matrix), sums) if sums.sign else plain(matrix)
    with suppress(RecoveryError):
        if not sums.sign:
            found = unscaled(held, plain, clock)
        elif triangles:
            cells = Skeleton.of(matrix.n, matrix.edges, topology.pieces)
            found = mass_alone(held, topology, cells, sums) or with_consistent_mass(held, cells, sums, plain, clock)
    return found or plain(matrix)


def _is_laplacian(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether conformal maps fit the most entries off the diagonal, whatever stands on it."""
    for piece in topology.pieces:
        weights = -matrix.entries[piece.edge_rows]
        found = left_by_map(piece, weights)
        if not found or not np.median(np.abs(found[1] * found[0])) <= ALIKE * np.median(np.abs(weights)):
            return False
    return True


def unscaled(held: Held, plain: Plain, clock: Clock) -> PlanarMesh | None:
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
