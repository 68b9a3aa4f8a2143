"""What a matrix is, and what can be recovered from it, without recovering it."""

from .inspect import inspect_matrix as inspect_matrix
from .inspection import Inspection as Inspection
