"""From a certificate to a status and a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..cells.reading import FITS
from ..certify import CERTIFIED, CONFIDENCE, LARGEST_NOISE, Certificate
from ..matrix import OperatorMatrix
from ..topology import Topology
from ..words import count_of
from .evidence import Evidence

_MOST, _ROWS = 0.9, 6  # part of the squared misfit whose rows are named, and how many of them at most
_MANY = 50  # entries, of which it can be said what their misfit looks like
_SURE = 1e-8  # of a piece's size: how far off certified positions may be


def passes(certificate: Certificate, chi_square: Mapping[str, float] | None, scale: NDArray) -> bool:
    """Whether the numbers alone would do for a certificate."""
    if len(certificate.flipped):
        return False
    if not _tested(certificate, chi_square, scale):
        return certificate.backward_error <= CERTIFIED
    assert chi_square is not None
    return min(chi_square["p_value"], chi_square["largest_p_value"]) >= CONFIDENCE and not _drowned(chi_square, scale)


def verdict(
    topology: Topology,
    certificate: Certificate,
    chi_square: Mapping[str, float] | None,
    matrix: OperatorMatrix,
    evidence: Evidence,
    scale: NDArray,
    notes: Sequence[str] = (),
    doubt: float = 0.0,
    apart: str | None = None,
) -> tuple[str, str]:
    """``"certified"`` or ``"uncertified"``, and why.

    Parameters
    ----------
    topology, certificate, chi_square, matrix, evidence
    scale : (number of pieces,) float64
        c of each piece, the factor of the Laplacian.
    notes : sequence of str
        Stages that did not converge.
    doubt : float
        About the error of the positions, relative to the size of their piece, as far as a solver knows of one.
    apart : str, optional
        What is wrong with the factors, see :func:`unassemble.scalar.factors.discord`.
    """
    good = passes(certificate, chi_square, scale)
    if good and apart:
        return "uncertified", f"the matrix is given back to {certificate.backward_error:.1e}, but {apart}"
    if chi_square and _tested(certificate, chi_square, scale):
        return ("certified" if good else "uncertified"), _with_noise(
            chi_square, certificate, topology, evidence, scale, notes
        )
    error = certificate.backward_error
    if good and not evidence.certain and not doubt <= _SURE:
        return "uncertified", (
            f"the operator re-assembled on this mesh gives the matrix back to {error:.1e}, but so may others: in "
            f"double precision the entries determine the positions to about {doubt:.0e} of the size only"
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
    if evidence.digits and not evidence.certain:
        return (
            f"the entries are {evidence.digits}, and the re-assembled matrix differs by no more than that, at most by "
            f"{misfit:.1e} of a row's largest ({CERTIFIED:g} is allowed): to have it tested give "
            f"`noise={evidence.rounding:.2g}`, the size of the rounding errors of the largest entries"
        )
    differs = (
        f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
        f"largest; {CERTIFIED:g} is allowed)"
    )
    remark = _like_noise(certificate, evidence, scale)
    begun = _culprits(evidence) or ("" if remark else _unexplained(certificate))
    return begun + differs + remark + _because(notes)


def ambiguous(others: list[Alternative], certificate: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits, where others do as well."""
    first = others[0]
    more = f"; and likewise in {count_of(len(others) - 1, 'more place')}" if len(others) > 1 else ""
    order = (
        f"the rows {_words(first.found)}, joined to {_words(first.around)}, can as well stand in the order "
        f"{_words(first.other)}, with "
        if first.found != first.other
        else ""
    )
    claim = "but so does another" if first.tested else "but so may another, which was not tried"
    if first.other_cells:
        cells = f"the cells {_cells(first.other_cells)}" + (
            f" in place of {_cells(first.cells)}" if first.cells else " besides"
        )
    else:
        cells = f"{_cells(first.cells)} left out as a hole"
    factor = "" if all(other.same_scale for other in others) else ", each with a factor c of its own: known, it decides"
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, {claim}: {order}{cells}{more}{factor}"
    )


