"""Lame coefficients of candidates for cells whose nodes are known: the matrix is linear in them.

Boxes and quadratic cells have entries of their own, between nodes on opposite sides, which tell their coefficients.
What is left once these cells are taken away belongs to linear simplices: of one material, or by sparse least squares.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...elements.candidates import Block
from ...elements.reference import Rule, rules
from ...elements.surface import contested
from ...linalg import threads
from ...tolerances import ALIKE, LAST_DIGITS, LITTLE, ROUNDED, SINGULAR
from .entries import BlockEntries, MaterialModel, Pairs, added, claims

_SAMPLE = 60  # cells on which quadrature rules are tried
_LARGEST = 50_000_000  # numbers in a least-squares problem
_AS_WELL = 1 / LITTLE  # by which factor fewer cells may explain the entries worse than all candidates
_EXPLAINED = 10 * LAST_DIGITS  # what least squares leave of entries that cells explain, relative to their row
_FOUR_DIGITS = 1e4  # by which factor what a cell adds to an entry exceeds what is left of entries, at least


# Blocks, lambda and mu (m, 2) of their cells, one after the other, zero for candidates that carry no material; the
# largest difference between an entry and the re-assembled one, relative to its row; and how many cells are so weak that
# this difference hides their material.
Fit = tuple[Sequence[Block], NDArray[np.float64], float, int]


def fits(
    points: NDArray[np.float64], blocks: Sequence[Block], entries: BlockEntries, ratio: float | None
) -> Iterator[Fit]:
    """Lame coefficients of the candidates, in the ways that suit their kinds, the simplest first.

    They are linear simplices, cells with entries of their own, or the one beside the other, and explain the entries;
    lambda / mu is the `ratio` where it is one number.
    """
    simple = [
        MaterialModel(points, one.cells, one.kind, next(rules(one.kind))) for one in blocks if one.kind.linear_simplex
    ]
    beside = [Pairs.of(one.cells, entries) for one in simple]
    rich = [one for one in blocks if not one.kind.linear_simplex]
    lame, hidden = [np.empty((0, 2))], 0
    for one in rich:
        rule = _likely_rule(points, one, entries, beside)
        if rule is None:
            return
        found, entries, unsure = cell_by_cell(MaterialModel(points, one.cells, one.kind, rule), entries, beside)
        lame.append(found)
        hidden += unsure
    if not simple:
        yield rich, np.vstack(lame), entries.largest, hidden
    for model in simple:
        if ratio is not None:
            coefficients, rest = _one_material(model, entries, ratio)
            yield blocks, np.vstack([coefficients, *lame]), rest.largest, hidden
        pairs = model.kind.nodes * (model.kind.nodes - 1)
        if len(model.cells) * pairs * model.kind.dim**2 <= _LARGEST:
            coefficients, rest, unsure = _fewest(model, entries)
            yield blocks, np.vstack([coefficients, *lame]), rest.largest, hidden + unsure


def _likely_rule(points: NDArray, block: Block, entries: BlockEntries, beside: Sequence[Pairs]) -> Rule | None:
    """The quadrature rule that fits a few cells best by the entries that are theirs alone, None if none does."""
    pairs = Pairs.of(block.cells, entries)
    alone = claims((pairs, *beside), entries) == 1
    own = pairs.there & alone[pairs.place]
    rich = np.flatnonzero(own.sum(axis=1) >= np.median(own.sum(axis=1)))
    some = rich[:: max(len(rich) // _SAMPLE, 1)]
    few = entries.at(np.unique(pairs.place[some][own[some]]))
    best, chosen = np.inf, None
    for rule in rules(block.kind) if len(few.key) else ():
        found, rest, _ = cell_by_cell(MaterialModel(points, block.cells[some], block.kind, rule), few)
        # Where geometry is affine they all fit.
        if np.isfinite(found).all() and rest.largest <= min(entries.allowed, LITTLE * best):
            best, chosen = rest.largest, rule
    return chosen


def cell_by_cell(
    model: MaterialModel, entries: BlockEntries, beside: Sequence[Pairs] = ()
) -> tuple[NDArray[np.float64], BlockEntries, int]:
    """(m, 2) coefficients of cells from the entries that no other contributes to, and what they leave of all entries.

    The third result counts weak cells of which what is left of stronger ones hides the material.

    Two nodes on opposite sides of a cell share that cell only, so that their entries tell its coefficients. A cell next
    to a support may lack such entries until its neighbours' contributions are taken away. Cells that stay open have
    NaN, and those `beside` claim entries too.
    """
    pairs = Pairs.of(model.cells, entries)
    rest = entries.value.reshape(-1).copy()
    lame = np.zeros((len(model.cells), 2))
    todo = np.flatnonzero(pairs.seen)
    lame[todo] = np.nan
    count = claims((pairs, *beside), entries)
    whole = count == 1  # entries of which nothing is taken away before they tell a cell
    by = np.zeros(pairs.there.shape, dtype=bool)
    while True:  # cells next to supports may wait for their neighbours
        alone, before = count == 1, len(todo)
        for batch, unit in model.contributions(pairs, entries, todo):
            some = todo[batch]
            place, there = pairs.place[some], pairs.there[some]
            target = rest.reshape(entries.value.shape)[place]
            own = there & alone[place]
            found = _of_own_entries(unit, target, own, entries.size[place])
            told = np.isfinite(found[:, 0])
            by[some[told]] = own[told]
            lame[some[told]] = found[told]
            place, there = place[told], there[told]
            sums = np.einsum("sm,smpcb->mpcb", found[told].T, unit[:, told])
            added(rest, place[there], -sums[there])
            count -= np.bincount(place[there], minlength=len(count))
        todo = todo[np.isnan(lame[todo, 0])]
        if not 0 < len(todo) < before:
            break
    left = np.abs(rest.reshape(entries.value.shape)).max(axis=(1, 2)) / entries.size
    sure = (by & whole[pairs.place]).any(axis=1)
    left = np.where(by, left[pairs.place], 0).max(axis=1)
    most = model.most_added(pairs, entries, lame)
    nothing = ~sure & (most < _EXPLAINED)  # what is left of other cells
    most[nothing], lame[nothing] = 0, 0
    left = np.where(sure, left, np.maximum(left, LAST_DIGITS))
    weak = (most > 0) & (most < np.minimum(ALIKE, _FOUR_DIGITS * left))
    return lame, replace(entries, value=rest.reshape(entries.value.shape)), int(weak.sum())


def _of_own_entries(unit: NDArray, target: NDArray, own: NDArray[np.bool_], size: NDArray) -> NDArray[np.float64]:
    """(m, 2) coefficients of each cell for which its own pairs fit best; NaN where they tell too little."""
    s, m = unit.shape[:2]
    weight = (own / size)[..., None, None]
    columns = (unit * weight).transpose(1, 0, 2, 3, 4).reshape(m, s, -1)
    normal = columns @ columns.transpose(0, 2, 1)
    right = columns @ (target * weight).reshape(m, -1, 1)
    length = np.sqrt(np.maximum(np.diagonal(normal, axis1=1, axis2=2), 1e-300))
    normal = normal / (length[:, :, None] * length[:, None, :])
    enough = np.linalg.eigvalsh(normal)[:, 0] > SINGULAR
    found = np.full((m, s), np.nan)
    scaled = np.linalg.solve(normal[enough], (right[..., 0] / length)[enough][..., None])[..., 0]
    found[enough] = scaled / length[enough]
    return found


def _one_material(
    model: MaterialModel, entries: BlockEntries, ratio: float
) -> tuple[NDArray[np.float64], BlockEntries]:
    """(m, 2) coefficients (ratio mu, mu) of cells, the same for all, and what they leave of the entries."""
    unit = np.ones((len(model.cells), 1)) * [ratio, 1]
    full = model.assembled(Pairs.of(model.cells, entries), entries, unit)
    square = (full * full).sum(axis=(1, 2))
    weighty = square > ROUNDED * square.max(initial=0)
    # Between the entries and those assembled, whatever a few candidates too many add.
    each = (full * entries.value).sum(axis=(1, 2))[weighty] / square[weighty]
    mu = float(np.median(each)) if len(each) else 0.0
    return mu * unit, replace(entries, value=entries.value - mu * full)


def _fewest(model: MaterialModel, entries: BlockEntries) -> tuple[NDArray[np.float64], BlockEntries, int]:
    """(m, 2) coefficients of as few cells as explain the entries as well as all candidates do, and what they leave.

    Candidates that carry no material come out as weak cells, by rounding. A weak cell of the body is told from these
    by the entries, each relative to its own row: without it they are not explained. The third result counts the cells
    of which rounding hides whether they are there, or of what material. Where entries were rounded to few digits, holes
    are among them, which look the same.
    """
    lame, rest = _least_squares(model, entries)
    most = model.most_added(Pairs.of(model.cells, entries), entries, lame)
    bound = max(_AS_WELL * rest.largest, _EXPLAINED)
    kept = np.ones(len(most), dtype=bool)
    for least in ALIKE * LITTLE ** np.arange(10):
        strong = most > least
        if strong.all() or not strong.any() or least < rest.largest:
            break
        fewer = replace(model, cells=model.cells[strong])
        found, left = _least_squares(fewer, entries)
        if left.largest <= bound:
            kept, lame, rest = strong, np.zeros_like(lame), left
            lame[kept] = found
            break
    weak = kept & _uncertain(model, entries, lame, max(rest.largest, LAST_DIGITS))
    gone = ~kept & (most > _EXPLAINED)
    gone[gone] = ~contested(model.kind.base, np.vstack([model.cells[gone], model.cells[kept]]))[: gone.sum()]
    return lame, rest, int((weak | gone).sum())


def _uncertain(model: MaterialModel, entries: BlockEntries, lame: NDArray, noise: float) -> NDArray[np.bool_]:
    """(m,) weak cells whose coefficients (m, 2) errors of the entries change by more than the fourth digit.

    Errors are drawn at random, as large as the `noise`, relative to their row. Several weak cells together may be free
    to change where each by itself is not, so that only a fit tells.
    """
    size = np.abs(lame).max(axis=1)
    weak = (size > 0) & (size < ALIKE * size.max(initial=0))
    if not weak.any():
        return weak
    drawn = np.random.default_rng(0).standard_normal(entries.value.shape) * entries.told
    errors = replace(entries, value=noise * drawn * entries.size[:, None, None])
    carries = size > 0
    change = np.zeros_like(lame)
    change[carries] = _least_squares(replace(model, cells=model.cells[carries]), errors)[0]
    return np.asarray(weak & (_FOUR_DIGITS * np.abs(change).max(axis=1) > size))


def _least_squares(model: MaterialModel, entries: BlockEntries) -> tuple[NDArray[np.float64], BlockEntries]:
    """(m, 2) coefficients that fit entries best, zero where none shows, and what they leave of the entries.

    Neighbours share most of their entries, and candidates that carry no material get zeros.
    """
    design = model.operator(Pairs.of(model.cells, entries), entries)
    target = (entries.value / entries.size[:, None, None]).ravel()
    weight = np.sqrt(np.asarray(design.power(2).sum(axis=0)).ravel())
    seen = weight > 0
    scaled = sp.csr_array(design[:, np.flatnonzero(seen)] @ sp.diags_array(1 / weight[seen]))
    coefficients = np.zeros(design.shape[1])
    with threads(1):  # many short vectors are not worth waking threads for
        found = sp.linalg.lsmr(scaled, target, atol=1e-15, btol=1e-15, conlim=0, maxiter=600)[0]
    coefficients[seen] = found / weight[seen]
    left = (target - design @ coefficients).reshape(entries.value.shape) * entries.size[:, None, None]
    return coefficients.reshape(-1, 2), replace(entries, value=left)
