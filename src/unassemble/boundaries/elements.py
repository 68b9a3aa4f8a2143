"""Meshes of any planar element that lost cells at the boundary, fitted to the entries that are whole.

Rows that were taken out leave cells of which all nodes are there beside cells of which some are not, and only the
former are looked for. Two nodes on one side of a cell are in two cells, others in one; entries of as many cells are
whole, and so are those in rows at which no cell is lost. What is guessed of the others holds what whole entries do not,
with less and less weight; in the end it is what the mesh itself has there, so that nothing pulls at a mesh that fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..conforming.joined import JoinedParts
from ..conforming.parts import Part, parts_of
from ..conforming.recover import shown_cells
from ..errors import TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import ConformingMesh
from ..scalar.placement import Placement
from ..tolerances import CERTIFIED, ROUNDED
from ..topology import Topology
from ..topology.keys import contains, distinct, pair_keys
from .guessed import FittedPart, fitted_part
from .judge import node_status, partly, unknowns

_MOST = 3  # sets of cells, the likeliest ones


def recover_partial_elements(
    matrix: OperatorMatrix, placement: Placement, clock: Clock, options: ScalarOptions
) -> ConformingMesh | None:
    """The mesh of the cells that are complete; None where they show none that whole entries determine.

    Cells are straight. Entries between rows that were replaced are taken for unknown.
    """
    if options.noise is not None:
        return None
    lost = matrix.incomplete_rows if matrix.replaced is None else matrix.replaced
    if not lost.any():
        return None
    scale = None if options.scale is None else options.scale * placement.stretch
    for cells in islice(shown_cells(matrix, lost=lost), _MOST):
        with clock("inside"):
            try:
                parts = parts_of(cells)
            except TopologyError:
                continue
            near = _near_lost(matrix, lost, parts)
            fits = [fitted_part(matrix, part, near, scale) for part in parts]
        if any(fit is not None and fit.known.any() for fit in fits):
            return _report(matrix, [fit for fit in fits if fit is not None], placement, clock, options)
    return None


def _near_lost(matrix: OperatorMatrix, lost: NDArray[np.bool_], parts: Sequence[Part]) -> NDArray[np.bool_]:
    """(n,) rows of cells that are not complete: they do not add up, or have entries that no complete cell has.

    Of linear elements the former are all. Of others, a node of a lost cell need not be coupled to those that are gone.
    """
    if all(part.degree == 1 for part in parts):
        return lost
    covered = [pair_keys(matrix.n, *part.rows.T) for part in parts]
    bare = ~contains(distinct(np.concatenate(covered)), matrix.edges @ [matrix.n, 1])
    bare &= np.abs(matrix.entries) > ROUNDED * matrix.row_size[matrix.edges].min(axis=1)
    near = lost.copy()
    near[matrix.edges[bare]] = True
    return near


def _report(
    matrix: OperatorMatrix, fits: list[FittedPart], placement: Placement, clock: Clock, options: ScalarOptions
) -> ConformingMesh | None:
    """The mesh, if it is certified."""
    own = [fit.fit for fit in fits]
    topology = Topology(matrix.n, matrix.edges, tuple(one.part.piece for one in own), "cliques")
    told = [(fit.fit.part.piece.vertices, fit.known_nodes) for fit in fits]
    placement, said = placement.upon(matrix.n, told)
    with clock("place"):
        mesh = JoinedParts(topology, own, placement)
    status = node_status(mesh.component, told)
    with clock("certify"):
        found = mesh.held(matrix, np.nan_to_num(mesh.written))
        pairs = np.concatenate([fit.fit.part.rows[fit.judged] for fit in fits])
        key, wanted = found.pairs @ [matrix.n, 1], pair_keys(matrix.n, *pairs.T)
        error = float(found.misfits[np.searchsorted(key, wanted)].max(initial=0.0))
        free = 1 if options.scale is None else 0
        spare = min(int((fit.used & fit.judged).sum()) - unknowns(fit.known, free) for fit in fits if fit.known.any())
        claimed = np.concatenate([(status[some] == 0).all(axis=1) for some in mesh.blocks.values()])
    if claimed[found.flipped].any() or not (error <= CERTIFIED and spare > 0):
        return None
    fields, loose = partly(status, len(pairs), error, bars=options.standard_deviations)
    return ConformingMesh(
        **mesh.fields(),
        **fields,
        operator=placement.operator,
        timings=clock.timings,
        warnings=(*matrix.warnings, *said, *mesh.notes, *loose),
    )
