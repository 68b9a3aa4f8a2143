"""From a checked matrix to what it is: its sums say which operator, its graph which cells; and so recovery says it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import GeometryError, NotPlanarError, RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import ConformingMesh, PlanarMesh
from ..tolerances import CERTIFIED, MOST
from ..words import sentences
from .cliques import CELLS, cells_of, mostly, often
from .kinds import CONSTANT, PLANAR, TERMS, UNKNOWN, UNREAD, Diagnosis
from .mass import mass_matrix
from .structural import saddle_point, seeming
from .sums import Sums, further_terms

LINEAR = "a stiffness matrix of linear elements on triangles"
_SMALL = 10  # rows: fewer may be a mesh of few triangles, whatever their entries are


def diagnosed(matrix: OperatorMatrix, *, planar: bool) -> Diagnosis:
    """What a scalar matrix is, at linear cost.

    `planar`: whether its graph is one of triangles, or of other cells with linear elements, in the plane.
    """
    sums = Sums.of(matrix)
    if (mass := mass_matrix(matrix, planar=planar)) is not None:
        return mass
    degree = np.bincount(matrix.edges.ravel(), minlength=matrix.n)
    if degree.max() <= 2 and (degree == 1).any() and matrix.n >= _SMALL:
        return _of_kind("segments", "a stiffness matrix on a line", "no row is coupled to more than two", sums)
    if matrix.unweighted and matrix.n >= _SMALL and matrix.entries[0] < 0:
        equal = "all off-diagonal entries are equal, and on a mesh those of the boundary have one cell and others two"
        return _of_kind("graph", "the Laplacian of a graph without weights", equal, sums)
    if planar:
        return Diagnosis(PLANAR, LINEAR + further_terms(matrix), sums.evidence)
    # Rows of stiffnesses have a diagonal, and some sums are zero or of one sign; blocks form cliques as cells do.
    saddle = saddle_point(matrix)
    if not saddle and (sums.zero.any() or sums.sign) and (found := _by_cells(matrix, sums)) is not None:
        return found
    said, advice = ("neither its graph nor its sums show one", *sums.evidence), saddle or seeming(matrix) or TERMS
    return Diagnosis(UNKNOWN, "no scalar matrix of a kind that is known", said, advice)


def _by_cells(matrix: OperatorMatrix, sums: Sums) -> Diagnosis | None:
    """A matrix whose graph is not planar, by the cells that its graph shows, or entries where it lacks zeros."""
    used = matrix.edges[matrix.entries != 0] if matrix.entries.any() else matrix.edges
    for edges in (matrix.edges, used):  # zeros that are stored show cells better than where they are left out
        cells = cells_of(matrix.n, edges)
        several = often(cells.twins)  # unknowns in a node, or nodes inside of an edge or cell
        operator = "a stiffness matrix" if sums.zero.any() else "a stiffness matrix, plus a mass matrix or a diagonal,"
        kind, name = CELLS.get((cells.nodes, cells.shared), ("", ""))
        # About half of the pairs of quadrilaterals are diagonals.
        doubtful = {"quadrilaterals": cells.often < 1 - MOST, "hexahedra": several and cells.nodes == 8}
        if kind and not doubtful.get(kind):
            shown = f"rows form cliques of {cells.nodes}, neighbours of which share {cells.shared} rows"
            return _of_kind(kind, f"{operator} of {name}", shown, sums)
        if not (often(cells.often) or several) and mostly(cells.in_fours) and cells.around <= 3:
            # As many around each as in a mesh in space; products of matrices, and dense graphs, have 5 and more.
            shown = f"{cells.in_fours:.0%} of the coupled pairs of rows lie in a clique of four"
            return _of_kind("tetrahedra", f"{operator} of linear elements on tetrahedra", shown, sums)
        if not (often(cells.in_fours) or several) and mostly(cells.in_threes) and len(edges) >= 2.5 * matrix.n:
            shown = f"{cells.in_threes:.0%} of the coupled pairs of rows lie in triangles, few in a clique of four"
            name = f"{operator} of linear elements on triangles, on a surface that cannot be laid flat"
            return _of_kind("surface", name, shown, sums)
        grid = not cells.in_threes and 2 * len(edges) >= 3.5 * matrix.n
        if grid and np.bincount(edges.ravel(), minlength=matrix.n).max() == 6:
            shown = "no three rows are coupled to each other, and most rows are coupled to six"
            return _of_kind("grid in space", "that of a grid in space, a seven-point stencil", shown, sums)
    if (matrix.entries <= 0).all() and (sums.zero | sums.alone | sums.positive).all():
        more = "" if (sums.zero | sums.alone).all() else ", plus a diagonal"
        shown = f"no off-diagonal entry is positive, rows add up to zero{' or more' if more else ''}, and no cells show"
        return _of_kind("graph", f"the Laplacian of a graph with weights{more}", shown, sums)
    return None


def _of_kind(kind: str, name: str, shown: str, sums: Sums) -> Diagnosis:
    return Diagnosis(kind, name, (shown, *sums.evidence), UNREAD.get(kind, sums.remedy))


def _where_nothing_fits(found: Diagnosis, matrix: OperatorMatrix) -> str:
    """What to do about a matrix whose graph is that of cells which are read, while no mesh has its entries."""
    if found.kind == "surface" and matrix.alike:
        return "all entries are equal, as on triangles with equal sides: `operator='surface'` takes them for such"
    return found.advice or (TERMS if Sums.of(matrix).rest.any() else CONSTANT)


def explained(error: RecoveryError, matrix: OperatorMatrix) -> RecoveryError:
    """An error of recovery, with what the matrix is in place of what its graph is not."""
    found = mass_matrix(matrix, planar=False) or diagnosed(matrix, planar=not isinstance(error, NotPlanarError))
    if isinstance(error, NotPlanarError):
        begun = "the graph of the matrix is not planar"
        if found.kind == UNKNOWN:
            said = sentences([begun + (f": {error.why}" if error.why else ""), found.advice])
        elif found.unread:
            said = found.sentence(f"{begun}, for this is")
        else:
            like = replace(found, advice=_where_nothing_fits(found, matrix))
            said = like.sentence(f"{begun}, and no mesh that was found has these entries, though the graph is that of")
        return NotPlanarError(said, error.why)
    said = found.sentence("no planar mesh has these entries: they are those of")
    return GeometryError(said) if found.unread else error


def judged(mesh: PlanarMesh, matrix: OperatorMatrix) -> PlanarMesh:
    """A mesh that does not fit, or proves nothing, with what the matrix is as the reason, where that shows.

    Raises a GeometryError if the matrix is a mass matrix, or one of segments on a line, so that the mesh means nothing.
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
        advice = _where_nothing_fits(found, matrix)
        reasons = mesh.verdict.reasons[0], *found.evidence[-1:]
        return replace(mesh, verdict=mesh.verdict.explained(*reasons, advice=advice))
    reasons = f"the matrix is {found.name}", *found.evidence
    return replace(mesh, verdict=mesh.verdict.explained(*reasons, advice=found.advice))
