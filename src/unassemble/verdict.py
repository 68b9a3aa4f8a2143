"""From a certificate to a status and a sentence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .cells import Exchange
from .certify import CERTIFIED, CONFIDENCE, Certificate
from .matrix import OperatorMatrix
from .topology import Topology


def verdict(
    topology: Topology, certificate: Certificate, chi_square: Mapping[str, float] | None, matrix: OperatorMatrix
) -> tuple[str, str]:
    """``"certified"`` or ``"uncertified"``, and why."""
    if chi_square and chi_square["degrees_of_freedom"] > 0:
        return _with_noise(chi_square)
    error = certificate.backward_error
    if error <= CERTIFIED:
        return "certified", f"the operator re-assembled on this mesh gives the matrix back to {error:.1e}"
    if topology.failures:
        return "uncertified", f"{len(topology.failures)} part of the matrix has no mesh: {topology.failures[0]}"
    bare = topology.bare_edges[matrix.entries[topology.bare_edges] != 0]
    if len(bare):
        i, j = topology.edges[bare[0]]
        return (
            "uncertified",
            f"{len(bare)} nonzero entries belong to no triangle, the first between rows {i} and {j}",
        )
    if not np.isfinite(error):
        return "uncertified", "the mesh has triangles that are flat, or points that are not finite"
    (i, j), misfit = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
    return (
        "uncertified",
        f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
        f"largest; {CERTIFIED:g} is allowed)",
    )


def ambiguous(others: list[Exchange], certificate: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits, where others do as well."""
    first = others[0]
    more = f"; and likewise in {len(others) - 1} more places" if len(others) > 1 else ""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but so does another: the rows "
        f"{_words(first.found)}, joined to {_words(first.around)}, can as well stand in the order "
        f"{_words(first.other)}{more}"
    )


def _words(rows: tuple[int, ...]) -> str:
    return ", ".join(map(str, rows))


def _with_noise(test: Mapping[str, float]) -> tuple[str, str]:
    figures = (
        f"(chi-square {test['statistic']:.4g} with {test['degrees_of_freedom']:.0f} degrees of freedom, "
        f"p = {test['p_value']:.3g})"
    )
    if test["p_value"] >= CONFIDENCE:
        return "certified", f"noise of standard deviation {test['sigma']:.3g} explains the misfit {figures}"
    return "uncertified", f"the misfit is more than noise of standard deviation {test['sigma']:.3g} explains {figures}"
