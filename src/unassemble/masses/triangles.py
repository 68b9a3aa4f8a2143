"""Linear triangles with a mass matrix, or of one alone."""

import numpy as np
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..recovery import PlanarMesh
from ..tolerances import ALIKE, CERTIFIED
from ..topology import Topology
from ..topology.surface import Together
from .cells import TRIANGLE, evenly, less, mass_matrix, told_without_stiffness, weights_at
from .held import Held, Plain
from .lengths import fit_areas
from .settled import settled


def _mass_alone(held: Held, topology: Topology, triangles: NDArray, opposite: NDArray) -> PlanarMesh | None:
    """Areas of triangles (m, 3) of a mass matrix; None where areas do not explain it.

    There are e + n equations for m areas, and triangles that are none, holes of three edges, come out with area zero.
    """
    matrix, sign = held.matrix, held.sign
    if not (sign * matrix.entries > 0).all():
        return None
    areas = told_without_stiffness(matrix, triangles, opposite)
    if areas is None:
        return None
    hole = np.abs(areas) <= CERTIFIED * np.abs(matrix.row_sums[triangles].sum(axis=1))
    areas, triangles = areas[~hole], triangles[~hole]
    left = less(matrix, {TRIANGLE: triangles}, {TRIANGLE: evenly(TRIANGLE, areas)})
    error = float(max(np.abs(left.entries / matrix.entries).max(), np.abs(left.diagonal / matrix.diagonal).max()))
    if not (error <= CERTIFIED and (sign * areas > 0).all()):
        return None
    return PlanarMesh(
        points=np.full((matrix.n, 2), np.nan),
        triangles=triangles,
        component=topology.component,
        hinges=topology.hinges,
        scale=np.zeros(len(topology.pieces)),
        node_status=np.ones(matrix.n, dtype=np.int8),
        status="certified",
        uniqueness="proved",
        reason=f"the mass matrix of triangles with these areas is the given one to {error:.1e} (relative). A mass "
        "matrix has no shape: it depends on the areas of the triangles alone, and any that have them will do",
        operator="mass",
        backward_error=error,
        n_holes=topology.n_holes + int(hole.sum()),
        reaction=1.0,
        areas=areas,
        warnings=("the areas are those times s, if the factor of the mass matrix is s",),
    )


def with_consistent_mass(held: Held, topology: Topology, plain: Plain, clock: Clock) -> PlanarMesh | None:
    """The mesh of c L + s M, or areas of s M; None where no areas come near the entries."""
    matrix, union = held.matrix, Together(topology.pieces)
    triangles, opposite = union.vertices[union.triangles], union.edge_rows[union.opposite]
    if (found := _mass_alone(held, topology, triangles, opposite)) is not None:
        return found
    # Row sums of at least their rounding; those that have lost digits that a certificate could notice weigh less.
    sums = np.maximum(np.abs(matrix.row_sums), held.rounding)
    if not sums.all():  # rows of zeros
        return None
    trust = np.minimum(1.0, CERTIFIED * sums / held.rounding)
    with clock("metric"):
        fit = fit_areas(matrix.edges, triangles, opposite, held.sign * matrix.entries, sums, trust)
    if fit is None or fit[2] >= ALIKE:
        return None
    areas, squared_lengths, _ = fit
    weights = {TRIANGLE: evenly(TRIANGLE, held.sign * areas)}
    return settled(held, weights, {TRIANGLE: triangles}, lambda left: plain(left, squared_lengths), patience=0)


def with_lumped_mass(held: Held, found: PlanarMesh) -> PlanarMesh:
    """A mesh of c L + D; if D is proportional to the areas about its vertices that is a lumped mass matrix."""
    if not found.certified:
        return found
    blocks, sums = {TRIANGLE: found.divided()[0]}, held.matrix.row_sums
    share = mass_matrix(held.matrix.n, blocks, weights_at(found.points, blocks)).sum(axis=1)
    reaction = float(sums.sum() / share.sum())
    if not (np.abs(sums - reaction * share) <= ALIKE * np.abs(reaction * share) + held.rounding).all():
        return found
    terms = Terms(held.matrix.diagonal, reaction, lumped=True)
    again = held.with_terms(found, terms, "c L + s M, M the lumped mass matrix,")
    return again if again.certified else found
