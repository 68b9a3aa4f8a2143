"""Ways in which material may be spread over cells, the simplest first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .candidates import Block
from .entries import Entries, Pairs, claims
from .model import FITS, Fit, Model
from .moduli import all_at_once, one_material
from .peeling import cell_by_cell
from .reference import Rule, rules

_SAMPLE = 60  # cells on which quadrature rules are tried
_UNKNOWNS = 54  # coefficients of a cell that its own entries are asked for
_LARGEST = {True: 10_000_000, False: 50_000_000}  # numbers in the joint problem, if material varies within cells or not


def fits(
    points: NDArray, blocks: Sequence[Block], entries: Entries, ratio: float | None
) -> Iterator[tuple[tuple[Model, ...], Fit]]:
    """Lame coefficients of the candidates, in the ways that suit their kinds, the simplest first.

    Cells with entries of their own, boxes and quadratic ones, are one block at most; linear simplices lie beside them.
    One material where lambda / mu is one number, `ratio`, and there are simplices; a material for each cell; a material
    for each point of the quadrature, where there are no simplices.
    """
    simple = [Model(points, one.cells, one.kind, next(rules(one.kind))) for one in blocks if one.kind.linear_simplex]
    rich = [one for one in blocks if not one.kind.linear_simplex]
    if not rich:
        yield from _of_simplices(simple, entries, ratio)
        return
    beside = [Pairs.of(one.cells, entries) for one in simple]
    for varying in (False,) if simple else (False, True):
        likely, open_rules = _likely_rules(points, rich[0], entries, varying, beside)
        if likely is None:
            continue
        model = Model(points, rich[0].cells, rich[0].kind, likely, varying)
        if simple and ratio is not None:
            yield (*simple, model), one_material((*simple, model), entries, ratio)
        peeled = cell_by_cell(model, entries, beside)
        if not simple:
            yield (model,), Fit(peeled.lame, peeled.misfit)
            continue
        if np.isfinite(peeled.misfit):
            for models, fit in _of_simplices(simple, replace(entries, value=peeled.rest), None):
                yield (*models, model), Fit(np.vstack([fit.lame, peeled.lame]), fit.misfit)
    for rule in () if simple else open_rules:
        model = Model(points, rich[0].cells, rich[0].kind, rule, varying=True)
        if model.coefficients <= _LARGEST[True] and _patch_fits(model, entries):
            yield (model,), all_at_once(model, entries)


def _of_simplices(
    simple: Sequence[Model], entries: Entries, ratio: float | None
) -> Iterator[tuple[tuple[Model, ...], Fit]]:
    """Linear simplices, of which candidates may be none: one material, then one for each."""
    (model,) = simple
    if ratio is not None:
        yield (model,), one_material((model,), entries, ratio)
    if model.coefficients <= _LARGEST[False]:
        yield (model,), all_at_once(model, entries)


def _likely_rules(
    points: NDArray, block: Block, entries: Entries, varying: bool, beside: Sequence[Pairs]
) -> tuple[Rule | None, list[Rule]]:
    """The quadrature rule that fits a few cells best by the entries that are theirs alone, None if none does.

    And the rules with more coefficients than such entries determine. Cells `beside` claim entries too.
    """
    kind, cells = block.kind, block.cells
    pairs = Pairs.of(cells, entries)
    alone = claims((pairs, *beside), entries) == 1
    own = pairs.there & alone[pairs.place]
    rich = np.flatnonzero(own.sum(axis=1) >= own.sum(axis=1).max())
    some = rich[:: max(len(rich) // _SAMPLE, 1)]
    place = np.unique(pairs.place[some][own[some]])
    few = entries.at(place)
    best, chosen, undetermined = FITS, None, []
    for rule in rules(kind) if len(place) else ():
        model = Model(points, cells[some], kind, rule, varying)
        if model.unknowns > _UNKNOWNS:
            continue
        misfit = cell_by_cell(model, few).misfit
        if misfit < 0.1 * best:  # where geometry is affine they all fit, up to rounding
            best, chosen = misfit, rule
        if np.isinf(misfit):
            undetermined.append(rule)
    return chosen, undetermined


def _patch_fits(model: Model, entries: Entries) -> bool:
    """Whether a few cells that lie together fit the entries that are theirs alone."""
    centre = model.points[model.cells].mean(axis=1)
    some = np.argsort(np.linalg.norm(centre - centre[len(centre) // 2], axis=1))[:_SAMPLE]
    pairs, own = Pairs.of(model.cells, entries), Pairs.of(model.cells[some], entries)
    count, inside = claims((pairs,), entries), claims((own,), entries)
    patch = Model(model.points, model.cells[some], model.kind, model.rule, model.varying)
    return all_at_once(patch, entries.at(np.flatnonzero((inside > 0) & (inside == count)))).misfit <= FITS
