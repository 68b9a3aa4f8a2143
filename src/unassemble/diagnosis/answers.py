"""The diagnosis in what recovery says: in its errors, and in the reasons of meshes that do not fit."""

from __future__ import annotations

from dataclasses import replace

from ..errors import GeometryError, NotPlanarError, RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import ConformingMesh, PlanarMesh
from ..tolerances import CERTIFIED
from ..words import sentences
from .kinds import UNKNOWN
from .mass import mass_matrix
from .scalar import diagnosed, where_nothing_fits


def explained(error: RecoveryError, matrix: OperatorMatrix) -> RecoveryError:
    """An error of recovery, with what the matrix is in place of what its graph is not."""
    planar = not isinstance(error, NotPlanarError)
    found = mass_matrix(matrix, planar=False) or diagnosed(matrix, planar=planar)
    if isinstance(error, NotPlanarError):
        begun = "the graph of the matrix is not planar"
        if found.kind == UNKNOWN:
            said = sentences([begun + (f": {error.why}" if error.why else ""), found.advice])
        elif found.unread:
            said = found.sentence(f"{begun}, for this is")
        else:
            like = replace(found, advice=where_nothing_fits(found, matrix))
            said = like.sentence(f"{begun}, and no mesh that was found has these entries, though the graph is that of")
        return NotPlanarError(said, error.why)
    return (
        GeometryError(found.sentence("no planar mesh has these entries: they are those of")) if found.unread else error
    )


def judged(mesh: PlanarMesh, matrix: OperatorMatrix) -> PlanarMesh:
    """A mesh that does not fit, or proves nothing, with what the matrix is as the reason, where that shows.

    Raises
    ------
    GeometryError
        If the matrix is a mass matrix, or one of segments on a line, so that the mesh means nothing.
    """
    if mesh.status != "uncertified":
        return mesh
    linear = not isinstance(mesh, ConformingMesh)
    found = mass_matrix(matrix, planar=False) or diagnosed(matrix, planar=linear)
    if found.kind in ("mass", "segments"):
        raise GeometryError(found.sentence())
    if not found.unread:
        if linear or mesh.chi_square is not None or mesh.backward_error <= CERTIFIED:
            return mesh
        advice = where_nothing_fits(found, matrix)
        return replace(mesh, reason=sentences([mesh.reason, *found.evidence[-1:]]), advice=advice)
    return replace(mesh, reason=sentences([f"the matrix is {found.name}", *found.evidence]), advice=found.advice)
