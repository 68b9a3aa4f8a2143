"""Ways in which material may be spread over cells, the simplest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .entries import Entries, Pairs
from .kinds import Kind
from .moduli import FITS, Fit, Model, all_at_once, cell_by_cell, one_material
from .reference import Rule, rules

_SAMPLE = 60  # cells on which quadrature rules are tried
_UNKNOWNS = 54  # coefficients of a cell that its own entries are asked for
_LARGEST = {True: 10_000_000, False: 50_000_000}  # numbers in the joint problem, if material varies within cells or not


def fits(
    points: NDArray, cells: NDArray, kind: Kind, entries: Entries, ratio: float | None
) -> Iterator[tuple[Model, Fit]]:
    """Lame coefficients of the candidates, in the ways that suit the kind, the simplest first.

    One material where lambda / mu is one number, `ratio`; a material for each cell; a material for each point of the
    quadrature.
    """
    if not len(cells):
        return
    if kind.linear_simplex:
        (rule,) = rules(kind)
        model = Model(points, cells, kind, rule)
        if ratio is not None:
            yield model, one_material(model, entries, ratio)
        if model.coefficients <= _LARGEST[False]:
            yield model, all_at_once(model, entries)
        return
    for varying in (False, True):
        likely, open_rules = _likely_rules(points, cells, kind, entries, varying)
        if likely is not None:
            model = Model(points, cells, kind, likely, varying)
            yield model, cell_by_cell(model, entries)
    for rule in open_rules:
        model = Model(points, cells, kind, rule, varying=True)
        if model.coefficients <= _LARGEST[True] and _patch_fits(model, entries):
            yield model, all_at_once(model, entries)


def _likely_rules(
    points: NDArray, cells: NDArray, kind: Kind, entries: Entries, varying: bool
) -> tuple[Rule | None, list[Rule]]:
    """The quadrature rule that fits a few cells best by the entries that are theirs alone, None if none does.

    And the rules with more coefficients than such entries determine.
    """
    pairs = Pairs.of(cells, entries)
    alone = np.bincount(pairs.place[pairs.there], minlength=len(entries.key)) == 1
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
    count, inside = (np.bincount(one.place[one.there], minlength=len(entries.key)) for one in (pairs, own))
    patch = Model(model.points, model.cells[some], model.kind, model.rule, model.varying)
    return all_at_once(patch, entries.at(np.flatnonzero((inside > 0) & (inside == count)))).misfit <= FITS
