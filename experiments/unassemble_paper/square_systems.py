"""Section 3.3's square system of picked interior equations, by the Krylov methods it names and by later ones."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from unassemble.paper import AngleSystem, square_rows

from .cases import Case
from .tables import Table, table

METHODS = {"GMRES": "gmres", "BiCG": "bicg", "BiCGSTAB": "bicgstab", "QMR": "qmr"}
_RTOL, _MOST = 1e-6, 4_000  # relative residual asked for; products with J and its transpose at most, GMRES apart


def picked(system: AngleSystem, x: NDArray) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """The square matrix at x, and the right-hand side -F of its rows."""
    jacobian = system.jacobian(x).sparse()
    rows = square_rows(jacobian.shape, system.row_of_interior, system.row_of_edges)
    return jacobian[rows], -system.residual(x)[rows]


def paired(matrix: sp.csr_array, rhs: NDArray) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Rows moved so that the product of the diagonal's sizes is greatest: one way to pair equations with unknowns."""
    cost = abs(matrix.tocsr())
    cost.eliminate_zeros()
    cost.data = 1 + np.log(cost.data.max() / cost.data)
    row, column = min_weight_full_bipartite_matching(cost)
    order = np.empty_like(row)
    order[column] = row
    return matrix[order], rhs[order]


def solved_by(method: str, matrix: sp.csr_array, rhs: NDArray) -> tuple[int, float]:
    """Products with the matrix and its transpose, and the relative residual; GMRES takes as many as rows at most."""
    count = 0

    def product(operand: sp.csr_array, v: NDArray) -> NDArray:
        nonlocal count
        count += 1
        return operand @ v

    transposed = matrix.T.tocsr()
    operator = spla.LinearOperator(
        matrix.shape, matvec=lambda v: product(matrix, v), rmatvec=lambda v: product(transposed, v), dtype=float
    )
    most = {"restart": len(rhs), "maxiter": 1} if method == "gmres" else {"maxiter": _MOST // 2}
    x, _ = getattr(spla, method)(operator, rhs, rtol=_RTOL, **most)
    return count, float(np.linalg.norm(matrix @ x - rhs) / np.linalg.norm(rhs))


def newton_by_lu(system: AngleSystem, x: NDArray, *, steps: int = 12) -> float:
    """The least |F|, of all equations, in so many Newton steps on the square system."""
    least = float(np.linalg.norm(system.residual(x)))
    for _ in range(steps):
        matrix, rhs = picked(system, x)
        try:
            x = x + spla.splu(sp.csc_array(matrix)).solve(rhs)
        except RuntimeError:  # exactly singular
            break
        size = float(np.linalg.norm(system.residual(x)))
        if not np.isfinite(size):
            break
        least = min(least, size)
    return least


def square_table(cases: Iterable[Case]) -> Table:
    """Every method at pi/3 and beside the solution: angles off by normal errors (seed 0), kept in [0.05, 3.09]."""
    rows: list[list[str | int | float | None]] = []
    for case in cases:
        system = case.system(scale_free=case.corners.counts.h == 0)  # only so is it square or has rows to spare
        near = np.random.default_rng(0).standard_normal(case.angles.size)
        for where, angles in (
            ("pi/3", np.full_like(case.angles, np.pi / 3)),
            *((f"off by {e:g}", np.clip(case.angles + e * near, 0.05, 3.09)) for e in (0.1, 1e-3)),
        ):
            x = system.pack(angles)
            values = np.linalg.svd(picked(system, x)[0].toarray(), compute_uv=False)
            lost = int((values < 1e-9 * values[0]).sum())
            lu = None if lost else newton_by_lu(system, x)
            for name, form in (("as they stand", picked(system, x)), ("matched", paired(*picked(system, x)))):
                cells = [_told(*solved_by(method, *form)) for method in METHODS.values()]
                condition = None if lost else float(values[0] / values[-1])
                rows.append([f"Figure {case.figure}", where, len(values), lost, condition, lu, name, *cells])
    columns = ("mesh", "angles", "unknowns", "rank lost", "condition", "Newton by LU: least |F|", "rows", *METHODS)
    return table("square", columns, rows)


def _told(products: int, residual: float) -> str:
    return f"{products:,}" if residual <= 1.01 * _RTOL else f"no: {residual:.0e}"
