"""The near-null space of a recovered matrix, whichever room it comes from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .recovery import Body, Recovery


def modes_of(recovery: Recovery) -> NDArray[np.float64]:
    """Near-null space of a vector-valued matrix, (N, 3) or (N, 6), rows as in the matrix: PyAMG's ``B``.

    Translations, then rotations; nodes without coordinates get translations only. The directions of a vector
    Laplacian are not coupled: it has translations only, (N, 2) or (N, 3).

    Raises
    ------
    InputError
        If the matrix is scalar.
    """
    from .elasticity.modes import rigid_body_modes
    from .structures.layouts import layout_named, turning_modes

    node, direction = recovery.node_of_row, recovery.direction_of_row
    if node is None or direction is None:
        raise InputError("a scalar matrix has no rigid-body modes: its near-null space is that of the constants")
    layout = layout_named(recovery.operator)
    if layout is not None:
        return turning_modes(layout, recovery.points, node, direction)
    if isinstance(recovery, Body) or recovery.operator == "truss":
        return rigid_body_modes(recovery.points, node, direction)
    return (direction[:, None] == np.arange(direction.max() + 1)).astype(np.float64)
