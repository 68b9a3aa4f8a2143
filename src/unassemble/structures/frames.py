"""Coordinates from the matrix of a frame, shell or plate, in true units of length."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import StructureCheck, check_structure
from ..linalg import blas_threads
from ..nodes.anchoring import Request
from ..nodes.rounded import Rounding, with_exact_sums
from ..recovery import Structure
from ..tolerances import ALIKE, CANCELLED, CERTIFIED
from ..words import GIVE_NUMBERING, Reason, count_of
from .answer import HeldStructure, about_loose, answer
from .contradicted import said_of
from .members import members_and_cells
from .nodes import Nodes, nodes_of
from .placed import PlacedNodes, without
from .recognise import StructuralNumbering
from .residuals import forces, in_one_place, members_misfits, mispaired, next_to_gaps, shown
from .straight import Straight, straight_members
from .turning import turning_positions

_LENGTH = (
    "what joins them has a length that the matrix does not show, as columns have between floors that constraints hold "
    "rigid"
)
_WITHOUT_CONSTRAINTS = "assemble the matrix without constraints between nodes"


def serve_structure(numbering: StructuralNumbering, request: Request) -> Structure:
    """Recover the coordinates of a structure whose nodes and directions are known, in true units of length.

    Anchors move pieces; size and axes are the matrix's own. Rounding is looked for anew, as directions are known now.
    InputError for anchors that do not fit, RecoveryError if no node is determined.
    """
    layout, node = numbering.layout, numbering.node_of_row
    sized, moves = bool(layout.rotations), len(layout.displacements)
    whole, rounding = with_exact_sums(request.matrix.csr(), known=(numbering.direction_of_row, layout.block_size))
    spread = rounding.spread if rounding else 0.0
    with request.clock("solve"):
        nodes, members, found, valid = _placed(whole, numbering, rounding)

    def again(other: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        nodes, _, again, valid = _placed(other, numbering, rounding, members.ends)
        points = np.where(strange[:, None], np.nan, again.points)
        return points, forces(other, numbering, nodes, points, valid)[0]

    def doubt() -> Reason | None:
        """Whether rows of different nodes were joined, or nodes came out in one place that are not."""
        near = in_one_place(nodes, straight, max(CANCELLED, spread))
        if near is not None:
            first, second = (np.flatnonzero(node == one)[0] for one in near)
            together = f"the nodes of rows {first} and {second} are coupled and would lie in one place"
            return Reason(f"{together}: {_LENGTH}", advice=_WITHOUT_CONSTRAINTS)
        inner: NDArray[np.bool_] = np.asarray(valid[:, :moves].all(axis=(1, 2)))
        pair = None if numbering.kind == "given" else mispaired(nodes, straight, inner, max(CANCELLED, spread))
        if pair is None:
            return None
        first, second = (np.flatnonzero(node == one)[0] for one in pair)
        unlike = f"those of rows {first} and {second}, as numbered, do not couple like the rows of two nodes"
        return Reason(f"which rows belong to one node is not certain: {unlike}", advice=GIVE_NUMBERING)

    strange = np.zeros(nodes.n, dtype=bool)
    if numbering.kind != "given":
        doubtful = next_to_gaps(nodes.row_of, numbering.direction_of_row < 0)
        strange = (doubtful & ~shown(nodes, members, found.points, valid)).any(axis=1) & (found.component >= 0)
        found = without(found, strange)
    straight = found.points
    force, used = forces(whole, numbering, nodes, straight, valid)
    ends, misfit = members_misfits(members, layout, straight)
    pairs = np.column_stack(sp.triu(nodes.graph, 1).nonzero())
    other = pairs[~np.isin(pairs @ [nodes.n, 1], ends @ [nodes.n, 1])]  # whose blocks are no members'
    used = (used | np.isin(node, ends) & ~np.isin(node, other)) & ~np.isin(node, found.spoiled)
    error = float(np.concatenate([abs(force), misfit]).max()) if used.any() else float("nan")
    blocks = f", {count_of(len(ends), 'block is that', 'blocks are those')} of straight members" if len(ends) else ""
    left = "rigid rotations of the nodes cause forces of {error:.1e} of those that make them up"
    said = f"rigid rotations of the nodes cause no forces{blocks}", left

    def check(points: NDArray[np.float64]) -> StructureCheck:
        return check_structure(
            request.matrix.csr(),
            node,
            numbering.direction_of_row,
            points,
            layout.displacements,
            layout.rotations,
            members=ends,
            allowed=max(CERTIFIED, spread),
            excused=found.spoiled,
        )

    held = HeldStructure(error, check, force, again, rounding, said)
    notes = [said_of(found.spoiled)] if len(found.spoiled) else []
    found = replace(found, points=np.pad(found.points, ((0, 0), (0, layout.space - layout.dim))))
    fields: dict[str, Any] = {}
    if request.cells and error < max(ALIKE, spread):
        with request.clock("members"):
            fields = members_and_cells(nodes, found.points, max(CANCELLED, spread))
        notes.append("members and cells were read off the graph: what is certified is the coordinates")
    if layout.dim == 1:
        notes.append("a beam by itself lies along x, in a direction that is free")
    elif sized and not valid[:, moves:].any():
        notes.append("moments are not used alone: springs between rotations and the ground, as against drilling, would "
                     "spoil them")  # fmt: skip
    untold = np.unique(node[numbering.direction_of_row < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     f"left out unless you {GIVE_NUMBERING}")  # fmt: skip
    if strange.any():
        notes.append(f"{count_of(int(strange.sum()), 'node')} lost the position, as nothing shows that all of the rows "
                     f"are of one node: {GIVE_NUMBERING}")  # fmt: skip
    notes += about_loose(found.component < 0, "at supports, or tied to these only")
    free = "size and sign are free: nodes have no rotations, from which angles would tell lengths"
    edges, fields["operator"] = np.column_stack(sp.triu(nodes.graph, 1).nonzero()), layout.name
    return answer(
        request, numbering, found, held, edges=edges, sized=sized, free=free, doubt=doubt, notes=notes, **fields
    )


def _placed(
    matrix: sp.csr_array,
    numbering: StructuralNumbering,
    rounding: Rounding | None,
    ends: NDArray[np.int64] | None = None,
) -> tuple[Nodes, Straight, PlacedNodes, NDArray[np.bool_]]:
    """Nodes, straight members, positions, and on which rows and rotations these rest; members between given ends."""
    spread = rounding.spread if rounding else 0.0
    nodes = nodes_of(matrix, numbering.layout, numbering.node_of_row, numbering.direction_of_row)
    with blas_threads(1):
        members = straight_members(nodes, (spread or CERTIFIED) / 2, ends)  # the certificate has other formulas
        return nodes, members, *turning_positions(nodes, members, max(CERTIFIED, spread))
