"""From a checked matrix to what it is: its sums say which operator, its graph which cells; and so recovery says it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, NotPlanarError, RecoveryError
from ..matrix import OperatorMatrix
from ..recovery import ConformingMesh, PlanarMesh
from ..tolerances import CERTIFIED, MOST, ROUNDED, SMALL
from ..words import count_of, sentences
from .cliques import CELLS, cells_of, mostly, often
from .kinds import CONSTANT, KEEP_ALL, PLANAR, TERMS, UNKNOWN, UNREAD, WITHOUT_MASS, Diagnosis
from .mass import mass_matrix
from .structural import saddle_point, seeming

LINEAR = "a stiffness matrix of linear elements on triangles"
_SMALL = 10  # rows: fewer may be a mesh of few triangles, whatever their entries are


@dataclass(frozen=True, eq=False)
class Sums:
    """What rows add up to."""

    # (n,) each: rows that add up to nothing, and to more than nothing, alone ones left out
    zero: NDArray[np.bool_]
    positive: NDArray[np.bool_]
    # (n,) each: rows with nothing beside the diagonal; those of them that have something on it
    alone: NDArray[np.bool_]
    identity: NDArray[np.bool_]
    penalised: NDArray[np.bool_]  # (n,) rows whose diagonal is beyond everything else
    sign: int  # that of all sums that are not zero, where these are not few and all have one; else 0

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Sums:
        """Those of a matrix."""
        size = np.bincount(matrix.edges.ravel(), np.repeat(np.abs(matrix.entries), 2), matrix.n)
        sums, alone = matrix.row_sums, size == 0
        zero = matrix.adds_up & ~alone
        penalised = (SMALL * np.abs(matrix.diagonal) > size) & ~alone
        rest = ~(zero | alone | penalised)
        signs = np.unique(np.sign(sums[rest]))
        sign = int(signs[0]) if len(signs) == 1 and rest.sum() > MOST * (zero | rest).sum() else 0
        return cls(zero, (sums > 0) & ~zero & ~alone, alone, alone & (matrix.diagonal != 0), penalised, sign)

    @property
    def rest(self) -> NDArray[np.bool_]:
        """Rows with a sum that calls for a reason."""
        return ~(self.alone | self.zero | self.penalised)

    @property
    def eliminated(self) -> bool:
        """Whether sums are as next to unknowns that are gone: few, beside others that are zero."""
        return bool(self.zero.any() and 0 < self.rest.sum() <= MOST * (~self.alone).sum())

    @property
    def remedy(self) -> str:
        """What to assemble, so that all rows add up to zero; empty where penalties alone do not."""
        if self.eliminated:
            return KEEP_ALL
        return WITHOUT_MASS if self.rest.any() and (self.zero.any() or self.sign) else ""

    @property
    def evidence(self) -> tuple[str, ...]:
        """What they say of boundary conditions and further terms, the strongest first."""
        used = ~self.alone
        said = []
        if self.identity.any() and self.zero.any():
            rows = count_of(int(self.identity.sum()), "row is that", "rows are those")
            which = f"of the identity, as of unknowns with Dirichlet conditions (row {self.identity.argmax()})"
            said.append(f"{rows} {which}")
        if self.penalised.any():
            rows = count_of(int(self.penalised.sum()), "diagonal entry is", "diagonal entries are")
            said.append(f"{rows} a penalty, as for Dirichlet conditions (row {self.penalised.argmax()})")
        if self.zero[used].all():
            said.append("all rows add up to zero")
        elif (self.zero | self.penalised)[used].all():
            said.append("all other rows add up to zero")
        elif self.zero.any():
            added = "where a mass matrix or a diagonal was added"
            cause = "next to unknowns that were eliminated" if self.eliminated else added
            rows = f"{int(self.rest.sum()):,} of {int(used.sum()):,} rows do not add up to zero"
            said.append(f"{rows}, as {cause} (row {self.rest.argmax()})")
        else:
            one = f"all sums are {'positive' if self.sign > 0 else 'negative'}" if self.sign else "sums have both signs"
            said.append(f"no row adds up to zero, and {one}")
        return tuple(said)


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
        if not (often(cells.often) or several) and cells.tetrahedral:
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


def further_terms(matrix: OperatorMatrix) -> str:
    """What was added to a Laplacian, or done to it, as its row sums tell before anything is solved."""
    sums = Sums.of(matrix)
    if (sums.zero | sums.alone).all():
        return ""
    if sums.penalised.any() and (sums.zero | sums.alone | sums.penalised).all():
        return ", plus a diagonal"
    if sums.zero.any() and not sums.sign:
        return ", plus a diagonal or without some unknowns"
    if np.ptp(matrix.diagonal) <= ROUNDED * np.abs(matrix.diagonal).max():
        return ", plus a diagonal, or with rows and columns scaled to a constant diagonal"
    if sums.sign:
        return ", plus a diagonal or a mass matrix, as of a reaction"
    scaled = (matrix.diagonal > 0).all() or (matrix.diagonal < 0).all()  # squares of factors keep signs
    return ", plus a diagonal, or with rows and columns scaled" if scaled else ", plus a diagonal"


def _where_nothing_fits(found: Diagnosis, matrix: OperatorMatrix) -> str:
    """What to do about a matrix whose graph is that of cells which are read, while no mesh has its entries."""
    return found.advice or (TERMS if Sums.of(matrix).rest.any() else CONSTANT)


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
        return replace(mesh, reason=sentences([mesh.reason, *found.evidence[-1:]]), advice=advice)
    return replace(mesh, reason=sentences([f"the matrix is {found.name}", *found.evidence]), advice=found.advice)
