"""The end of every recovery: place the mesh, compare it with its matrix, judge it, and give it back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..certificate import Findings, judge
from ..clock import Clock
from .base import Recovery


class Comparison(Protocol):
    """A mesh compared with its matrix."""

    @property
    def backward_error(self) -> float:
        """The largest misfit, as in :class:`.Recovery`."""

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """At most so many entries that fit worst, (k, 2), worst first, and their misfits, (k,)."""


Mesh = TypeVar("Mesh", bound=Recovery)
Compared = TypeVar("Compared", bound=Comparison)


@dataclass(frozen=True)
class Placed(Generic[Mesh]):
    """A mesh as it is to be written, with all its fields but those of its verdict."""

    mesh: Mesh
    notes: Sequence[str] = ()  # what was changed, guessed or left open so far


@dataclass(frozen=True)
class Examined:
    """What was found out about a mesh that was compared with its matrix."""

    findings: Findings
    notes: Sequence[str] = ()  # what is to be said of it besides
    fields: Mapping[str, Any] = field(default_factory=dict)  # further fields of the result, by name


def finish(
    clock: Clock,
    place: Callable[[], Placed[Mesh]],
    compare: Callable[[Mesh], Compared],
    examine: Callable[[Mesh, Compared], Examined],
) -> Mesh:
    """Give back a mesh with what it is worth.

    Parameters
    ----------
    clock : Clock
        Measures the stages ``"place"`` and ``"certify"``.
    place : callable
        Puts the mesh where anchors, or conventions, want it. What it returns is what is written.
    compare : callable
        Assembles the operator again on the mesh as written and compares it with the matrix; a
        function of :mod:`unassemble.certificate` does the work.
    examine : callable
        Finds out what speaks for this mesh and against it.

    Returns
    -------
    Recovery
        The mesh with `verdict`, `backward_error`, `warnings`, `timings`, and, where it is refused,
        the entries that fit worst.
    """
    with clock("place"):
        placed = place()
    with clock("certify"):
        comparison = compare(placed.mesh)
        examined = examine(placed.mesh, comparison)
        verdict = judge(examined.findings)
    worst, misfits = comparison.worst(10 if verdict.status == "uncertified" else 0)
    return replace(
        placed.mesh,
        verdict=verdict,
        backward_error=comparison.backward_error,
        worst_entries=worst,
        worst_misfits=misfits,
        warnings=(*placed.notes, *examined.notes),
        timings=clock.timings,
        **examined.fields,
    )
