"""Why a mesh that fits is uncertified: others do as well, or may."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..words import count_of


def ambiguous(others: list[Alternative], certificate: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits, where others do as well."""
    first = others[0]
    more = f"; likewise in {count_of(len(others) - 1, 'more part')} of the matrix" if len(others) > 1 else ""
    instead = f" in place of {_cells(first.cells)}" if first.cells else " besides"
    return "ambiguous", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but so does another, with the cells "
        f"{_cells(first.other_cells)}{instead}{more}"
    )


def nothing_to_spare(certificate: Certificate, rows: NDArray[np.int64]) -> tuple[str, str]:
    """The status and reason of a mesh with pieces of as many unknowns as equations, by a row of each."""
    which = (
        f"the piece of row {rows[0]} has"
        if len(rows) == 1
        else f"{len(rows)} pieces, the first that of row {rows[0]}, have"
    )
    return "uncertified", (
        f"{which} no entry to spare: nearly any entries belong to such a mesh, and that it gives the matrix back to "
        f"{certificate.backward_error:.1e} proves nothing; give the scale if it is known"
    )


def far_away(origins: NDArray, written: Certificate, near: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits until its coordinates are written, too far from the origin."""
    origin = complex(origins[np.abs(origins).argmax()])
    return "uncertified", (
        f"the mesh gives the matrix back to {near.backward_error:.1e}, but its coordinates lie so far from the origin "
        f"that they have too few digits left: as written they give it back to {written.backward_error:.1e}; subtract a "
        f"point near ({origin.real:.6g}, {origin.imag:.6g}) from all of `anchors`"
    )


def _cells(cells: tuple[tuple[int, ...], ...]) -> str:
    shown = ", ".join("-".join(map(str, cell)) for cell in cells[:6])
    return shown + (", ..." if len(cells) > 6 else "")
