"""Choice of the sparse direct solver."""

from __future__ import annotations

import os
from typing import Protocol

from numpy.typing import NDArray

from ..errors import InputError
from . import pardiso
from .dense import DenseFactorisation
from .superlu import SuperLUFactorisation
from .upper import UpperTriangle

_VARIABLE = "UNASSEMBLE_SOLVER"


class Factorisation(Protocol):
    """A Hermitian matrix pattern, analysed once and factorised as often as its entries change."""

    def factorise(self, matrix: UpperTriangle) -> None:
        """Factorise a matrix with the analysed pattern."""

    def solve(self, rhs: NDArray) -> NDArray:
        """Solve for one right-hand side (n,) or several (n, k)."""

    def release(self) -> None:
        """Give the memory of the factor back."""


def backend() -> str:
    """Name of the solver in use: ``"pardiso"`` where it loads, else ``"superlu"``.

    The environment variable ``UNASSEMBLE_SOLVER`` overrides the choice.
    """
    wanted = os.environ.get(_VARIABLE, "")
    if wanted not in ("", "pardiso", "superlu"):
        raise InputError(f"{_VARIABLE} is {wanted!r}; it can be 'pardiso' or 'superlu'")
    if wanted == "superlu":
        return "superlu"
    if pardiso.available():
        return "pardiso"
    if wanted == "pardiso":
        raise InputError(f"{_VARIABLE} is 'pardiso', but MKL does not load; try: pip install 'unassemble[fast]'")
    return "superlu"


def factorisation(matrix: UpperTriangle, *, definite: bool = False) -> Factorisation:
    """Analyse the pattern of a Hermitian matrix for factorisation; see :class:`Factorisation`."""
    if DenseFactorisation.suits(matrix):
        return DenseFactorisation(matrix, definite=definite)
    if backend() == "pardiso":
        return pardiso.PardisoFactorisation(matrix, definite=definite)
    return SuperLUFactorisation(matrix, definite=definite)