def all_alike(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of pieces that fit, as others would."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but where all entries are equal small "
        "pieces that hang together at vertices may as well be others, with another factor c: known, it decides"
    )


def unproved(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of pieces that fit, as others may."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but it has hardly more entries than "
        "unknowns, and not all other cells that may have the same ones, with another factor c, could be tried: known, "
        "it decides"
    )


def far_away(origins: NDArray, written: Certificate, near: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits until its coordinates are written, too far from the origin."""
    origin = complex(origins[np.abs(origins).argmax()])
    return "uncertified", (
        f"the mesh gives the matrix back to {near.backward_error:.1e}, but its coordinates lie so far from the origin "
        f"that they have too few digits left: as written they give it back to {written.backward_error:.1e}; subtract a "
        f"point near ({origin.real:.6g}, {origin.imag:.6g}) from all of `anchors`"
    )


def _cells(cells: tuple[tuple[int, ...], ...]) -> str:
    shown = ", ".join("-".join(map(str, cell)) for cell in cells[:6])
    return shown + (", ..." if len(cells) > 6 else "")


def _words(rows: tuple[int, ...]) -> str:
    return ", ".join(map(str, rows))


def _rounded(evidence: Evidence) -> str:
    if not evidence.digits:
        return ""
    return f"; the entries are {evidence.digits}, and the largest have rounding errors of {evidence.rounding:.2g}"


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
        f"{'row' if len(rows) == 1 else 'the rows'} {_words(tuple(sorted(rows)))}; "
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
    rows = ", ".join(map(str, np.sort(triangles[certificate.flipped[0]])))
    k = len(certificate.flipped)
    which = "1 triangle is" if k == 1 else f"{k} triangles are"
    return f"{which} flat or turned over, the first that of rows {rows}"


def _tested(certificate: Certificate, chi_square: Mapping[str, float] | None, scale: NDArray) -> bool:
    """Whether noise is what decides: there is something to test, and no exact fit makes too large a noise harmless."""
    if not chi_square or not chi_square["degrees_of_freedom"] > 0:
        return False
    return not (_drowned(chi_square, scale) and certificate.backward_error <= CERTIFIED)


def _drowned(test: Mapping[str, float], scale: NDArray) -> bool:
    return test["sigma"] > LARGEST_NOISE * float(np.abs(scale).min())


def _with_noise(
    test: Mapping[str, float],
    certificate: Certificate,
    topology: Topology,
    evidence: Evidence,
    scale: NDArray,
    notes: Sequence[str],
) -> str:
    sigma = test["sigma"]
    figures = (
        f"(chi-square {test['statistic']:.4g} with {test['degrees_of_freedom']:.0f} degrees of freedom, "
        f"p = {test['p_value']:.3g})"
    )
    if _drowned(test, scale):
        limit = LARGEST_NOISE * float(np.abs(scale).min())
        return (
            f"noise of standard deviation {sigma:.3g} drowns the cotangents, and almost any mesh would pass: the "
            f"test is worth something up to {limit:.2g}, {LARGEST_NOISE:g} times the scale"
        )
    if len(certificate.flipped):
        return _turned_over(topology, certificate) + _because(notes)
    if test["p_value"] < CONFIDENCE:
        more = f"the misfit is more than noise of standard deviation {sigma:.3g} explains {figures}"
        return _culprits(evidence) + more + _because(notes)
    if test["largest_p_value"] < CONFIDENCE:
        i, j = certificate.pairs[np.abs(certificate.differences).argmax()]
        more = (
            f"the entry of rows {i} and {j} is off by {test['largest']:.1f} standard deviations of the noise, "
            f"{sigma:.3g}, more than the largest of {len(certificate.pairs)} would be"
        )
        return _culprits(evidence) + more + _rounded(evidence)
    return f"noise of standard deviation {sigma:.3g} explains the misfit {figures}"
