"""Equations that contradict the others, as elements make them that strain where they move rigidly.

Offsets that lack their moments or springs across the line between two nodes spoil the rows of their nodes and no
others. Least squares spread that over all positions. Where small deviations count nearly as much as large ones,
equations are satisfied or left alone, as long as those that hold determine all nodes several times over.

R. Chartrand and W. Yin, Iteratively reweighted algorithms for compressive sensing, ICASSP 2008, 3869-3872.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..linalg import solved
from ..tolerances import ALIKE, CERTIFIED, MOST, ROUNDED
from ..words import count_of, words_of
from .equations import Equations
from .nodes import Nodes


def contradicted(given: Equations, nodes: Nodes) -> tuple[NDArray[np.bool_], NDArray[np.int64]] | None:
    """Equations to leave out, and the nodes whose rows contradict others; None where that are too many, or none.

    By least squares, with weights that fall with the deviations of the round before, these of not less than a bound
    that falls from round to round. Off is what misses by more than half of the digits; with it go all equations of its
    node, and those of several rows, or of members, in which the node occurs.
    """
    A, b = given.operator, nodes.layout.block_size
    lengths = float(np.abs(given.right).max(initial=0.0))
    if not lengths:
        return None
    x, weight, least = np.zeros(A.shape[1]), np.ones(A.shape[0]), lengths
    for _ in range(REFINEMENTS):
        weighted = sp.csr_array(sp.diags_array(weight / weight.max()) @ A)
        normal = sp.csr_array(A.T @ weighted)
        held = sp.eye_array(A.shape[1]) * (ROUNDED * normal.diagonal().max())  # translations are free
        x = x + solved(sp.csr_array(normal + held), weighted.T @ (given.right - A @ x))
        off = np.abs(given.right - A @ x)
        least = max(least / 3, CERTIFIED * lengths)
        weight = 1 / np.maximum(off, least) ** 1.5
    wrong = off > ALIKE * lengths
    spoiled = np.unique(given.row[wrong & (given.row >= 0)] // b)
    theirs = np.isin(np.arange(A.shape[1]) // nodes.layout.dim, spoiled)
    touched = abs(A) @ theirs.astype(float) > 0
    out = np.asarray(wrong | np.where(given.row < 0, touched, np.isin(given.row // b, spoiled)))
    return (out, spoiled) if out.any() and out.mean() <= 1 - MOST else None


def said_of(spoiled: NDArray[np.int64]) -> str:
    """Which nodes these are, in words."""
    some = words_of(spoiled[:10].tolist()) + (", ..." if len(spoiled) > 10 else "")
    return (
        f"the rows of {count_of(len(spoiled), 'node')} ({some}) contradict the others and were left out: elements "
        "between them, or some of these, strain where they move rigidly, as with offsets or springs"
    )
