"""From everything that is known of a finished mesh to its status: decided here, once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..certify_spare import without_spare_equations
from ..matrix import OperatorMatrix
from ..tolerances import ALIKE, MAGNIFIED, PLACED
from ..words import Reason
from .evidence import Evidence
from .held import Held
from .joined import JoinedMesh
from .noise import NoiseTest
from .reasons import ambiguous, astray, far_away, misfit, nothing_to_spare, unlikely, with_noise
from .solving import Solved, leaders


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a verdict is made of."""

    stored: OperatorMatrix  # the matrix as given
    solved: Solved
    mesh: JoinedMesh  # relative to the origins of its pieces
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
    def trouble(self) -> list[str]:
        """Stages that did not converge."""
        return [note for mesh in self.solved.meshes for note in mesh.notes]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a mesh is worth."""

    status: str  # {"certified", "uncertified", "ambiguous"}
    # {"proved", "searched", "ambiguous"} or None whether other meshes fit; None where this one does not
    uniqueness: str | None
    reason: Reason
    others: Sequence[Alternative] = ()  # other meshes that fit


def verdict(f: Findings, other_meshes: Callable[[], tuple[list[Alternative], str]]) -> Verdict:
    """The status of a mesh; others that fit are looked for only if nothing else speaks against it."""
    good, reason = _by_itself(f)
    if good:
        points, triangles = f.mesh.points, f.mesh.triangles
        loose = without_spare_equations(f.stored.edges, points, triangles, known_scale=f.known_scale)
        if len(loose):
            good, reason = False, nothing_to_spare(f.certificate, loose, known_scale=f.known_scale)
    if not good:
        return Verdict("uncertified", None, reason)
    others, uniqueness = other_meshes()
    if others:
        return Verdict("ambiguous", uniqueness, ambiguous(others, f.certificate), others)
    if f.near.passes and not f.written.passes:
        return Verdict("uncertified", uniqueness, far_away(f.origins, f.written.certificate, f.certificate))
    return Verdict("certified", uniqueness, reason)


def _by_itself(f: Findings) -> tuple[bool, Reason]:
    """Whether the mesh fits as well as it is sure of its positions, and the reason."""
    error, test, topology = f.certificate.backward_error, f.near.test, f.solved.topology
    good, apart = f.near.passes, _discord(f.solved, error)
    if good and apart:
        return False, Reason.of(f"the matrix is given back to {error:.1e} (relative), but {apart}")
    if test and f.near.by_noise:
        return _by_noise(f, test)
    doubt = max(mesh.doubt for mesh in f.solved.meshes)
    fits = f"the operator re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"
    if not good:
        why = misfit(f, f.trouble)
        return False, Reason.of(apart, advice=why.advice) if apart else why
    if not doubt <= PLACED:
        return False, Reason.of(
            f"{fits}, but so may others: in double precision the entries determine the positions to about {doubt:.0e} "
            "of the size only"
        )
    if len(topology.bare_edges):
        i, j = topology.edges[topology.bare_edges[0]]
        return False, Reason.of(
            f"the mesh gives the matrix back to {error:.1e} (relative), but the stored zero of rows {i} and {j} "
            "belongs to no cell",
            advice="forget stored zeros by `drop_zeros`, if they are no part of the structure",
        )
    return True, Reason(fits)


def _by_noise(f: Findings, test: NoiseTest) -> tuple[bool, Reason]:
    """Where a test against the errors of the entries decides: likely, and no part of it explained by another model."""
    if test.noise.digits and not (test.drowned or test.likely):
        return False, misfit(f, (unlikely(test, f.certificate), *astray(f)))
    reason = with_noise(f, test)
    if f.near.passes and f.evidence.term:
        return False, reason
    doubt = max(mesh.doubt for mesh in f.solved.meshes)
    if f.near.passes and not doubt <= max(PLACED, test.noise.sigma / float(np.abs(f.solved.scales).min())):
        return False, Reason.of(f"{reason.text}, but that mesh need not be the likeliest", *f.trouble)
    return f.near.passes, reason


def _discord(solved: Solved, backward_error: float) -> str:
    """What is wrong where pieces share vertices but not c, errors of entries allowed for; empty if nothing is.

    Each piece by itself has its own c, and errors move it. Where the noise is known the others have been fitted with
    the c of their leaders, if at all.
    """
    topology, noise, c = solved.topology, solved.noise, solved.scales
    if not len(topology.hinges):
        return ""
    lead = leaders(topology)
    difference = np.abs(c / c[lead] - 1)
    # A null vector that is not polished may be off by more than the entries; noise says itself how much it explains.
    if difference.max() > max(ALIKE, 0.0 if noise else MAGNIFIED * backward_error):
        worst = int(difference.argmax())
        named = " and ".join(
            f"{c[p]:.6g} in piece {p}, of row {topology.pieces[p].vertices.min()}" for p in (int(lead[worst]), worst)
        )
        return f"pieces that share vertices have different factors c: {named}"
    if noise is None:
        return ""
    # A piece with entries to spare tells c. One that hangs by a single vertex on pieces of which one does so can only
    # be read in itself, and no other way if nothing has vanished and no triangle, with others all around, is a hole.
    gone = np.zeros(len(topology.edges), dtype=bool)
    gone[topology.vanished] = True
    shared = np.array([np.count_nonzero(topology.multiplicity[piece.vertices] > 1) for piece in topology.pieces])
    otherwise = np.array([gone[p.edge_rows].any() or p.inner[p.opposite].all(axis=1).any() for p in topology.pieces])
    spare = np.array([piece.redundancy > 0 for piece in topology.pieces])
    rough = (shared > 0) & (~spare[lead] | ((otherwise | (shared > 1)) & ~spare))
    if not rough.any():
        return ""
    row = topology.pieces[int(rough.argmax())].vertices.min()
    return f"the piece of row {row}, which shares vertices with others, has too few entries to tell under {noise}"
