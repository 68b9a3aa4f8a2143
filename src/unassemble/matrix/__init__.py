"""From a file or a scipy matrix to a clean symmetric operator."""

from .operator import OperatorMatrix

__all__ = ["OperatorMatrix"]
