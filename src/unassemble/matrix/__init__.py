"""From a file or a scipy matrix to a clean symmetric operator."""

from .canonical import as_csr
from .check import check_matrix
from .digits import Digits
from .operator import OperatorMatrix
from .read import is_file, load, read_matrix

__all__ = [
    "Digits",
    "OperatorMatrix",
    "as_csr",
    "check_matrix",
    "is_file",
    "load",
    "read_matrix",
]
