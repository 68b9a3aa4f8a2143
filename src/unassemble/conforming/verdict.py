"""From a mesh held against the matrix to its status: decided here, once."""

from collections.abc import Sequence

import numpy as np

from ..matrix import OperatorMatrix
from ..scalar.held import Held
from ..scalar.solving import Task
from ..tolerances import CERTIFIED, CONFIDENCE, LARGEST_NOISE
from ..topology.keys import contains, pair_keys
from ..words import count_of, sentences
from .fit import Fitted


def verdict(
    stored: OperatorMatrix, fits: Sequence[Fitted], held: Sequence[Held], task: Task, *, told: bool
) -> tuple[str, str | None, str]:
    """Status, uniqueness and reason of a mesh.

    `fits`: its parts; `held` (Held, Held): the mesh about the origins of its parts, and as it is written; `told`:
    whether the graph alone tells the cells.
    """
    near, written = held
    reason = _obstacle(fits, near, task) or _bare(stored, fits)
    if reason:
        return "uncertified", None, reason
    uniqueness = "proved" if told else "searched"
    error = written.certificate.backward_error
    if not written.passes:
        why = (
            f"the mesh fits, but not as it is written: so far from the origin its coordinates have too few digits, and "
            f"the matrix is given back to {error:.1e} (relative) only"
        )
        return "uncertified", uniqueness, why
    if written.test and written.by_noise:
        p = written.test.figures["p_value"]
        return "certified", uniqueness, f"the misfit is that of {written.test.noise} (p = {p:.2g})"
    fits_well = f"the operator re-assembled on this mesh gives the matrix back to {error:.1e} (relative)"
    return "certified", uniqueness, fits_well


def _obstacle(fits: Sequence[Fitted], near: Held, task: Task) -> str:
    """What speaks against a mesh, the gravest first; empty if nothing does."""
    certificate, test = near.certificate, near.test
    notes = list(dict.fromkeys(note for fit in fits for note in fit.notes))
    if len(certificate.flipped):
        turned = count_of(len(certificate.flipped), "cell is", "cells are") + " flat, not convex or turned over"
        return sentences((turned, *notes))
    known = task.scale is not None
    loose = [fit for fit in fits if fit.freedom + known <= 0]
    if loose:
        row = int(loose[0].part.piece.vertices.min())
        return f"the part of row {row} has no more entries than unknowns, so that it fits proves nothing"
    if test and near.by_noise:
        if test.drowned:
            return f"noise above {test.limit:.2g} ({LARGEST_NOISE:g} of c) drowns what the entries say of angles"
        if test.coincidence:
            return "entries of so few digits may fit by chance"
        if not test.likely:
            p = min(test.figures["p_value"], test.figures["largest_p_value"])
            large = f"the misfit is too large for {test.noise} (p = {p:.1e}, where {CONFIDENCE:g} is allowed)"
            return sentences((large, *notes))
        return sentences(("the mesh that fits need not be the likeliest", *notes)) if notes else ""
    if not near.passes:
        (i, j), misfit = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
        differs = (
            f"the re-assembled matrix differs, most in the entry of rows {i} and {j} (by {misfit:.1e} of the row's "
            f"largest, where {CERTIFIED:g} is allowed)"
        )
        return sentences((differs, *notes))
    return ""


def _bare(stored: OperatorMatrix, fits: Sequence[Fitted]) -> str:
    """A stored entry of no cell; empty if there is none."""
    covered = [pair_keys(stored.n, *fit.part.rows.T) for fit in fits]
    bare = np.flatnonzero(~contains(np.sort(np.concatenate(covered)), stored.edges @ [stored.n, 1]))
    if not len(bare):
        return ""
    i, j = stored.edges[bare[0]]
    return f"the mesh gives the matrix back, but the stored zero of rows {i} and {j} belongs to no cell"
