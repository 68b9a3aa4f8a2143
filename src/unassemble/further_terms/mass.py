"""A = c L + s M with M consistent or lumped, and s M alone.

Areas are taken off the matrix, what is left is a Laplacian and recovered as one, and the whole is assembled again.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..reaction import Skeleton, areas_of_mass, fit_metric
from ..recovery import PlanarMesh
from ..tolerances import ALIKE, CERTIFIED
from ..topology import Topology
from .held import Held, Plain, RowSums, size_note


def mass_alone(held: Held, topology: Topology, skeleton: Skeleton, sums: RowSums) -> PlanarMesh | None:
    """Triangles and areas of a mass matrix; None where areas do not explain it.

    There are e + n equations for m areas, and triangles that are none, holes of three edges, come out with area zero.
    """
    matrix = held.matrix
    if not (sums.sign * matrix.entries > 0).all():
        return None
    areas = areas_of_mass(skeleton, matrix.entries, matrix.diagonal)
    if areas is None:
        return None
    hole = np.abs(areas) <= CERTIFIED * (np.abs(skeleton.at_vertices.T @ sums.values))
    areas, triangles = areas[~hole], skeleton.triangles[~hole]
    rows = np.concatenate([skeleton.at_edges[:, ~hole] @ areas / 12, skeleton.at_vertices[:, ~hole] @ areas / 6])
    error = float(np.abs(rows / np.concatenate([matrix.entries, matrix.diagonal]) - 1).max())
    if not (error <= CERTIFIED and (sums.sign * areas > 0).all()):
        return None
    component = np.full(matrix.n, -1)
    for label in reversed(range(len(topology.pieces))):
        component[topology.pieces[label].vertices] = label
    return PlanarMesh(
        points=np.full((matrix.n, 2), np.nan),
        triangles=triangles,
        component=component,
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


def with_consistent_mass(
    held: Held, skeleton: Skeleton, sums: RowSums, plain: Plain, clock: Clock
) -> PlanarMesh | None:
    """The mesh of c L + s M; None where the fit of edge lengths does not come near the entries."""
    if not sums.sizes.all():  # rows of zeros
        return None
    matrix, trust = held.matrix, np.minimum(1.0, CERTIFIED * sums.sizes / sums.rounding)
    with clock("metric"):  # a sum that has lost so many digits that a certificate could notice weighs less
        fit = fit_metric(skeleton, sums.sign * matrix.entries, sums.sizes, trust)
    if fit is None or fit[1] >= ALIKE:
        return None
    metric = fit[0]
    laplacian = replace(
        matrix,
        entries=matrix.entries - skeleton.at_edges @ (sums.sign * metric.areas) / 12,
        diagonal=matrix.diagonal - skeleton.at_vertices @ (sums.sign * metric.areas) / 6,
    )
    found = plain(laplacian, metric.u)
    reaction = sums.sign * float(metric.areas.sum() / _areas_of(found).sum())
    terms, operator = Terms(matrix.diagonal, reaction), "c L + s M, M the consistent mass matrix,"
    unproved = (
        "that no other areas, with another c, fit as well is not proved: the fit of edge lengths was started once, and "
        "at its end the equations determine all of them"
    )
    return held.with_terms(found, terms, operator, size_note(reaction), unproved=unproved)


def with_lumped_mass(held: Held, found: PlanarMesh, sums: RowSums) -> PlanarMesh:
    """A mesh of c L + D; if D is proportional to the areas about its vertices that is a lumped mass matrix."""
    if not found.certified:
        return found
    areas, share = _areas_of(found), np.zeros(held.matrix.n)
    np.add.at(share, found.divided()[0], areas[:, None] / 3)
    reaction = float(sums.values.sum() / areas.sum())
    if not (np.abs(sums.values - reaction * share) <= ALIKE * np.abs(reaction * share) + sums.rounding).all():
        return found
    terms = Terms(held.matrix.diagonal, reaction, lumped=True)
    again = held.with_terms(found, terms, "c L + s M, M the lumped mass matrix,", size_note(reaction))
    return again if again.certified else found


def _areas_of(mesh: PlanarMesh) -> NDArray[np.float64]:
    """(m,) of all triangles, those of polygons too, as ``divided`` has them."""
    a, b, c = mesh.points[mesh.divided()[0]].transpose(1, 2, 0)
    (ux, uy), (wx, wy) = b - a, c - a
    return np.asarray((ux * wy - uy * wx) / 2)
