"""Why a mesh has its status, in at most two sentences, the important one first; and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certificate import Certificate, without_spare_equations
from ..planar.terms import COEFFICIENT, MASS, Term
from ..tolerances import ALIKE, CERTIFIED, CONFIDENCE, LARGEST_NOISE, LITTLE, MAGNIFIED, PLACED
from ..words import Reason, count_of, words_of
from .noise import Noise
from .solving import Solved, leaders

if TYPE_CHECKING:
    from .findings import Finished

_CHECK_MODEL = "see what `inspect_matrix` says the matrix is: a wrong model leaves a misfit everywhere"
_ONE_COEFFICIENT = "see whether a coefficient varies from cell to cell, the surface is curved or it is a network"
_KEEP_ROWS = "keep the rows and columns of all unknowns, those on the boundary too: some rows do not add up to zero"
_LEAVE_SCALE = "leave out `scale`: it is found where it is not given"
_GIVE_NOISE = "if the entries are measured, give the standard deviation of their errors as `noise`"


def objections(f: Finished) -> Iterator[Reason]:
    """All that speaks against a mesh, the gravest first, each with what to do about it; nothing where it is right."""
    apart = _discord(f.solved, f.certificate.backward_error, f.near.by_noise)
    for said, advice in _doubts(f, apart) if f.near.passes else _misfits(f, apart):
        yield Reason(said, advice=advice)
    if f.near.passes and not f.compared.written.passes:
        yield far_away(f.origins, f.compared.written.certificate, f.certificate)


def _doubts(f: Finished, apart: str) -> Iterator[tuple[str, str]]:
    """What leaves a mesh in doubt although it fits."""
    topology, error, allowed = f.solved.topology, f.certificate.backward_error, PLACED
    doubt = max(mesh.doubt for mesh in f.solved.meshes)
    if topology.failures:
        yield f"{f.fits}, but not in all of it: {topology.failures[0]}", _CHECK_MODEL
    if apart:
        yield f"the matrix is given back to {error:.1e} (relative), but {apart}", ""
    if noise := f.near.by_noise:
        # The last step of a polish that came to no end is but a guess of how far off points are.
        allowed = max(PLACED, LITTLE * noise.sigma / float(np.abs(f.solved.scales).min()))
        if f.evidence.term:
            yield from _lacking(f, f.evidence.term)
    if not doubt <= allowed:
        yield f"{f.fits}, but points are known to about {doubt:.0e} of the size only", ""
        yield from ((note, "") for note in f.trouble)
    if len(topology.bare_edges) and not (noise and f.solved.linear):
        i, j = topology.edges[topology.bare_edges[0]]
        advice = "forget stored zeros by `drop_zeros`, if they are no part of the structure"
        yield f"{f.fits}, but the stored zero of rows {i} and {j} belongs to no cell", advice
    if len(rows := _without_spare(f)):
        one = f"the piece of row {rows[0]} has" if len(rows) == 1 else f"{len(rows)} pieces, as of row {rows[0]}, have"
        proves = (
            f"nearly any entries belong to such a mesh, and that it gives the matrix back to {error:.1e} (relative)"
        )
        yield (
            f"{one} no entry to spare: {proves} proves nothing",
            "give `scale` if it is known" if f.solved.task.free_scale else "",
        )


def _without_spare(f: Finished) -> NDArray[np.int64]:
    """A row of each piece that has no equations to spare."""
    solved, known = f.solved, not f.solved.task.free_scale
    if solved.linear:
        return without_spare_equations(solved.stored.edges, f.mesh.points, f.mesh.divided()[0], known_scale=known)
    return np.array([piece.vertices.min() for piece in solved.topology.pieces])[solved.spare + known <= 0]


def _misfits(f: Finished, apart: str) -> Iterator[tuple[str, str]]:
    """What does not fit, and what it looks like."""
    topology, stored, certificate, noise = f.solved.topology, f.solved.stored, f.certificate, f.near.by_noise
    if noise and f.near.drowned:
        much = f"{noise} drowns the cotangents, and almost any mesh would pass: the test is worth something up to "
        yield (
            f"{much}{f.near.limit:.2g}, {LARGEST_NOISE:g} times the scale",
            "give less noise, if entries are that good",
        )
        return
    without = stored.incomplete_rows.any()
    model = _KEEP_ROWS if without else _ONE_COEFFICIENT if stored.adds_up.all() else _CHECK_MODEL
    model = model if f.solved.task.free_scale else _LEAVE_SCALE
    if topology.failures:
        parts = count_of(len(topology.failures), "part of the matrix has", "parts of the matrix have")
        yield f"{parts} no mesh: {topology.failures[0]}", _CHECK_MODEL
        return
    if apart and not noise:
        yield apart, model
    bare = topology.bare_edges[f.solved.matrix.entries[topology.bare_edges] != 0]
    if len(bare):
        i, j = topology.edges[bare[0]]
        some = count_of(len(bare), "nonzero entry belongs", "nonzero entries belong")
        yield f"{some} to no triangle, the first that of rows {i} and {j}", model
        return
    if len(flipped := certificate.flipped):
        some = count_of(len(flipped), "cell is", "cells are")
        cells = [f.mesh.divided()[0]] if f.solved.linear else f.mesh.cells.values()
        rows = words_of(np.sort(next(islice(chain(*cells), int(flipped[0]), None))))
        yield f"{some} flat, not convex or turned over, the first that of rows {rows}", model
    elif f.evidence.term and (noise or f.solved.task.free_scale):
        yield from _lacking(f, f.evidence.term)
    elif len(f.evidence.suspects):
        i, j = f.evidence.suspects[0]
        said = f"the entry of rows {i} and {j} stands out from the misfit of all others"
        yield said, "check the entries that stand out, which the report lists"
    if noise:
        if f.near.likely and f.near.coincidence:
            chance = "there are too few different entries beyond the unknowns to tell that from chance"
            yield f"{f.fits}, but {chance}", "write the entries with more digits"
        if not f.near.likely:
            yield _unlikely(f, noise), "check the noise, and the entries"
        yield _astray(f), ""
    elif remark := _like_noise(f):
        if without:
            yield "only some rows add up to zero, as next to unknowns that were eliminated", _KEEP_ROWS
        elif stored.adds_up.all():
            yield "all rows add up to zero, which errors of single entries would not leave", _ONE_COEFFICIENT
        else:
            yield remark, _GIVE_NOISE
    yield from ((note, "") for note in f.trouble)
    (i, j), largest = certificate.pairs[certificate.misfits.argmax()], certificate.misfits.max()
    most = f"by {largest:.1e} of the row's largest entry where {CERTIFIED:g} is allowed"
    yield f"the re-assembled matrix differs most in the entry of rows {i} and {j}, {most}", model


def _lacking(f: Finished, term: Term) -> Iterator[tuple[str, str]]:
    """That a term explains a misfit which the model does not have."""
    share = f"{term.share:.0%}" if term.share < 0.995 else "nearly all"
    which, advice = "most entries are off in one direction", _CHECK_MODEL
    # With a mass matrix, or one number added, rows do not add up to zero.
    if term.name == COEFFICIENT or f.solved.stored.adds_up.all():
        which = "a coefficient that varies in space leaves such, and a constant one is assumed"
        advice = "assemble the matrix with a constant coefficient"
    elif term.name == MASS:
        which = "it has the form of a mass matrix, and the rows do not add up to zero: A = c L + s M"
        advice = "assemble the stiffness matrix alone, or lump the mass matrix"
    yield f"the misfit is no noise, since a term that the model lacks explains {share} of its square", advice
    yield which, ""


def _like_noise(f: Finished) -> str:
    """That the misfit is small and nowhere concentrated; empty where it is not."""
    size, noise = np.abs(f.certificate.differences), f.evidence.noise
    if not (noise and noise <= LARGEST_NOISE * np.abs(f.solved.scales).min()):
        return ""
    small = size.max() <= 8 * np.sqrt(np.mean(size**2))
    return f"noise of standard deviation {noise:.2g} (absolute) in the entries would leave as much" if small else ""


def _astray(f: Finished) -> str:
    """On a mesh that is not the one of known noise: where the polish has ended."""
    if len(f.evidence.suspects):
        return ""
    if not f.solved.task.options.polished:
        return "the mesh was not polished"
    why = "whether that is because of the start, wrong entries or wrong cells cannot be told"
    return f"the polish has not come to a mesh that explains the matrix, and {why}"


def _unlikely(f: Finished, noise: Noise) -> str:
    """That noise would not leave such a misfit."""
    figures = f.near.figures
    if figures["p_value"] < CONFIDENCE:
        return f"the misfit is more than {noise} explains {f.near}"
    i, j = f.certificate.pairs[np.abs(f.certificate.differences / np.asarray(f.near.errors)).argmax()]
    return (
        f"the entry of rows {i} and {j} is off by {figures['largest']:.1f} standard deviations of {noise}, "
        f"more than the largest of {len(f.certificate.pairs)} would be"
    )


def ambiguous(others: list[Alternative], certificate: Certificate) -> Reason:
    """The reason of a mesh that fits, where others do as well."""
    first = others[0]
    instead = f" in place of {_cells(first.cells)}" if first.cells else " besides"
    return Reason(
        f"the mesh gives the matrix back to {certificate.backward_error:.1e} (relative), but so does another, with "
        f"the cells {_cells(first.other_cells)}{instead}",
        f"likewise in {count_of(len(others) - 1, 'more part')} of the matrix" if len(others) > 1 else "",
        advice="choose by what else is known of the mesh: the report lists all cells in doubt",
    )


def _discord(solved: Solved, backward_error: float, noise: Noise | None) -> str:
    """What is wrong where pieces share vertices but not c, errors of entries allowed for; empty if nothing is.

    Each piece by itself has its own c, and errors move it. Where the noise is known the others have been fitted with
    the c of their leaders, if at all. `noise`: that which decides; None where the mesh has entries of few digits
    exactly, so that nothing shows that they were rounded.
    """
    topology, c = solved.topology, solved.scales
    if not len(topology.hinges):
        return ""
    lead = leaders(topology, solved.spare)
    difference = np.abs(c / c[lead] - 1)
    # A null vector that is not polished may be off by more than the entries; noise says itself how much it explains.
    if difference.max() > max(ALIKE, 0.0 if noise else MAGNIFIED * backward_error):
        worst = int(difference.argmax())
        named = " and ".join(
            f"{c[p]:.6g} in piece {p}, of row {topology.pieces[p].vertices.min()}" for p in (int(lead[worst]), worst)
        )
        return f"pieces that share vertices have different factors c: {named}"
    if noise is None:
        return ""
    # A piece with entries to spare tells c. One that hangs by a single vertex on pieces of which one does so can only
    # be read in itself, and no other way if nothing has vanished and no triangle, with others all around, is a hole.
    gone = np.zeros(len(topology.edges), dtype=bool)
    gone[topology.vanished] = True
    shared = np.array([np.count_nonzero(topology.multiplicity[piece.vertices] > 1) for piece in topology.pieces])
    otherwise = np.array([gone[p.edge_rows].any() or p.inner[p.opposite].all(axis=1).any() for p in topology.pieces])
    spare = solved.spare > 0
    rough = (shared > 0) & (~spare[lead] | ((otherwise | (shared > 1)) & ~spare))
    if not rough.any():
        return ""
    row = topology.pieces[int(rough.argmax())].vertices.min()
    return f"the piece of row {row}, which shares vertices with others, has too few entries to tell under {noise}"


def far_away(origins: NDArray, written: Certificate, near: Certificate) -> Reason:
    """The reason of a mesh that fits until its coordinates are written, too far from the origin."""
    origin = complex(origins[np.abs(origins).argmax()])
    return Reason(
        f"the mesh gives the matrix back to {near.backward_error:.1e} (relative), but its coordinates lie so far from "
        f"the origin that they have too few digits left: as written they give it back to "
        f"{written.backward_error:.1e} (relative)",
        advice=f"subtract a point near ({origin.real:.6g}, {origin.imag:.6g}) from all of `anchors`",
    )


def _cells(cells: tuple[tuple[int, ...], ...]) -> str:
    shown = ", ".join("-".join(map(str, cell)) for cell in cells[:6])
    return shown + (", ..." if len(cells) > 6 else "")
