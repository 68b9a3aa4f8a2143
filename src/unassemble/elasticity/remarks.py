"""What there is to know beside the verdict: cells, nodes without coordinates, and what was assumed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..nodes.nodal import NodalMatrix
from ..words import count_of
from .materials.cells import Cells
from .nullspace.placing import Solution


def about_cells(found: Cells) -> list[str]:
    """What there is to say of the elements."""
    if not found.recognised:
        return [
            "no elements were recognised: looked for are triangles and quadrilaterals, tetrahedra and hexahedra, "
            "of one kind throughout, or linear triangles beside quadrilaterals"
        ]
    if not found.certified:
        return [
            "the elements were read off the graph and are not certified: no material was found with which they "
            "re-assemble to the matrix"
        ]
    return []


def about_nodes(
    nodal: NodalMatrix,
    loose: NDArray[np.bool_],
    withheld: NDArray[np.bool_],
    hanging: NDArray[np.bool_],
    lone: NDArray[np.bool_],
) -> list[str]:
    """Why nodes have no coordinates: `loose`.

    No cell confirms those `withheld`; others rest on an assumption that nothing confirms, `hanging`, or on identities
    that no others would contradict, `lone`.
    """
    sprung = (nodal.size == 0) & (nodal.row_of >= 0).any(axis=1)
    told = []
    if (loose & sprung).any():
        told.append(
            f"{count_of(int((loose & sprung).sum()), 'node hangs', 'nodes hang')} on springs, or on nothing, and have "
            "no position: no linear field knows a spring"
        )
    if withheld.any():
        told.append(
            f"{count_of(int(withheld.sum()), 'node has', 'nodes have')} rows that no element shows to be theirs. "
            "Since it was inferred which rows make up a node, no coordinates are given there"
        )
    resting = int((hanging & ~withheld).sum())
    if resting:
        told.append(
            f"{count_of(resting, 'node is', 'nodes are')} determined only if nodes that lack a direction lie in planes "
            "across it, which neither another equation nor an element confirms. No coordinates are given there"
        )
    if lone.any():
        told.append(
            f"{count_of(int(lone.sum()), 'node is', 'nodes are')} determined by identities that no others check, nor "
            "an element. No coordinates are given there"
        )
    rest = int((loose & ~withheld & ~hanging & ~lone & ~sprung).sum())
    if rest:
        told.append(
            f"{count_of(rest, 'node is', 'nodes are')} not determined: rows coupled to {'it' if rest == 1 else 'them'} "
            "lack entries, as next to eliminated unknowns, or belong to other axes, as at inclined supports, and no "
            "equation that holds for every element and material is left of these"
        )
    return told


def about_assumptions(solution: Solution) -> list[str]:
    """What was assumed, beside the identities, to determine positions."""
    told = []
    if solution.planes:
        told.append(
            "nodes that lack a direction were taken to lie in planes across it, which fits, to determine others"
        )
    if solution.straight:
        told.append(
            "the body is homogeneous and held all around, where the identities leave an affine map free that the "
            "elements determined"
        )
    return told


def about_directions(guessed: int) -> list[str]:
    """What there is to say of rows whose direction is the likeliest and no more."""
    if not guessed:
        return []
    return [
        f"which directions {count_of(guessed, 'row', 'rows')} of nodes without coordinates belong to is not proven: "
        "`direction_of_row` is -1 there, and rigid-body modes are zero"
    ]
