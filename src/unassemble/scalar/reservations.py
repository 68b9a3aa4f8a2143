"""Why a mesh that fits is uncertified: others do as well, or may."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certify import Certificate
from ..words import count_of, words_of


def ambiguous(others: list[Alternative], certificate: Certificate) -> tuple[str, str]:
    """The status and reason of a mesh that fits, where others do as well."""
    first = others[0]
    more = f"; and likewise in {count_of(len(others) - 1, 'more place')}" if len(others) > 1 else ""
    order = (
        f"the rows {words_of(first.found)}, joined to {words_of(first.around)}, can as well stand in the order "
        f"{words_of(first.other)}, with "
        if first.found != first.other
        else ""
    )
    claim = "but so does another" if first.tested else "but so may another, which was not tried"
    if first.other_cells:
        cells = f"the cells {_cells(first.other_cells)}" + (
            f" in place of {_cells(first.cells)}" if first.cells else " besides"
        )
    else:
        cells = f"{_cells(first.cells)} left out as a hole"
    factor = "" if all(other.same_scale for other in others) else ", each with a factor c of its own: known, it decides"
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, {claim}: {order}{cells}{more}{factor}"
    )


def all_alike(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of pieces that fit, as others would."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but where all entries are equal small "
        "pieces that hang together at vertices may as well be others, with another factor c: known, it decides"
    )


def unproved(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of pieces that fit, as others may."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but it has hardly more entries than "
        "unknowns, and not all other cells that may have the same ones, with another factor c, could be tried: known, "
        "it decides"
    )


def untried_parts(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of meshes with many parts that hang on single vertices."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, but so many parts hang on it by single "
        "vertices, with right angles whose far sides have vanished, that other cells could not be looked for in all"
    )


def hidden_by_errors(certificate: Certificate) -> tuple[str, str]:
    """The status and reason of large meshes that errors explain, as they may others."""
    return "uncertified", (
        f"the mesh gives the matrix back to {certificate.backward_error:.1e}, within the errors of the entries, but "
        "where sides of triangles have vanished these may hide other cells, which is not looked for in components of "
        "more than 400 rows"
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
