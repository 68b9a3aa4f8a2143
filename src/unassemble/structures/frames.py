"""Coordinates from the matrix of a frame, shell or plate, in true units of length."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..linalg import blas_threads
from ..nodes.anchoring import Request
from ..nodes.rounded import Known, Rounding, known_to, with_exact_sums
from ..recovery import Structure
from ..tolerances import ALIKE, CANCELLED, CERTIFIED
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of
from .answer import answer, covered
from .certificate import forces, members_misfits, mispaired
from .contradicted import said_of
from .members import members_and_cells
from .nodes import Nodes, nodes_of
from .placed import Placed
from .recognise import StructuralNumbering
from .straight import Straight, straight_members
from .turning import turning_positions


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
    with request.clock("certify"):
        force, used = forces(whole, numbering, nodes, found.points, valid)
        ends, misfit = members_misfits(members, layout, found.points)
        used = (used | np.isin(node, ends)) & ~np.isin(node, found.spoiled)
        error = float(np.concatenate([abs(force), misfit]).max()) if used.any() else float("inf")
        known = _known(error, force, found, members, numbering, rounding)
        status, reason = _verdict(error, known, found, len(ends), rounding, sized=sized)
        pair = None
        if status == "certified" and numbering.kind != "given":
            inner: NDArray[np.bool_] = np.asarray(valid[:, :moves].all(axis=(1, 2)))
            pair = mispaired(nodes, found.points, inner, max(CANCELLED, spread))
    if pair is not None:
        first, second = (np.flatnonzero(node == one)[0] for one in pair)
        status = "uncertified"
        reason = Reason(
            f"which rows belong to one node is not certain: those of rows {first} and {second}, as numbered, do not "
            "couple like the rows of two nodes",
            GIVE_NUMBERING,
        )
    elif status == "certified":
        reason = Reason(f"{reason.text}: {covered(used, abs(whole[used]).sum(axis=0) > 0)}")
    notes = [said_of(nodes, found.spoiled)] if len(found.spoiled) else []
    found = replace(found, points=np.pad(found.points, ((0, 0), (0, layout.space - layout.dim))))
    fields: dict[str, Any] = {}
    if request.cells and error < max(ALIKE, spread):
        with request.clock("members"):
            fields = members_and_cells(nodes, found.points, max(CANCELLED, spread))
        notes.append("members and cells were read off the graph: what is certified is the coordinates")
    if sized and not valid[:, moves:].any():
        notes.append("moments are not used alone: springs between rotations and the ground, as against drilling, would "
                     "spoil them")  # fmt: skip
    untold = np.unique(node[numbering.direction_of_row < 0])
    if len(untold):
        notes.append(f"which unknowns {count_of(len(untold), 'node')} lack the pattern does not tell: their rows were "
                     f"left out unless you {GIVE_NUMBERING}")  # fmt: skip
    if (found.component < 0).any():
        notes.append(f"{(found.component < 0).sum()} of {count_of(nodes.n, 'node')} cannot be determined: at supports, "
                     "or tied to these only")  # fmt: skip
    return answer(
        numbering,
        request,
        found,
        (status, reason),
        edges=np.column_stack(sp.triu(nodes.graph, 1).nonzero()),
        sized=sized,
        free="size and sign are free: nodes have no rotations, from which angles would tell lengths",
        notes=notes,
        operator=layout.name,
        backward_error=error,
        position_error=known.error if rounding and known.explained else None,
        **fields,
    )


def _known(
    error: float,
    force: NDArray[np.float64],
    found: Placed,
    members: Straight,
    numbering: StructuralNumbering,
    rounding: Rounding | None,
) -> Known:
    """How far positions may be off, relative to the size; without rounding if each equation were off by as much."""
    if rounding is None:
        loosest = min(found.evidence, key=lambda one: one.gap / np.sqrt(one.rows))
        return Known(float(error * np.sqrt(loosest.rows) / loosest.gap))

    def place(other: sp.csr_array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        nodes, _, again, valid = _placed(other, numbering, rounding, members.ends)
        return again.points, forces(other, numbering, nodes, again.points, valid)[0]

    sized = bool(numbering.layout.rotations)
    return known_to(found.points, found.component, force, rounding, place, sized=sized)


def _placed(
    matrix: sp.csr_array,
    numbering: StructuralNumbering,
    rounding: Rounding | None,
    ends: NDArray[np.int64] | None = None,
) -> tuple[Nodes, Straight, Placed, NDArray[np.bool_]]:
    """Nodes, straight members, positions, and on which rows and rotations these rest; members between given ends."""
    spread = rounding.spread if rounding else 0.0
    nodes = nodes_of(matrix, numbering.layout, numbering.node_of_row, numbering.direction_of_row)
    with blas_threads(1):
        members = straight_members(nodes, max(CERTIFIED, spread) / 2, ends)  # the certificate has other formulas
        return nodes, members, *turning_positions(nodes, members, max(CERTIFIED, spread))


def _verdict(
    error: float, known: Known, found: Placed, members: int, rounding: Rounding | None, *, sized: bool
) -> tuple[str, Reason]:
    allowed, needed = (max(CERTIFIED, rounding.spread), rounding.needed) if rounding else (CERTIFIED, ALIKE)
    forced = f"rigid rotations of the nodes cause forces of {error:.1e} of those that make them up"
    if rounding and not known.explained:
        return "uncertified", Reason(f"{forced}, more than rounding to {rounding.name} leaves")
    if not error <= allowed or known.error > needed:
        gap = min(one.gap for one in found.evidence)
        return "uncertified", Reason(
            f"{forced}, and another field, no translation, only {gap:.1e}: positions may be off by {known.error:.0e} "
            "of the size"
        )
    if found.unnoticed.any():
        count = count_of(int(np.count_nonzero(found.unnoticed)), "equation has", "equations have")
        return "uncertified", Reason(
            f"{count} no other to check against, so that springs would go unnoticed: too few whole rows are left",
            WITHOUT_SUPPORTS,
        )
    blocks = f", {count_of(members, 'block is that', 'blocks are those')} of straight members" if members else ""
    if rounding:
        return "certified", Reason(
            f"rigid rotations of the nodes cause no more forces than entries rounded to {rounding.name} leave{blocks}, "
            f"so that positions are known to {known.error:.0e} of the size"
        )
    nothing = "translations change" if sized else "translations and a change of size change"
    return "certified", Reason(f"rigid rotations of the nodes cause no forces{blocks}, and only {nothing} nothing")
