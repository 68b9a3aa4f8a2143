"""Exceptions: each message says what is wrong, where, and what to try."""


class UnassembleError(Exception):
    """Base of every error that this library raises on purpose."""


class InputError(UnassembleError):
    """Something given by the caller cannot be used: a file, an option, a combination of options."""


class MatrixFileError(InputError):
    """A file cannot be read as a matrix, or cannot be found."""


class OutputError(InputError):
    """A result cannot be written where it was asked for."""


class RecoveryError(UnassembleError):
    """No mesh can be recovered from this matrix."""


class MatrixError(RecoveryError):
    """The matrix lacks a property that every supported operator has (square, symmetric, finite, ...)."""


class NotPlanarError(RecoveryError):
    """The graph of the matrix is not planar; `why` may say how that shows."""

    def __init__(self, message: str, why: str = ""):
        super().__init__(message)
        self.why = why


class TopologyError(RecoveryError):
    """The graph of the matrix is not that of a planar mesh of triangles."""


class GeometryError(RecoveryError):
    """The numbers of the matrix fit no planar mesh on its graph."""


class SolverError(RecoveryError):
    """A sparse factorisation broke down."""


class FormatError(RecoveryError):
    """A file format cannot hold the result."""
