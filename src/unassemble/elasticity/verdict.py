"""Whether coordinates are certified, and why not."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..words import count_of
from .cells import Cells
from .nodal import NodalMatrix, without_trace
from .positions import Solution
from .unknowns import Numbering

CERTIFIED = 1e-9
_NEARLY = 2e-7  # gap at which entries rounded to 1e-15 still give coordinates to 1e-8


def about_cells(found: Cells) -> list[str]:
    """What there is to say of the elements."""
    if not found.recognised:
        return [
            "no elements were recognised: looked for are linear and quadratic triangles, quadrilaterals, tetrahedra "
            "and hexahedra, of one kind throughout"
        ]
    if not found.certified:
        return [
            "the elements were read off the graph and are not certified: no material was found with which they "
            "re-assemble to the matrix"
        ]
    if found.varying:
        return ["the material differs within elements: their Lame coefficients are means"]
    return []


def of_few_digits(rounding: float, error: float) -> str:
    """Why a matrix whose entries are rounded is not certified though all is well."""
    return (
        f"the entries are rounded to {rounding:.0e} of themselves, and the identities hold to {error:.1e}, which is "
        "what that leaves; rows away from supports were made to annihilate translations exactly"
    )


_FREEDOMS = {
    "axes": "each axis keeps a scale of its own",
    "affine": "an affine map stays free, since the material around every valid row is homogeneous",
    "hourglass": "fields that move points in one direction only may be added in each: hourglass modes of reduced "
    "integration, or smooth ones where a homogeneous body is held on its whole boundary; the points are the smoothest "
    "that fit",
}


def verdict(
    nodal: NodalMatrix, solution: Solution, error: float, found: Cells, numbering: Numbering
) -> tuple[str, str]:
    """Status and reason.

    Parameters
    ----------
    nodal : NodalMatrix
    solution : Solution
    error : float
        Largest residual of a valid identity.
    found : Cells
    numbering : Numbering
    """
    remaining = [_FREEDOMS[name] for name in solution.freedoms if name]
    if remaining:
        return "uncertified", f"the null space is larger than it should be: {remaining[0]}"
    nearly = min((one.gap for one in solution.evidence if one.gap > 0), default=1.0)
    if solution.exact and nearly < _NEARLY:
        return "uncertified", (
            f"a field that is no translation or scale satisfies the identities up to {nearly:.1e}: nodes that it moves "
            "feel the rounding of the entries, magnified by as much, and may be wrong by more than 1e-8"
        )
    if not solution.exact:
        worst = max(solution.evidence, key=lambda one: one.residual)
        return "uncertified", (
            f"no exact null vector exists (singular value {worst.residual:.1e}, that of the next field "
            f"{worst.gap:.1e}); the points are the best fit, as for materials that are not isotropic, or elements that "
            "do not reproduce linear functions"
        )
    if not solution.strict:
        return "uncertified", (
            "supports leave too few rows that are surely whole; rows whose entries add up to zero were taken for "
            "whole, which they need not be"
        )
    if numbering.kind != "given" and numbering.incomplete | (numbering.kind == "pattern") and _torn(nodal, solution):
        return "uncertified", (
            "which direction each row belongs to was inferred from the entries, and not without contradiction: coupled "
            "nodes came out as separate pieces; give the numbering if it is known"
        )
    if found.certified and found.backward_error <= CERTIFIED:
        return "certified", f"the matrix re-assembled on the {count_of(found.n_cells, 'element')} is the given one"
    odd = int(without_trace(nodal).any(axis=1).sum())
    if odd:
        return "uncertified", (
            f"{count_of(odd, 'node lacks', 'nodes lack')} directions although no row next to it misses anything: its "
            "rows belong to other nodes, and neither pattern nor positions tell to which; give the numbering if it is "
            "known"
        )
    if numbering.incomplete and numbering.kind != "given" and numbering.common < 1:
        return "uncertified", (
            "which rows belong to one node was inferred, where some nodes lack rows and others do not store entries "
            "that vanished; only elements that re-assemble to the matrix would show that the inference is right"
        )
    if error <= CERTIFIED:
        return "certified", "the valid identities hold to rounding, and only translations and scale satisfy them"
    return "uncertified", f"the largest residual of a valid identity is {error:.1e}"


def _torn(nodal: NodalMatrix, solution: Solution) -> bool:
    """Whether nodes of different pieces are connected through the matrix."""
    graph = sp.csr_array((np.ones(len(nodal.indices), np.int8), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    label = sp.csgraph.connected_components(graph, directed=False)[1]
    known = solution.component >= 0
    pairs = np.unique(np.column_stack([label, solution.component])[known], axis=0)
    return len(np.unique(pairs[:, 0])) < len(pairs)
