"""From a file or a scipy matrix to a clean symmetric operator."""

from .check import check_matrix
from .loading import load
from .operator import OperatorMatrix
from .read import read_matrix

__all__ = ["OperatorMatrix", "check_matrix", "load", "read_matrix"]
