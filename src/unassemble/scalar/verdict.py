"""From a certificate to a status and a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..cells.judge import FITS
from ..certify import Certificate
from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED, CONFIDENCE, LARGEST_NOISE, SUSPICIOUS
from ..topology import Topology
from ..words import count_of, words_of
from .evidence import Evidence
from .noise import NoiseTest

_MOST, _ROWS = 0.9, 6  # part of the squared misfit whose rows are named, and how many of them at most
_MANY = 50  # entries, of which it can be said what their misfit looks like
_SURE = 1e-8  # of a piece's size: how far off certified positions may be


def passes(certificate: Certificate, test: NoiseTest | None) -> bool:
    """Whether the numbers alone would do for a certificate."""
    if len(certificate.flipped):
        return False
    if test and decides(certificate, test):
        return test.passed
    return certificate.backward_error <= CERTIFIED


def verdict(
    topology: Topology,
    certificate: Certificate,
    test: NoiseTest | None,
    matrix: OperatorMatrix,
    evidence: Evidence,
    scale: NDArray,
    notes: Sequence[str] = (),
    doubt: float = 0.0,
    apart: str | None = None,
    *,
    polished: bool = True,
) -> tuple[str, str]:
    """``"certified"`` or ``"uncertified"``, and why.

    Parameters
    ----------
    topology, certificate, test, matrix, evidence
    scale : (number of pieces,) float64
        c of each piece, the factor of the Laplacian.
    notes : sequence of str
        Stages that did not converge.
    doubt : float
        About the error of the positions, relative to the size of their piece, as far as a solver knows of one.
    apart : str, optional
        What is wrong with the factors, see :func:`unassemble.scalar.factors.discord`.
    polished : bool
        Whether a polish was asked for.
    """
    good = passes(certificate, test)
    if good and apart:
        return "uncertified", f"the matrix is given back to {certificate.backward_error:.1e}, but {apart}"
    if test and decides(certificate, test):
        if test.noise.digits and not (test.drowned or test.likely):
            more = (*notes, _unlikely(test, certificate))
            reason = _misfit(topology, certificate, matrix, evidence, scale, more)
            return "uncertified", reason + _astray(evidence, (), polished=polished)
        reason = _with_noise(test, certificate, topology, evidence, notes, polished=polished)
        if good and not doubt <= max(_SURE, test.noise.sigma / float(np.abs(scale).min())):
            return "uncertified", f"{reason}, but that mesh need not be the likeliest{_because(notes)}"
        return ("certified" if good else "uncertified"), reason
    error = certificate.backward_error
    if good and not evidence.certain and not doubt <= _SURE:
        return "uncertified", (
            f"the operator re-assembled on this mesh gives the matrix back to {error:.1e}, but so may others: in "
            f"double precision the entries determine the positions to about {doubt:.0e} of the size only"
        )
    if good and len(topology.bare_edges):
        i, j = topology.edges[topology.bare_edges[0]]
        return "uncertified", (
            f"the mesh gives the matrix back to {error:.1e}, but the stored zero of rows {i} and {j} belongs to no cell"
        )
    if good and not evidence.certain:
        return "certified", f"the operator re-assembled on this mesh gives the matrix back to {error:.1e}"
    return "uncertified", _misfit(topology, certificate, matrix, evidence, scale, notes) + (
        f"; {apart}" if apart else ""
    )


def _misfit(
    topology: Topology,
    certificate: Certificate,
    matrix: OperatorMatrix,
    evidence: Evidence,
    scale: NDArray,
    notes: Sequence[str],
) -> str:
    """What does not fit, the gravest first."""
    if topology.failures:
        parts = count_of(len(topology.failures), "part of the matrix has", "parts of the matrix have")
        return f"{parts} no mesh: {topology.failures[0]}"
    bare = topology.bare_edges[matrix.entries[topology.bare_edges] != 0]
    if len(bare):
        i, j = topology.edges[bare[0]]
        if len(bare) == 1:
            return f"the nonzero entry of rows {i} and {j} belongs to no triangle"
        return f"{len(bare):,} nonzero entries belong to no triangle, the first that of rows {i} and {j}"
    if not np.isfinite(certificate.backward_error):
        return "the mesh has triangles that are flat, or points that are not finite"
    if len(certificate.flipped):
        return _turned_over(topology, certificate) + _because(notes)
    (i, j), misfit = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
    differs = (
        f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
        f"largest; {CERTIFIED:g} is allowed)"
    )
    remark = _like_noise(certificate, evidence, scale)
    begun = _culprits(evidence) or ("" if remark else _unexplained(certificate))
    return begun + differs + remark + _because(notes)


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
    if certificate.backward_error <= FITS:
        return ""
    squares = certificate.misfits**2
    left = squares.copy()
    rows: list[int] = []
    while len(rows) < _ROWS and left.sum() > (1 - _MOST) * squares.sum():
        at_row = np.bincount(certificate.pairs.ravel(), np.repeat(left, 2))
        rows.append(int(at_row.argmax()))
        left[(certificate.pairs == rows[-1]).any(axis=1)] = 0.0
    share = 1 - left.sum() / squares.sum()
    count = int((certificate.misfits > FITS).sum())
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


def _because(notes: Sequence[str]) -> str:
    return "; " + "; ".join(notes) if notes else ""


def _turned_over(topology: Topology, certificate: Certificate) -> str:
    triangles = np.concatenate([piece.vertices[piece.triangles] for piece in topology.pieces])
    rows = words_of(np.sort(triangles[certificate.flipped[0]]))
    k = len(certificate.flipped)
    which = "1 triangle is" if k == 1 else f"{k} triangles are"
    return f"{which} flat or turned over, the first that of rows {rows}"


def decides(certificate: Certificate, test: NoiseTest | None) -> bool:
    """Whether noise is what decides: there is something to test, and no exact fit makes too large a noise harmless.

    Entries of few digits that a mesh has exactly may be no rounded ones.
    """
    if test is None or not test.possible:
        return False
    exact = certificate.backward_error <= CERTIFIED
    short = certificate.backward_error <= SUSPICIOUS or not test.passed
    return not (exact and (test.drowned or (test.noise.digits is not None and short)))


def _with_noise(
    test: NoiseTest,
    certificate: Certificate,
    topology: Topology,
    evidence: Evidence,
    notes: Sequence[str],
    *,
    polished: bool,
) -> str:
    if test.drowned:
        return (
            f"{test.noise} drowns the cotangents, and almost any mesh would pass: the test is worth something up to "
            f"{test.limit:.2g}, {LARGEST_NOISE:g} times the scale"
        )
    if len(certificate.flipped):
        return _turned_over(topology, certificate) + _astray(evidence, notes, polished=polished)
    if not test.likely:
        return _culprits(evidence) + _unlikely(test, certificate) + _astray(evidence, notes, polished=polished)
    chance = ", but there are too few different entries beyond the unknowns to tell that from chance"
    return f"{test.noise} explains the misfit {_figures(test)}" + (chance if test.coincidence else "")


def _astray(evidence: Evidence, notes: Sequence[str], *, polished: bool) -> str:
    """The end of the sentence on a mesh that is not the one of known noise: where the polish has ended."""
    if len(evidence.suspects):
        return _because(notes)
    if not polished:
        return "; the mesh was not polished" + _because(notes)
    return (
        "; the polish has not come to a mesh that explains the matrix, and whether that is because of the start, "
        "wrong entries or wrong cells cannot be told"
    ) + _because(notes)


def _unlikely(test: NoiseTest, certificate: Certificate) -> str:
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
