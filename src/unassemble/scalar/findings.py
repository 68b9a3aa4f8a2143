"""All that is found out about a finished planar mesh, and what becomes of it in the verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certificate import Certificate, Findings, Unique
from ..recovery import PlanarMesh
from ..tolerances import CERTIFIED
from .evidence import MisfitEvidence
from .held import PlanarComparison
from .reasons import ambiguous, objections
from .solving import Solved


@dataclass(frozen=True, eq=False)
class Twice:
    """A planar mesh compared with its matrix about the origins of its pieces, and as it is written."""

    near: PlanarComparison
    written: PlanarComparison
    evidence: MisfitEvidence

    @property
    def backward_error(self) -> float:
        """The largest misfit of the mesh as it is written."""
        return self.written.backward_error

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, those that stand out before others; none where only coordinates lose digits."""
        return self.written.worst(0 if self.near.passes else count, self.evidence.suspects)


@dataclass(frozen=True, eq=False)
class Finished:
    """A planar mesh and all that its verdict is made of."""

    solved: Solved
    mesh: PlanarMesh  # relative to the origins of its pieces
    origins: NDArray[np.complex128]  # (pieces,)
    compared: Twice

    @property
    def near(self) -> PlanarComparison:
        """That of the mesh about its origins, which loses no digits."""
        return self.compared.near

    @property
    def evidence(self) -> MisfitEvidence:
        """What the misfit looks like."""
        return self.compared.evidence

    @property
    def certificate(self) -> Certificate:
        """That of the mesh about its origins."""
        return self.near.certificate

    @property
    def fits(self) -> str:
        """That, and how well, the mesh fits."""
        if noise := self.near.by_noise:
            return f"{noise} explains the misfit {self.near}"
        error = self.certificate.backward_error
        return f"the operator re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"

    @property
    def trouble(self) -> list[str]:
        """Stages that did not converge."""
        return [note for mesh in self.solved.meshes for note in mesh.notes]


Others = tuple[list[Alternative], Unique]


def findings(finished: Finished, other_meshes: Callable[[Finished], Others]) -> tuple[Findings, list[Alternative]]:
    """What speaks for a mesh and against it, and the other meshes that fit as well.

    These are looked for only if nothing else speaks against this one.
    """
    against = tuple(objections(finished))
    others, unique = ([], "searched") if against else other_meshes(finished)
    found = Findings(
        fits=(finished.fits,),
        error=finished.compared.backward_error,
        objections=against,
        another=ambiguous(others, finished.certificate) if others else None,
        unique=unique,
        allowed=np.inf if finished.near.by_noise else CERTIFIED,
    )
    return found, others
