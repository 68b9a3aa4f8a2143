"""From a checked matrix to what it is: its sums say which operator, its graph which cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..nodes.unknowns import nodes_of_pattern
from ..tolerances import MOST, ROUNDED, SMALL, SUMMED
from ..topology import components
from ..words import count_of
from .cliques import Cells, cells_of, mostly, often
from .kinds import LENGTHS, PLANAR, UNKNOWN, UNREAD, Diagnosis
from .mass import mass_bounds

_CELLS = {
    # nodes of a cell, and those that neighbours share: kind, and name
    (4, 2): ("quadrilaterals", "bilinear elements on quadrilaterals"),
    (8, 4): ("hexahedra", "trilinear elements on hexahedra"),
    (6, 3): ("quadratic", "quadratic elements on triangles"),
    (8, 3): ("quadratic", "serendipity elements on quadrilaterals"),
    (9, 3): ("quadratic", "biquadratic elements on quadrilaterals"),
    (10, 6): ("tetrahedra", "quadratic elements on tetrahedra"),
    (20, 8): ("hexahedra", "serendipity elements on hexahedra"),
    (27, 9): ("hexahedra", "triquadratic elements on hexahedra"),
    (10, 4): ("cubic", "cubic elements on triangles"),
    (16, 4): ("cubic", "bicubic elements on quadrilaterals"),
}
LINEAR = "a stiffness matrix of linear elements on triangles"
_SIMPLICES = {1: "segments", 2: "triangles", 3: "tetrahedra"}
_SMALL = 10  # rows: fewer may be a mesh of few triangles, whatever their entries are


@dataclass(frozen=True, eq=False)
class Sums:
    """What rows add up to.

    Attributes
    ----------
    zero : (n,) bool
        Rows that add up to nothing, alone ones left out.
    alone : (n,) bool
        Rows with nothing beside the diagonal.
    penalised : (n,) bool
        Rows whose diagonal is beyond everything else.
    sign : int
        That of all sums, where none is zero and all have one; else 0.
    """

    zero: NDArray[np.bool_]
    alone: NDArray[np.bool_]
    penalised: NDArray[np.bool_]
    sign: int

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Sums:
        """Those of a matrix."""
        ends, twice = matrix.edges.ravel(), np.repeat(matrix.entries, 2)
        size = np.bincount(ends, np.abs(twice), matrix.n)
        sums = matrix.diagonal + np.bincount(ends, twice, matrix.n)
        alone = size == 0
        zero = (np.abs(sums) <= SUMMED * (size + np.abs(matrix.diagonal))) & ~alone
        penalised = (SMALL * np.abs(matrix.diagonal) > size) & ~alone
        signs = np.unique(np.sign(sums[~alone & ~penalised]))
        sign = int(signs[0]) if len(signs) == 1 and not (zero & ~alone).any() else 0
        return cls(zero, alone, penalised, sign)

    @property
    def evidence(self) -> tuple[str, ...]:
        """What they say of boundary conditions and further terms, the strongest first."""
        used = ~self.alone
        said = []
        if self.alone.any() and self.zero.any():
            rows = count_of(int(self.alone.sum()), "row is that", "rows are those")
            said.append(f"{rows} of the identity, as of unknowns with Dirichlet conditions (row {_first(self.alone)})")
        if self.penalised.any():
            rows = count_of(int(self.penalised.sum()), "diagonal entry is", "diagonal entries are")
            said.append(f"{rows} a penalty, as for Dirichlet conditions (row {_first(self.penalised)})")
        if self.zero[used].all():
            said.append("all rows add up to zero")
        elif (self.zero | self.penalised)[used].all():
            said.append("all other rows add up to zero")
        elif self.zero.any():
            rest = used & ~self.zero & ~self.penalised
            said.append(
                f"{int(rest.sum()):,} of {int(used.sum()):,} rows do not add up to zero, as next to unknowns that were "
                f"eliminated (row {_first(rest)})"
            )
        else:
            one = f"all sums are {'positive' if self.sign > 0 else 'negative'}" if self.sign else "sums have both signs"
            said.append(f"no row adds up to zero, and {one}")
        return tuple(said)


def diagnosed(matrix: OperatorMatrix, *, planar: bool) -> Diagnosis:
    """What a scalar matrix is, at linear cost.

    Parameters
    ----------
    matrix : OperatorMatrix
    planar : bool
        Whether its graph is one of triangles, or of other cells with linear elements, in the plane.
    """
    sums = Sums.of(matrix)
    if dimension := _mass_of_simplices(matrix):
        return _mass_of_linear(dimension, planar=planar)
    if (bounds := mass_bounds(matrix)) is not None:
        return _mass(matrix, bounds)
    degree = np.bincount(matrix.edges.ravel(), minlength=matrix.n)
    if degree.max() <= 2 and matrix.n >= _SMALL:
        return _of_kind(
            "segments", "a stiffness matrix on a line", "no row is coupled to more than two", *sums.evidence
        )
    if _is_graph(matrix, sums):
        equal = "all off-diagonal entries are equal, and on a mesh those of the boundary have one cell and others two"
        return _of_kind("graph", "the Laplacian of a graph without weights", equal, *sums.evidence)
    if planar:
        return Diagnosis(PLANAR, LINEAR + _further(sums), sums.evidence)
    if not (sums.zero.any() or sums.sign):  # as of no stiffness matrix, whatever its graph looks like
        return _unknown(sums)
    return _by_cells(matrix, sums)


def _mass_of_linear(dimension: int, *, planar: bool) -> Diagnosis:
    """The mass matrix of linear elements on simplices, of which those of triangles in the plane are read."""
    ratio = {1: "twice", 2: "once", 3: "two thirds of"}[dimension]
    of = f"each diagonal entry is {ratio} the sum of the others in its row, and all are of one sign"
    found = _of_kind("mass", f"a mass matrix of linear elements on {_SIMPLICES[dimension]}", of)
    advice = {1: LENGTHS, 2: "" if planar else found.advice, 3: found.advice}[dimension]
    return replace(found, advice=advice)


def _mass(matrix: OperatorMatrix, bounds: tuple[float, float]) -> Diagnosis:
    """A mass matrix of other elements, or of several unknowns per node, by its eigenvalues."""
    used = matrix.edges[matrix.entries != 0]
    cells = cells_of(matrix.n, used)
    n_parts = len(components(matrix.n, used))
    name = "a consistent mass matrix"
    if (cells.nodes, cells.shared) in _CELLS and n_parts == 1:
        name += f" of {_CELLS[cells.nodes, cells.shared][1]}"
    elif nodes_of_pattern(matrix.csr()) is not None or n_parts > 1 or often(cells.twins):
        name += " of several unknowns per node"
    massless = int((matrix.diagonal == 0).sum())
    return _of_kind(
        "mass",
        name,
        f"scaled to identity blocks its least eigenvalue is {bounds[0]:.2g}, where those of stiffnesses near zero",
        f"its couplings add up in one vector, to a largest eigenvalue of {bounds[1]:.2g}, as under a translation",
        f"{count_of(massless, 'row is', 'rows are')} zero, of unknowns without a mass" if massless else "",
    )


def _by_cells(matrix: OperatorMatrix, sums: Sums) -> Diagnosis:
    """A matrix whose graph is not planar, by the cells that its graph shows, or entries where it lacks zeros."""
    used = matrix.edges[matrix.entries != 0] if matrix.entries.any() else matrix.edges
    for edges in (matrix.edges, used):  # zeros that are stored show cells better than where they are left out
        cells = cells_of(matrix.n, edges)
        several = often(cells.twins)  # unknowns in a node, or nodes inside of an edge or cell
        operator = _operator(matrix, sums, cells)
        kind, name = _CELLS.get((cells.nodes, cells.shared), ("", ""))
        # About half of the pairs of quadrilaterals are diagonals.
        doubtful = {"quadrilaterals": cells.often < 1 - MOST, "hexahedra": several and cells.nodes == 8}
        if kind and not doubtful.get(kind):
            shown = f"rows form cliques of {cells.nodes}, neighbours of which share {cells.shared} rows"
            return _of_kind(kind, f"{operator} of {name}", shown, *sums.evidence)
        if not (often(cells.often) or several) and mostly(cells.in_fours):
            shown = f"{cells.in_fours:.0%} of the coupled pairs of rows lie in a clique of four"
            return _of_kind("tetrahedra", f"{operator} of linear elements on tetrahedra", shown, *sums.evidence)
        if _has_middles(matrix):
            shown = "most rows have the entries of middles of sides, four times those of the ends and of the other sign"
            return _of_kind("quadratic", "a stiffness matrix of quadratic elements on triangles", shown, *sums.evidence)
        if not (often(cells.in_fours) or several) and mostly(cells.in_threes) and len(edges) >= 2.5 * matrix.n:
            shown = f"{cells.in_threes:.0%} of the coupled pairs of rows lie in triangles, few in a clique of four"
            name = f"{operator} of linear elements on triangles, on a surface that cannot be laid flat"
            return _of_kind("surface", name, shown, *sums.evidence)
        if _is_grid(matrix.n, edges, cells):
            shown = "no three rows are coupled to each other, and most rows are coupled to six"
            return _of_kind("grid in space", "that of a grid in space, a seven-point stencil", shown, *sums.evidence)
    return _unknown(sums)


def _unknown(sums: Sums) -> Diagnosis:
    return Diagnosis(
        UNKNOWN,
        "no scalar matrix of a kind that is known",
        ("neither its graph nor its sums show one", *sums.evidence),
        "see which elements and terms it was assembled with",
    )


def _of_kind(kind: str, name: str, *evidence: str) -> Diagnosis:
    said = tuple(filter(None, evidence))
    without = "keep all rows and columns, those on the boundary too" if "eliminated" in said[-1] else ""
    return Diagnosis(kind, name, said, UNREAD.get(kind, without))


def _further(sums: Sums) -> str:
    """What was added to the Laplacian."""
    if (sums.zero | sums.alone).all():
        return ""
    if sums.penalised.any() and (sums.zero | sums.alone | sums.penalised).all():
        return ", plus a diagonal"
    if sums.zero.any():
        return ", plus a diagonal or without some unknowns"
    return ", plus a diagonal or a mass matrix" if sums.sign else ", plus a diagonal"


def _operator(matrix: OperatorMatrix, sums: Sums, cells: Cells) -> str:
    # Of a mass matrix of quadratic triangles the sums of vertices are zero, a quarter of all.
    if (cells.nodes, cells.shared) == (6, 3) and 0 < sums.zero.mean() < 1 - MOST:
        return "a mass matrix"
    if sums.zero.any():
        return "a stiffness matrix"
    return "a stiffness matrix, plus a mass matrix or a diagonal,"


def _mass_of_simplices(matrix: OperatorMatrix) -> int:
    """Dimension of the simplices whose mass matrix with linear elements this is; 0 for none.

    A simplex of volume V in d dimensions adds 2 V / ((d + 1) (d + 2)) to each diagonal entry and half as much to each
    of d off-diagonal ones in the same row.
    """
    sign = np.sign(matrix.entries[0])  # rows of zeros, as inside of a mesh whose boundary has masses, do no harm
    if sign == 0 or not ((matrix.entries * sign > 0).all() and (matrix.diagonal * sign >= 0).all()):
        return 0
    others = np.bincount(matrix.edges.ravel(), np.repeat(matrix.entries, 2), matrix.n)
    return next(
        (d for d in _SIMPLICES if np.allclose(d * matrix.diagonal, 2 * others, rtol=SUMMED, atol=0)),
        0,
    )


def _has_middles(matrix: OperatorMatrix, most: int = 400) -> bool:
    """Whether rows m have neighbours i, j with A_im = A_jm = -4 A_ij, as middles of the sides of quadratic triangles.

    Both entries are multiples of the same cotangents, so that neither is left out without the other; of zeros that are
    not stored there is no trace. Looked for in `most` rows.
    """
    A, least = matrix.csr(), ROUNDED * matrix.row_size
    sample = range(0, matrix.n, max(1, matrix.n // most))

    @cache
    def entries(i: int) -> dict[int, float]:
        row = slice(A.indptr[i], A.indptr[i + 1])
        return {j: v for j, v in zip(A.indices[row].tolist(), A.data[row].tolist(), strict=True) if abs(v) > least[i]}

    def between(m: int) -> bool:
        ends = sorted((value, i) for i, value in entries(m).items() if i != m)
        return any(
            abs(u - v) <= SUMMED * abs(u) and abs(entries(i).get(j, 0.0) + u / 4) <= SUMMED * abs(u)
            for k, (u, i) in enumerate(ends)
            for v, j in ends[k + 1 : k + 4]
        )

    return sum(map(between, sample)) >= (1 - MOST) * len(sample)


def _is_graph(matrix: OperatorMatrix, sums: Sums) -> bool:
    """Whether all entries are equal and all rows add up to zero."""
    entries = matrix.entries
    equal = np.ptp(entries) <= ROUNDED * np.abs(entries).max()
    return bool(matrix.n >= _SMALL and equal and entries[0] < 0 and (sums.zero | sums.alone).all())


def _is_grid(n: int, edges: NDArray[np.int64], cells: Cells) -> bool:
    degree = np.bincount(edges.ravel(), minlength=n)
    return bool(not cells.in_threes and degree.max() == 6 and 2 * len(edges) >= 3.5 * n)


def _first(rows: NDArray[np.bool_]) -> int:
    return int(rows.argmax())
