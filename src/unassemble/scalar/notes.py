"""What is to be said about a mesh beside its status: sentences for ``warnings``."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..topology import Topology
from ..words import count_of, words_of


def topology_notes(topology: Topology) -> list[str]:
    """Pieces, hinges, rows without a position."""
    notes = []
    if len(topology.pieces) > 1:
        notes.append(
            f"{len(topology.pieces)} pieces: the matrix does not say how they lie relative to each other, "
            "so each has a frame and a mirror image of its own"
        )
    if k := len(topology.hinges):
        notes.append(
            f"{count_of(k, 'vertex joins', 'vertices join')} pieces that share nothing else: {_some(topology.hinges)}"
        )
    if k := len(topology.undetermined):
        notes.append(
            f"{count_of(k, 'row belongs to no triangle and has', 'rows belong to no triangle and have')} no position: "
            f"{_some(topology.undetermined)}"
        )
    return notes


def piece_notes(remarks: Sequence[Sequence[str]]) -> list[str]:
    """Remarks on each piece, one sentence for all pieces that share one."""
    pieces: dict[str, list[int]] = {}
    for label, some in enumerate(remarks):
        for remark in some:
            pieces.setdefault(remark, []).append(label)
    if len(remarks) == 1:
        return list(pieces)
    return [
        (f"piece {own[0]}" if len(own) == 1 else f"{len(own):,} pieces ({_some(np.array(own))})") + f": {remark}"
        for remark, own in pieces.items()
    ]


def vanished_notes(topology: Topology) -> list[str]:
    """Cells that stay undivided."""
    if not (k := topology.polygons.count):
        return []
    return [
        f"{count_of(k, 'cell has', 'cells have')} more than three vertices, on one circle: entries on diagonals "
        "vanish whichever way such a cell is divided, so any division into triangles gives the same matrix"
    ]


def _some(rows: NDArray, count: int = 8) -> str:
    return words_of(rows[:count]) + (", ..." if len(rows) > count else "")
