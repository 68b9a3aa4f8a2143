"""From everything that is known of a finished mesh to its status: decided here, once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certificate import Certificate
from ..recovery import PlanarMesh
from ..words import Reason
from .evidence import Evidence
from .held import Held
from .reasons import ambiguous, far_away, objections
from .solving import Solved


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a verdict is made of."""

    solved: Solved
    mesh: PlanarMesh  # relative to the origins of its pieces
    origins: NDArray[np.complex128]  # (pieces,)
    # the mesh about these origins, and as it is written
    near: Held
    written: Held
    evidence: Evidence

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


def verdict(
    f: Findings, other_meshes: Callable[[Findings], tuple[list[Alternative], str]]
) -> tuple[str, str | None, Reason, list[Alternative]]:
    """What a mesh is worth; others that fit are looked for only if nothing else speaks against it.

    Status, ``"certified"``, ``"uncertified"`` or ``"ambiguous"``; whether other meshes fit, ``"proved"``,
    ``"searched"``, ``"ambiguous"``, or None where this one does not; the reason; and the others.
    """
    against = list(objections(f))
    if against:
        advice = next((advice for _, advice in against if advice), "")
        return "uncertified", None, Reason.of(*(said for said, _ in against), advice=advice), []
    others, uniqueness = other_meshes(f)
    if others:
        return "ambiguous", uniqueness, ambiguous(others, f.certificate), others
    if not f.written.passes:
        return "uncertified", uniqueness, far_away(f.origins, f.written.certificate, f.certificate), []
    return "certified", uniqueness, Reason(f.fits), []
