"""From whatever holds a matrix to a checked one."""

from __future__ import annotations

import os
from typing import Any

from .check import check_matrix
from .operator import OperatorMatrix
from .read import read_matrix


def load(
    source: Any, *, variable: str | None = None, drop_zeros: float | None = None, noise: float | None = None
) -> OperatorMatrix:
    """Read a matrix where `source` names a file, and check it.

    Parameters
    ----------
    source : path, "-", open file, scipy sparse matrix or array, or array_like
    variable : str, optional
        See :func:`read_matrix`.
    drop_zeros, noise : float, optional
        See :func:`check_matrix`.

    Raises
    ------
    InputError
        If the file cannot be read, or an option is out of range.
    MatrixError
        If the matrix fails a check.
    """
    matrix = read_matrix(source, variable=variable) if is_file(source) else source
    return check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)


def is_file(source: Any) -> bool:
    """Whether `source` names a file, or is an open one."""
    return isinstance(source, (str, bytes, os.PathLike)) or hasattr(source, "read")
