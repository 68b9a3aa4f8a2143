"""What there is to know beside the verdict: cells, nodes without coordinates, and what was assumed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..nodes.nodal import NodalMatrix
from ..words import count_of
from .materials.cells import Cells
from .nullspace.placing import Solution


def about_cells(found: Cells) -> Iterator[str]:
    """What there is to say of the elements."""
    if not found.recognised:
        yield (
            "no elements were recognised: looked for are triangles and quadrilaterals, tetrahedra and hexahedra, of "
            "one kind throughout, or linear triangles beside quadrilaterals"
        )
    elif not found.certified:
        yield (
            "the elements were read off the graph and are not certified: no material was found with which they "
            "re-assemble to the matrix"
        )


def about_nodes(
    nodal: NodalMatrix,
    loose: NDArray[np.bool_],
    withheld: NDArray[np.bool_],
    hanging: NDArray[np.bool_],
    lone: NDArray[np.bool_],
) -> Iterator[str]:
    """Why nodes have no coordinates: `loose`.

    No cell confirms those `withheld`; others rest on an assumption that nothing confirms, `hanging`, or on identities
    that no others would contradict, `lone`.
    """
    sprung = loose & (nodal.size == 0) & (nodal.row_of >= 0).any(axis=1)
    if sprung.any():
        yield (
            f"{_nodes(sprung, 'hangs', 'hang')} on springs, or on nothing, and have no position: no linear field knows "
            "a spring"
        )
    if withheld.any():
        yield (
            f"{_nodes(withheld, 'has', 'have')} rows that no element shows to be theirs. Since it was inferred which "
            "rows make up a node, no coordinates are given there"
        )
    if (hanging & ~withheld).any():
        yield (
            f"{_nodes(hanging & ~withheld)} determined only if nodes that lack a direction lie in planes across it, "
            "which neither another equation nor an element confirms. No coordinates are given there"
        )
    if lone.any():
        yield (
            f"{_nodes(lone)} determined by identities that no others check, nor an element. No coordinates are given "
            "there"
        )
    rest = loose & ~withheld & ~hanging & ~lone & ~sprung
    if rest.any():
        yield (
            f"{_nodes(rest)} not determined: rows coupled to {'it' if rest.sum() == 1 else 'them'} lack entries, as "
            "next to eliminated unknowns, or belong to other axes, as at inclined supports, and no equation that holds "
            "for every element and material is left of these"
        )


def _nodes(some: NDArray[np.bool_], is_: str = "is", are: str = "are") -> str:
    return count_of(int(some.sum()), f"node {is_}", f"nodes {are}")


def about_assumptions(solution: Solution, guessed: int) -> Iterator[str]:
    """What was assumed, beside the identities, to determine positions, and directions of rows that were guessed."""
    if solution.planes:
        yield "nodes that lack a direction were taken to lie in planes across it, which fits, to determine others"
    if solution.straight:
        yield (
            "the body is homogeneous and held all around, where the identities leave an affine map free that the "
            "elements determined"
        )
    if guessed:
        yield (
            f"which directions {count_of(guessed, 'row', 'rows')} of nodes without coordinates belong to is not "
            "proven: `direction_of_row` is -1 there, and rigid-body modes are zero"
        )
