"""Which operator a matrix belongs to, where that is not said."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from .errors import GeometryError, InputError, RecoveryError
from .matrix import OperatorMatrix
from .matrix.digits import Digits
from .nodes import NodeNumbering
from .nodes.orders import ORDERS
from .nodes.rounded import Rounding, with_exact_sums
from .nodes.unknowns import (
    MORE_THAN_STIFFNESS,
    find_numbering,
    given_numbering,
    nodes_of_pattern,
    regular_numbering,
)
from .structures import StructuralNumbering, find_structure, given_structure, truss_numbering
from .structures.beams import MOST, find_beam
from .structures.gaps import directions_with_gaps
from .structures.layouts import SPACE
from .tolerances import CANCELLED
from .topology import components


@dataclass(frozen=True)
class VectorReading:
    """A matrix read as vector-valued."""

    # of solids, or of frames, shells and plates, whose nodes have rotations too
    numbering: NodeNumbering | StructuralNumbering
    why: str  # what speaks for it; empty where the caller asked for it
    rounding: Rounding | None = None  # of entries with few digits

    @property
    def name(self) -> str:
        """What the matrix is then, to follow "the matrix is"."""
        found = self.numbering
        if isinstance(found, StructuralNumbering):
            return f"that of a {found.layout.name} with {found.block_size} unknowns per node"
        return f"vector-valued, {found.block_size} components, {self.order}"

    @property
    def order(self) -> str:
        """How the unknowns stand, in words."""
        return {"pattern": "in an order found by the pattern"}.get(self.numbering.kind, self.numbering.kind)


def asked_for(matrix: OperatorMatrix, block_size: int | None, numbering: Any) -> VectorReading:
    """Find the nodes of a matrix that is said to be vector-valued; options are those of :func:`unassemble.recover`.

    Raises InputError for numberings that do not fit the matrix; RecoveryError if no numbering makes rows annihilate
    translations.
    """
    beam = _beam(matrix) if numbering is None and block_size is None else None
    if beam is not None:
        return VectorReading(beam, "")
    whole, rounding = _exact(matrix)
    if numbering is None or isinstance(numbering, str):
        if numbering not in (None, *ORDERS):
            raise InputError(f"`numbering` is {' or '.join(map(repr, ORDERS))}, not {numbering!r}")
        structure = find_structure(whole, numbering, block_size)
        if structure is not None:
            return VectorReading(structure, "", rounding)
        if block_size == SPACE.block_size:
            raise GeometryError(
                "with 6 unknowns per node, three displacements and three rotations, no row annihilates translations"
            )
        try:
            if numbering is None:
                return VectorReading(find_numbering(whole, block_size), "", rounding)
            return VectorReading(regular_numbering(whole, numbering, block_size), "", rounding)
        except RecoveryError:
            truss = truss_numbering(whole, block_size, numbering)
            if truss is None:
                raise
            return VectorReading(truss, "", rounding)
    try:
        node, direction = numbering
    except (TypeError, ValueError) as error:
        raise InputError("`numbering` is two arrays: the node and the direction of each row") from error
    found = given_structure(whole, node, direction) or given_numbering(whole, node, direction)
    if block_size not in (None, found.block_size):
        raise InputError(f"`numbering` has {found.block_size} directions, and `block_size` is {block_size}")
    return VectorReading(found, "", rounding)


def vector_valued(matrix: OperatorMatrix) -> VectorReading | None:
    """Read a matrix as vector-valued if its graph says at first sight that it is no planar mesh, but blocks of nodes.

    Costs next to nothing where the graph may be planar.
    """
    beam = _beam(matrix)
    if beam is not None:
        return VectorReading(beam, "its rows form one line of nodes, whose blocks are those of members that bend")
    if matrix.n < 3 or len(matrix.edges) <= 3 * matrix.n - 6:
        return None
    return _by_nodes(
        matrix, partial(find_numbering, at_sight=True), "the graph has more edges than a planar one can have"
    )


def second_reading(matrix: OperatorMatrix) -> VectorReading | None:
    """Read a matrix as vector-valued after it turned out not to be a planar mesh; None where little speaks for it."""
    # Every unknown of an elastic body has a stiffness. Sums by direction vanish: entries of one sign couple none.
    one_sign = matrix.entries.min(initial=0.0) >= 0 or matrix.entries.max(initial=0.0) <= 0
    if not matrix.diagonal.all() or (one_sign and len(components(matrix.n, matrix.edges)) == 1):
        return None
    return _by_nodes(matrix, find_numbering, "it is no planar mesh")


def _by_nodes(
    matrix: OperatorMatrix, find: Callable[[sp.csr_array], NodeNumbering], because: str
) -> VectorReading | None:
    """A structure; or nodes whose rows annihilate constants, as those of scalar matrices never do; or a truss."""
    whole, rounding = _exact(matrix)
    found: NodeNumbering | StructuralNumbering | None = find_structure(whole)
    if found is None:
        with suppress(RecoveryError):
            found = find(whole)
    if isinstance(found, StructuralNumbering) or (found is not None and found.sound):
        order = {"pattern": "in no regular order"}.get(found.kind, found.kind)
        shown = f"{order}, whose sums by direction vanish in {100 * found.share:.0f} % of the cases"
    else:
        found = truss_numbering(whole, allowed=rounding.spread if rounding else CANCELLED)
        if found is None:
            return None
        shown = f"{found.kind}, whose blocks are those of bars"
    nodes = f"its rows form {found.n_nodes} nodes with {found.block_size} unknowns each, {shown}"
    return VectorReading(found, f"{because}, and {nodes}", rounding)


def about_translations(matrix: OperatorMatrix) -> str:
    """Why a matrix that is no planar mesh is no stiffness matrix either though its rows form nodes; empty if not so."""
    nodes, rounded = nodes_of_pattern(matrix.csr()), Digits.of(matrix.csr().data)
    if nodes is None:
        return ""
    digits = f", or what shows it is lost in the entries, which are rounded to {rounded.name}" if rounded else ""
    return (
        f"its rows form {nodes[0]} nodes with {nodes[1]} unknowns each, as those of an elasticity matrix, but do not "
        f"annihilate translations: perhaps {MORE_THAN_STIFFNESS}{digits}"
    )


def _beam(matrix: OperatorMatrix) -> StructuralNumbering | None:
    """The matrix of a straight beam, whose graph may be planar; costs next to nothing where rows have more entries."""
    full = np.bincount(matrix.edges[matrix.entries != 0].ravel(), minlength=1)
    return find_beam(matrix.csr()) if full.max() <= MOST else None


def _exact(matrix: OperatorMatrix) -> tuple[sp.csr_array, Rounding | None]:
    """The matrix to look at, and the rounding of entries with few digits."""
    whole = matrix.csr()
    return with_exact_sums(whole, directions_with_gaps(whole))
