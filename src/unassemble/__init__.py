"""unassemble: from a sparse matrix back to the mesh it was assembled on."""

from __future__ import annotations

from ._version import __version__

TYPE_CHECKING = False  # type checkers know the name; to import typing would take most of the time that this module does
if TYPE_CHECKING:
    from .errors import (
        FormatError,
        GeometryError,
        InputError,
        MatrixError,
        MatrixFileError,
        NotPlanarError,
        OutputError,
        RecoveryError,
        SolverError,
        TopologyError,
        UnassembleError,
    )
    from .inspection import inspect_matrix
    from .pipeline import recover
    from .recovery import Body, ConformingMesh, PlanarMesh, Recovery, Structure, Surface

__all__ = [
    "Body",
    "ConformingMesh",
    "FormatError",
    "GeometryError",
    "InputError",
    "MatrixError",
    "MatrixFileError",
    "NotPlanarError",
    "OutputError",
    "PlanarMesh",
    "Recovery",
    "RecoveryError",
    "SolverError",
    "Structure",
    "Surface",
    "TopologyError",
    "UnassembleError",
    "__version__",
    "inspect_matrix",
    "recover",
]


# Imported on first use: the command line answers --help without loading scipy. All others are errors.
_HOMES = {
    "inspect_matrix": "inspection",
    "recover": "pipeline",
    **dict.fromkeys(("Body", "ConformingMesh", "PlanarMesh", "Recovery", "Structure", "Surface"), "outputs"),
}


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(f".{_HOMES.get(name, 'errors')}", __name__), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
