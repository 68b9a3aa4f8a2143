"""What is true of a matrix, and changes of its entries that every family may make."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

TESTS = Path(__file__).resolve().parents[2] / "tests"
for folder in ("elasticity", "structures", "boundaries", "metric", "."):
    if str(TESTS / folder) not in sys.path:
        sys.path.insert(0, str(TESTS / folder))

from as_given import written  # noqa: E402


@dataclass(frozen=True, eq=False)
class Truth:
    """A matrix as it is handed over, and what is true of it."""

    matrix: sp.csr_array
    #: (N,) node of each row; rows of scalar matrices are nodes.
    node: NDArray[np.int64]
    #: (n, d) where the nodes are; NaN where no matrix of this kind tells.
    points: NDArray[np.float64]
    #: What is free in each piece: ``"similarity"``; ``"homothety"``, translation and a factor of either sign, and the
    #: names of axes; ``"translation"``, where the true size is in the matrix; ``"lengths"``, of surfaces, any motion.
    gauge: str
    #: (N,) direction of each row, where the answer may name axes otherwise.
    direction: NDArray[np.int64] | None = None
    #: Cells as tuples of nodes, None where the answer's own are not compared.
    cells: tuple[tuple[int, ...], ...] | None = None
    #: (m,) how much each cell contributes to the rows in which it shows most; none where all show.
    shares: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    #: The share above which a certificate misses no cell: ten times what it allows, or what rounding hides.
    seen: float = 1e-8
    #: Whether the mesh gives the entries back: of a damaged matrix another mesh may be right.
    intact: bool = True
    options: dict[str, Any] = field(default_factory=dict)  #: Those of :func:`unassemble.recover`.

    def kept(self, rows: NDArray[np.int64]) -> Truth:
        """Some rows and columns, in this order."""
        direction = None if self.direction is None else self.direction[rows]
        matrix = sp.csr_array(self.matrix[rows][:, rows])
        return replace(self, matrix=matrix, node=self.node[rows], direction=direction)


def rounded(truth: Truth, rng: np.random.Generator) -> Truth:
    """The entries to 4 to 15 significant digits."""
    digits = int(rng.integers(4, 16))
    return replace(truth, matrix=written(truth.matrix, digits), intact=False, seen=max(1e-8, 10.0 ** (2 - digits)))


def damaged(truth: Truth, rng: np.random.Generator) -> Truth:
    """One entry or several off the diagonal changed, and with them the transposed ones, by 1e-9 to 10 of themselves.

    One in four is a new entry where there was none; one in four changes on the diagonal.
    """
    upper = sp.triu(truth.matrix, 1).tocoo()
    n = truth.matrix.shape[0]
    largest = np.abs(truth.matrix.data).max(initial=0.0)
    change = sp.lil_array((n, n))
    for _ in range(int(rng.choice([1, 1, 2, 5]))):
        size = 10 ** rng.uniform(-9, 1) * rng.choice([-1, 1])
        what = rng.integers(4)
        i, j = rng.integers(n, size=2)
        value = size * largest
        if what == 1:
            i, value = j, size * truth.matrix[j, j]
        elif what > 1 and upper.nnz:
            k = rng.integers(upper.nnz)
            i, j, value = upper.row[k], upper.col[k], size * upper.data[k]
        change[i, j] = change[j, i] = value
    return replace(truth, matrix=sp.csr_array(truth.matrix + change), intact=False)
