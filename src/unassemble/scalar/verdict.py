"""From everything that is known of a finished mesh to its status: decided here, once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..recovery import PlanarMesh
from ..words import Reason
from .evidence import Evidence
from .held import Held
from .noise import NoiseTest
from .reasons import ambiguous, far_away, objections
from .solving import Solved


@dataclass(frozen=True, eq=False)
class Drawn:
    """A mesh of any element in its place."""

    points: NDArray[np.float64]  # (n, 2) of each piece about its origin
    cells: Sequence[NDArray[np.int64]]  # of each kind (m, k), in the order of the certificate
    held: Callable[[NDArray], Certificate]  # the certificate with such points
    loose: Callable[[], NDArray[np.int64]]  # a row of each piece that has no equations to spare
    # other meshes that fit, and whether there are none: ``"proved"``, ``"searched"`` or ``"ambiguous"``
    others: Callable[[Findings], tuple[list[Alternative], str]]
    kind: type[PlanarMesh]
    fields: dict[str, Any]  # what a result of this kind says of it


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a verdict is made of."""

    solved: Solved
    mesh: Drawn
    origins: NDArray[np.complex128]  # (pieces,)
    # the mesh about these origins, and as it is written
    near: Held
    written: Held
    evidence: Evidence
    # whether c is known, and whether a polish was asked for
    known_scale: bool
    polished: bool

    @property
    def certificate(self) -> Certificate:
        """That of the mesh about its origins."""
        return self.near.certificate

    @property
    def test(self) -> NoiseTest | None:
        """That against the errors of the entries, where these decide."""
        return self.near.test if self.near.by_noise else None

    @property
    def fits(self) -> str:
        """That, and how well, the mesh fits."""
        if self.test is None:
            error = self.certificate.backward_error
            return f"the operator re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"
        return f"{self.test.noise} explains the misfit {self.test}"

    @property
    def trouble(self) -> list[str]:
        """Stages that did not converge."""
        return [note for mesh in self.solved.meshes for note in mesh.notes]


def verdict(f: Findings) -> tuple[str, str | None, Reason, list[Alternative]]:
    """What a mesh is worth; others that fit are looked for only if nothing else speaks against it.

    Status, ``"certified"``, ``"uncertified"`` or ``"ambiguous"``; whether other meshes fit, ``"proved"``,
    ``"searched"``, ``"ambiguous"``, or None where this one does not; the reason; and the others.
    """
    against = list(objections(f))
    if against:
        advice = next((advice for _, advice in against if advice), "")
        return "uncertified", None, Reason.of(*(said for said, _ in against), advice=advice), []
    others, uniqueness = f.mesh.others(f)
    if others:
        return "ambiguous", uniqueness, ambiguous(others, f.certificate), others
    if not f.written.passes:
        return "uncertified", uniqueness, far_away(f.origins, f.written.certificate, f.certificate), []
    return "certified", uniqueness, Reason(f.fits), []
