"""Why a mesh has its status, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..tolerances import ALIKE, CERTIFIED, CONFIDENCE, LARGEST_NOISE, NEARLY_ALL
from ..topology import Topology
from ..words import count_of, words_of
from .evidence import Evidence
from .noise import NoiseTest

if TYPE_CHECKING:
    from .verdict import Findings

_ROWS = 6  # at most, named as those that hold nearly all of a misfit
_MANY = 50  # entries, of which it can be said what their misfit looks like


def misfit(f: Findings, notes: Sequence[str]) -> str:
    """What does not fit, the gravest first."""
    topology, certificate = f.solved.topology, f.certificate
    if topology.failures:
        parts = count_of(len(topology.failures), "part of the matrix has", "parts of the matrix have")
        return f"{parts} no mesh: {topology.failures[0]}"
    bare = topology.bare_edges[f.solved.matrix.entries[topology.bare_edges] != 0]
    if len(bare):
        i, j = topology.edges[bare[0]]
        if len(bare) == 1:
            return f"the nonzero entry of rows {i} and {j} belongs to no triangle"
        return f"{len(bare):,} nonzero entries belong to no triangle, the first that of rows {i} and {j}"
    if not np.isfinite(certificate.backward_error):
        return "the mesh has triangles that are flat, or points that are not finite"
    if len(certificate.flipped):
        return _turned_over(topology, certificate) + because(notes)
    (i, j), misfit = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
    differs = (
        f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
        f"largest; {CERTIFIED:g} is allowed)"
    )
    remark = _like_noise(certificate, f.evidence, f.solved.scales)
    begun = _culprits(f.evidence) or ("" if remark else _unexplained(certificate))
    return begun + differs + remark + because(notes)


def _culprits(evidence: Evidence) -> str:
    """The beginning of a sentence where entries are to blame."""
    if not len(evidence.suspects):
        return ""
    k, (i, j) = len(evidence.suspects), evidence.suspects[0]
    if k == 1:
        return f"the entry of rows {i} and {j} stands out: without it a mesh fits all others; "
    return f"{k} entries stand out, first that of rows {i} and {j}: without them a mesh fits all others; "


def _unexplained(certificate: Certificate) -> str:
    """The beginning of a sentence where no few entries are to blame: how much is left, and around which rows."""
    if certificate.backward_error <= ALIKE:
        return ""
    squares = certificate.misfits**2
    left = squares.copy()
    rows: list[int] = []
    while len(rows) < _ROWS and left.sum() > (1 - NEARLY_ALL) * squares.sum():
        at_row = np.bincount(certificate.pairs.ravel(), np.repeat(left, 2))
        rows.append(int(at_row.argmax()))
        left[(certificate.pairs == rows[-1]).any(axis=1)] = 0.0
    share = 1 - left.sum() / squares.sum()
    count = int((certificate.misfits > ALIKE).sum())
    return (
        f"no set of cells was found that fits: {count_of(count, 'entry', 'entries')} of {len(squares):,} "
        f"{'is' if count == 1 else 'are'} left unexplained, with {share:.0%} of the squared misfit in "
        f"{'row' if len(rows) == 1 else 'the rows'} {words_of(sorted(rows))}; "
    )


def _like_noise(certificate: Certificate, evidence: Evidence, scale: NDArray) -> str:
    """The remark that the misfit is small and nowhere concentrated; of few entries that cannot be said."""
    size = np.abs(certificate.differences)
    if len(evidence.suspects) or not evidence.noise or not evidence.noise <= LARGEST_NOISE * np.abs(scale).min():
        return ""
    if size.max() > 8 * np.sqrt(np.mean(size**2)):
        return ""
    if len(size) < _MANY:
        return f"; noise of standard deviation {evidence.noise:.2g} in the entries would leave as much"
    return f"; the misfit looks like noise of standard deviation {evidence.noise:.2g} in the entries"


def because(notes: Sequence[str]) -> str:
    """The end of a sentence: stages that did not converge."""
    return "; " + "; ".join(notes) if notes else ""


def _turned_over(topology: Topology, certificate: Certificate) -> str:
    triangles = np.concatenate([piece.vertices[piece.triangles] for piece in topology.pieces])
    rows = words_of(np.sort(triangles[certificate.flipped[0]]))
    k = len(certificate.flipped)
    which = "1 triangle is" if k == 1 else f"{k} triangles are"
    return f"{which} flat or turned over, the first that of rows {rows}"


def with_noise(f: Findings, test: NoiseTest) -> str:
    """What a test against known noise says."""
    certificate = f.certificate
    if test.drowned:
        return (
            f"{test.noise} drowns the cotangents, and almost any mesh would pass: the test is worth something up to "
            f"{test.limit:.2g}, {LARGEST_NOISE:g} times the scale"
        )
    if len(certificate.flipped):
        return _turned_over(f.solved.topology, certificate) + astray(f, f.trouble)
    if not test.likely:
        return _culprits(f.evidence) + unlikely(test, certificate) + astray(f, f.trouble)
    chance = ", but there are too few different entries beyond the unknowns to tell that from chance"
    return f"{test.noise} explains the misfit {_figures(test)}" + (chance if test.coincidence else "")


def astray(f: Findings, notes: Sequence[str]) -> str:
    """The end of the sentence on a mesh that is not the one of known noise: where the polish has ended."""
    if len(f.evidence.suspects):
        return because(notes)
    if not f.polished:
        return "; the mesh was not polished" + because(notes)
    return (
        "; the polish has not come to a mesh that explains the matrix, and whether that is because of the start, "
        "wrong entries or wrong cells cannot be told"
    ) + because(notes)


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


def ambiguous(others: list[Alternative], certificate: Certificate) -> str:
    """The reason of a mesh that fits, where others do as well."""
    first = others[0]
    more = f"; likewise in {count_of(len(others) - 1, 'more part')} of the matrix" if len(others) > 1 else ""
    instead = f" in place of {_cells(first.cells)}" if first.cells else " besides"
    return (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but so does another, with the cells "
        f"{_cells(first.other_cells)}{instead}{more}"
    )


def nothing_to_spare(certificate: Certificate, rows: NDArray[np.int64]) -> str:
    """The reason of a mesh with pieces of as many unknowns as equations, by a row of each."""
    which = (
        f"the piece of row {rows[0]} has"
        if len(rows) == 1
        else f"{len(rows)} pieces, the first that of row {rows[0]}, have"
    )
    return (
        f"{which} no entry to spare: nearly any entries belong to such a mesh, and that it gives the matrix back to "
        f"{certificate.backward_error:.1e} proves nothing; give the scale if it is known"
    )


def far_away(origins: NDArray, written: Certificate, near: Certificate) -> str:
    """The reason of a mesh that fits until its coordinates are written, too far from the origin."""
    origin = complex(origins[np.abs(origins).argmax()])
    return (
        f"the mesh gives the matrix back to {near.backward_error:.1e}, but its coordinates lie so far from the origin "
        f"that they have too few digits left: as written they give it back to {written.backward_error:.1e}; subtract a "
        f"point near ({origin.real:.6g}, {origin.imag:.6g}) from all of `anchors`"
    )


def _cells(cells: tuple[tuple[int, ...], ...]) -> str:
    shown = ", ".join("-".join(map(str, cell)) for cell in cells[:6])
    return shown + (", ..." if len(cells) > 6 else "")
