"""Why a mesh has its status, in at most two sentences, the important one first; and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..planar.terms import COEFFICIENT, MASS, Term
from ..tolerances import ALIKE, CERTIFIED, CONFIDENCE, LARGEST_NOISE
from ..topology import Topology
from ..words import Reason, count_of, words_of
from .evidence import Evidence
from .noise import NoiseTest

if TYPE_CHECKING:
    from .verdict import Findings

_MANY = 50  # entries, of which it can be said what their misfit looks like

_CHECK_MODEL = "see what `inspect_matrix` says the matrix is: a wrong model leaves a misfit everywhere"
_ONE_COEFFICIENT = "see whether a coefficient varies from cell to cell, the surface is curved or it is a network"
_KEEP_ROWS = "keep the rows and columns of all unknowns, those on the boundary too: some rows do not add up to zero"
_LEAVE_SCALE = "leave out `scale`: it is found where it is not given"
_GIVE_NOISE = "if the entries are measured, give the standard deviation of their errors as `noise`"


def misfit(f: Findings, notes: Sequence[str]) -> Reason:
    """What does not fit, the gravest first; `notes` are stages that did not converge."""
    topology, certificate, evidence = f.solved.topology, f.certificate, f.evidence
    if topology.failures:
        parts = count_of(len(topology.failures), "part of the matrix has", "parts of the matrix have")
        return Reason.of(f"{parts} no mesh: {topology.failures[0]}", advice=_CHECK_MODEL)
    without = f.stored.incomplete_rows.any()
    model = _KEEP_ROWS if without else _ONE_COEFFICIENT if f.stored.adds_up.all() else _CHECK_MODEL
    model = _LEAVE_SCALE if f.known_scale else model
    bare = topology.bare_edges[f.solved.matrix.entries[topology.bare_edges] != 0]
    if len(bare):
        i, j = topology.edges[bare[0]]
        some = count_of(len(bare), "nonzero entry belongs", "nonzero entries belong")
        return Reason.of(f"{some} to no triangle, the first that of rows {i} and {j}", advice=model)
    if len(certificate.flipped):
        return Reason.of(_turned_over(topology, certificate), *notes, advice=model)
    (i, j), largest = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
    differs = (
        f"the re-assembled matrix differs most in the entry of rows {i} and {j}, by {largest:.1e} of the row's largest "
        f"entry where {CERTIFIED:g} is allowed"
    )
    if evidence.term and not f.known_scale:
        return lacking(f, evidence.term)
    if stands_out := _culprits(evidence):
        return Reason.of(stands_out, *notes, differs, advice="check the entries that stand out, which the report lists")
    if without:
        return Reason.of(
            _unexplained(certificate) or differs,
            "only some rows add up to zero, as next to unknowns that were eliminated",
            advice=_KEEP_ROWS,
        )
    remark = _like_noise(certificate, evidence, f.solved.scales)
    if remark and f.stored.adds_up.all():
        return Reason.of(
            differs,
            "all rows add up to zero, which errors of single entries would not leave",
            advice=_ONE_COEFFICIENT,
        )
    if remark:
        return Reason.of(remark, differs, *notes, advice=_GIVE_NOISE)
    return Reason.of(_unexplained(certificate), differs, *notes, advice=model)


def lacking(f: Findings, term: Term) -> Reason:
    """The reason of a misfit that a term explains which the model does not have."""
    share = f"{term.share:.0%}" if term.share < 0.995 else "nearly all"
    begun = f"the misfit is no noise, since a term that the model lacks explains {share} of its square"
    if term.name == COEFFICIENT or f.stored.adds_up.all():  # with a mass matrix, or one number added, rows do not
        which = "a coefficient that varies in space leaves such, and a constant one is assumed"
        return Reason.of(begun, which, advice="assemble the matrix with a constant coefficient")
    if term.name == MASS:
        which = "it has the form of a mass matrix, and the rows do not add up to zero: A = c L + s M"
        return Reason.of(begun, which, advice="assemble the stiffness matrix alone, or lump the mass matrix")
    return Reason.of(begun, "most entries are off in one direction", advice=_CHECK_MODEL)


def _culprits(evidence: Evidence) -> str:
    """The sentence on entries that are to blame; empty where none are."""
    if not len(evidence.suspects):
        return ""
    i, j = evidence.suspects[0]
    return f"the entry of rows {i} and {j} stands out from the misfit of all others"


def _unexplained(certificate: Certificate) -> str:
    """The sentence where no few entries are to blame; empty where little is left."""
    if certificate.backward_error <= ALIKE:
        return ""
    count, whole = int((certificate.misfits > ALIKE).sum()), len(certificate.misfits)
    left = "1 entry is" if count == 1 else f"{count:,} entries are"
    return f"no set of cells was found that fits: {left} left unexplained, of {whole:,}"


def _like_noise(certificate: Certificate, evidence: Evidence, scale: NDArray) -> str:
    """The remark that the misfit is small and nowhere concentrated; of few entries that cannot be said."""
    size = np.abs(certificate.differences)
    if not evidence.noise or not evidence.noise <= LARGEST_NOISE * np.abs(scale).min():
        return ""
    if size.max() > 8 * np.sqrt(np.mean(size**2)):
        return ""
    size_of = f"noise of standard deviation {evidence.noise:.2g} (absolute) in the entries"
    return f"{size_of} would leave as much" if len(size) < _MANY else f"the misfit looks like {size_of}"


def _turned_over(topology: Topology, certificate: Certificate) -> str:
    triangles = np.concatenate([piece.vertices[piece.triangles] for piece in topology.pieces])
    which = count_of(len(certificate.flipped), "triangle is", "triangles are")
    return f"{which} flat or turned over, the first that of rows {words_of(np.sort(triangles[certificate.flipped[0]]))}"


def with_noise(f: Findings, test: NoiseTest) -> Reason:
    """What a test against known noise says."""
    certificate = f.certificate
    if test.drowned:
        return Reason.of(
            f"{test.noise} drowns the cotangents, and almost any mesh would pass: the test is worth something up to "
            f"{test.limit:.2g}, {LARGEST_NOISE:g} times the scale",
            advice="give less noise, if the entries are that good",
        )
    if len(certificate.flipped):
        return Reason.of(_turned_over(f.solved.topology, certificate), *astray(f), advice=_CHECK_MODEL)
    if f.evidence.term:
        return lacking(f, f.evidence.term)
    if not test.likely:
        return Reason.of(
            _culprits(f.evidence), unlikely(test, certificate), *astray(f), advice="check the noise, and the entries"
        )
    chance = ", but there are too few different entries beyond the unknowns to tell that from chance"
    return Reason.of(
        f"{test.noise} explains the misfit {_figures(test)}" + (chance if test.coincidence else ""),
        advice="write the entries with more digits" if test.coincidence else "",
    )


def astray(f: Findings) -> list[str]:
    """Sentences on a mesh that is not the one of known noise: where the polish has ended."""
    if len(f.evidence.suspects):
        return f.trouble
    if not f.polished:
        return ["the mesh was not polished", *f.trouble]
    return [
        "the polish has not come to a mesh that explains the matrix, and whether that is because of the start, "
        "wrong entries or wrong cells cannot be told",
        *f.trouble,
    ]


def unlikely(test: NoiseTest, certificate: Certificate) -> str:
    """That noise would not leave such a misfit."""
    if test.figures["p_value"] < CONFIDENCE:
        return f"the misfit is more than {test.noise} explains {_figures(test)}"
    i, j = certificate.pairs[test.worst]
    return (
        f"the entry of rows {i} and {j} is off by {test.figures['largest']:.1f} standard deviations of {test.noise}, "
        f"more than the largest of {len(certificate.pairs)} would be"
    )


def _figures(test: NoiseTest) -> str:
    statistic, freedom, p_value = (test.figures[name] for name in ("statistic", "degrees_of_freedom", "p_value"))
    return f"(chi-square {statistic:.4g} with {freedom:.4g} degrees of freedom, p = {p_value:.3g})"


def ambiguous(others: list[Alternative], certificate: Certificate) -> Reason:
    """The reason of a mesh that fits, where others do as well."""
    first = others[0]
    instead = f" in place of {_cells(first.cells)}" if first.cells else " besides"
    return Reason.of(
        f"the mesh gives the matrix back to {certificate.backward_error:.1e} (relative), but so does another, with "
        f"the cells {_cells(first.other_cells)}{instead}",
        f"likewise in {count_of(len(others) - 1, 'more part')} of the matrix" if len(others) > 1 else "",
        advice="choose by what else is known of the mesh: the report lists all cells in doubt",
    )


def nothing_to_spare(certificate: Certificate, rows: NDArray[np.int64], *, known_scale: bool) -> Reason:
    """The reason of a mesh with pieces of as many unknowns as equations, by a row of each."""
    which = (
        f"the piece of row {rows[0]} has" if len(rows) == 1 else f"{len(rows)} pieces, as that of row {rows[0]}, have"
    )
    return Reason.of(
        f"{which} no entry to spare: nearly any entries belong to such a mesh, and that it gives the matrix back to "
        f"{certificate.backward_error:.1e} (relative) proves nothing",
        advice="" if known_scale else "give `scale` if it is known",
    )


def far_away(origins: NDArray, written: Certificate, near: Certificate) -> Reason:
    """The reason of a mesh that fits until its coordinates are written, too far from the origin."""
    origin = complex(origins[np.abs(origins).argmax()])
    return Reason.of(
        f"the mesh gives the matrix back to {near.backward_error:.1e} (relative), but its coordinates lie so far from "
        f"the origin that they have too few digits left: as written they give it back to "
        f"{written.backward_error:.1e} (relative)",
        advice=f"subtract a point near ({origin.real:.6g}, {origin.imag:.6g}) from all of `anchors`",
    )


def _cells(cells: tuple[tuple[int, ...], ...]) -> str:
    shown = ", ".join("-".join(map(str, cell)) for cell in cells[:6])
    return shown + (", ..." if len(cells) > 6 else "")
