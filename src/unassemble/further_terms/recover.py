"""Which terms a scalar matrix has besides a Laplacian and any diagonal: told by its row sums, tried in order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..clock import Clock
from ..errors import RecoveryError
from ..matrix import OperatorMatrix
from ..planar.conformal import conformal_map
from ..planar.cotangent import edge_weights
from ..reaction import Skeleton
from ..recovery import PlanarMesh
from ..tolerances import ALIKE
from ..topology import Topology, surfaces
from .again import Held, Plain
from .mass import mass_alone, with_consistent_mass, with_lumped_mass
from .row_sums import RowSums
from .scaling import unscaled


def recover_with_terms(
    matrix: OperatorMatrix, plain: Plain, clock: Clock, tensor: tuple[float, float, float] | None = None
) -> PlanarMesh:
    """The mesh of a scalar matrix.

    Rows of c L add up to zero. Where they do not, D is whatever it is if the other entries are those of a Laplacian.
    If they are not, sums of one sign are those of a mass term, and sums of both those of S c L S.

    Parameters
    ----------
    matrix : OperatorMatrix
    plain : callable
        Recovers a matrix c L + D; knows relative sizes of its pieces if told the squared lengths of edges.
    clock : Clock
    tensor : (kxx, kxy, kyy), optional
    """
    sums = RowSums.of(matrix)
    if not sums.there.any():
        return plain(matrix)
    with clock("topology"):
        topology = surfaces(matrix.n, matrix.edges)
    held = Held(matrix, tensor)
    if not topology.pieces or len(topology.bare_edges) or not topology.multiplicity.all():
        # Sides of cells have vanished, or this is no mesh: scaled or not shows by itself.
        return (None if sums.sign else _or_none(lambda: unscaled(held, plain, clock))) or plain(matrix)
    with clock("conformal"):
        laplacian = _is_laplacian(matrix, topology)
    if laplacian:
        found = plain(matrix)
        return with_lumped_mass(held, found, sums) if sums.sign else found
    if not sums.sign:
        return _or_none(lambda: unscaled(held, plain, clock)) or plain(matrix)
    skeleton = Skeleton.of(matrix.n, matrix.edges, topology.pieces)
    found_or_none = _or_none(
        lambda: mass_alone(held, topology, skeleton, sums) or with_consistent_mass(held, skeleton, sums, plain, clock)
    )
    return found_or_none or plain(matrix)


def _or_none(reading: Callable[[], PlanarMesh | None]) -> PlanarMesh | None:
    try:
        return reading()
    except RecoveryError:
        return None


def _is_laplacian(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether conformal maps fit the most entries off the diagonal, whatever stands on it."""
    for piece in topology.pieces:
        weights = -matrix.entries[piece.edge_rows]
        try:
            found = conformal_map(piece, weights, sharp=False)
        except RecoveryError:
            return False
        with np.errstate(all="ignore"):
            left = np.abs(weights - found.scale * edge_weights(piece, found.z))
        if not np.median(left) <= ALIKE * np.median(np.abs(weights)):
            return False
    return True
