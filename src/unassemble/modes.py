"""The near-null space of a recovered matrix, whichever room it comes from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .elasticity.modes import rigid_body_modes
from .errors import InputError
from .recovery import Recovery
from .structures.layouts import layout_named, turning_modes


def modes_of(recovery: Recovery) -> NDArray[np.float64]:
    """Near-null space of a recovered vector-valued matrix; see :meth:`unassemble.Recovery.rigid_body_modes`."""
    node, direction = recovery.node_of_row, recovery.direction_of_row
    if node is None or direction is None:
        raise InputError("a scalar matrix has no rigid-body modes: its near-null space is that of the constants")
    layout = layout_named(recovery.operator)
    if layout is not None:
        return turning_modes(layout, recovery.points, node, direction)
    if recovery.operator in ("elasticity", "truss"):
        return rigid_body_modes(recovery.points, node, direction)
    return (direction[:, None] == np.arange(direction.max() + 1)).astype(np.float64)
