"""Text with lines of row, column and entry."""

import io
import warnings
from typing import BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError


def read_triplets(stream: BinaryIO, name: str) -> sp.coo_array:
    """Read lines of row, column and entry, as MATLAB's ``save`` with ``-ascii`` and many codes write them.

    Blanks, commas or semicolons stand between; comments begin with % or #. Rows and columns count from 0 if a 0 occurs
    in either, else from 1. The matrix is square, as large as its largest number asks for; a file with entries on one
    side of the diagonal only is taken for the half of a symmetric matrix.

    Raises MatrixFileError if a line is of another form.
    """
    text = stream.read().decode("utf-8-sig", "replace").translate(str.maketrans(",;Dd", "  Ee"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            table = np.loadtxt(io.StringIO(text), comments=("%", "#"), ndmin=2, dtype=np.float64)
    except ValueError as error:
        why = str(error).split(";")[0].rstrip(".")[:100]
        raise MatrixFileError(
            f"{name} has a line that is no row, column and entry ({why}), as its first line is"
        ) from error
    places = table[:, :2]
    if table.shape[1] != 3 or (places != np.floor(places)).any() or (places < 0).any() or (places >= 2.0**53).any():
        raise MatrixFileError(f"{name} has lines that are no row, column and entry: two whole numbers, and a third one")
    row, column = (places - (0 if (places == 0).any() else 1)).astype(np.int64).T
    values, n = table[:, 2], int(max(row.max(), column.max())) + 1
    off = row != column
    if off.any() and ((row >= column).all() or (row <= column).all()):
        row, column = np.append(row, column[off]), np.append(column, row[off])
        values = np.append(values, values[off])
    return sp.coo_array((values, (row, column)), shape=(n, n))
