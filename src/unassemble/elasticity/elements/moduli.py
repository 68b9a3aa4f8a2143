"""Lame coefficients of cells whose nodes are known: the matrix is linear in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import SolverError
from ...linalg import threads
from ...linalg.factorisation import factorisation
from ...linalg.upper import UpperTriangle
from .entries import Entries, Pairs
from .model import FITS, Fit, Model, assembled, largest, operator

_FEW = 0.3  # of the candidates: how many may be no cells
_DIRECT = 20_000  # coefficients: a factorisation costs half of the iterations here, and fills memory beyond
_SHIFT = 1e-11  # of normal equations: rounding of their entries is 1e-16
_STEPS = 20
_STILL = 1e-15  # relative change of coefficients at which steps end


def one_material(models: Sequence[Model], entries: Entries, ratio: float) -> Fit:
    """Coefficients of a body whose cells have (ratio mu, mu), the same mu for all but candidates that are no cells.

    Of these there have to be few. They overfill all entries that they contribute to; among candidates of which that
    is true, least squares tell which are cells.
    """
    pairs = [Pairs.of(model.cells, entries) for model in models]
    shares = [np.ones(len(model.cells)) for model in models]
    blocks = assembled(models, pairs, entries, ratio, shares)
    mu = _usual_factor(blocks, entries)
    if mu == 0:
        return Fit(np.zeros((sum(map(len, shares)), 2)), np.inf)
    poor = np.abs(mu * blocks - entries.value).max(axis=(1, 2)) > FITS * entries.size
    suspects = [np.flatnonzero((poor[own.place] | ~own.there).all(axis=1)) for own in pairs]
    if 0 < sum(map(len, suspects)) < _FEW * sum(map(len, shares)):
        for share, some in zip(shares, suspects, strict=True):
            share[some] = 0
        rest = entries.value - mu * assembled(models, pairs, entries, ratio, shares)
        told = _told_apart(models, pairs, suspects, entries, ratio, rest) / mu > 0.5
        parts = np.split(told, np.cumsum([len(some) for some in suspects])[:-1])
        for share, some, part in zip(shares, suspects, parts, strict=True):
            share[some] = part
        blocks = assembled(models, pairs, entries, ratio, shares)
    lame = np.concatenate(shares)[:, None] * np.array([ratio * mu, mu])
    return Fit(lame, largest(mu * blocks - entries.value, entries))


def _told_apart(
    models: Sequence[Model],
    pairs: Sequence[Pairs],
    suspects: Sequence[NDArray],
    entries: Entries,
    ratio: float,
    rest: NDArray,
) -> NDArray[np.float64]:
    """Shear moduli of the suspects, of all models one after the other, that explain the rest of the entries best."""
    parts = []
    for model, own, some in zip(models, pairs, suspects, strict=True):
        units = ((batch, ratio * unit[:1] + unit[1:]) for batch, unit in model.contributions(own, entries, some))
        parts.append(operator(units, own.at(some), entries, 1))
    return _least_squares_solution(sp.hstack(parts, format="csr"), rest, entries)


def _usual_factor(blocks: NDArray, entries: Entries) -> float:
    """Between the entries and those assembled, whatever a few candidates too many add."""
    square = (blocks * blocks).sum(axis=(1, 2))
    weighty = square > 1e-12 * square.max(initial=0)
    if not weighty.any():
        return 0.0
    return float(np.median((blocks * entries.value).sum(axis=(1, 2))[weighty] / square[weighty]))


def all_at_once(model: Model, entries: Entries) -> Fit:
    """Coefficients of all candidates by one sparse least-squares problem.

    For linear cells: neighbours share most of their entries, and candidates that carry no material get zeros.
    """
    pairs = Pairs.of(model.cells, entries)
    design = operator(model.contributions(pairs, entries), pairs, entries, model.unknowns)
    coefficients = _least_squares_solution(design, entries.value, entries)
    misfit = design @ coefficients - (entries.value / entries.size[:, None, None]).ravel()
    return Fit(model.mean(coefficients.reshape(-1, model.unknowns)), float(np.abs(misfit).max()))


def _least_squares_solution(design: sp.csr_array, value: NDArray, entries: Entries) -> NDArray[np.float64]:
    """Coefficients that fit entries best; zero where none shows."""
    weight = np.sqrt(np.asarray(design.power(2).sum(axis=0)).ravel())
    seen = weight > 0
    scaled = design[:, np.flatnonzero(seen)] @ sp.diags_array(1 / weight[seen])
    target = (value / entries.size[:, None, None]).ravel()
    coefficients = np.zeros(design.shape[1])
    with threads(1):  # many short vectors are not worth waking threads for
        found = _refined(sp.csr_array(scaled), target) if scaled.shape[1] <= _DIRECT else None
        if found is None:
            found = sp.linalg.lsmr(scaled, target, atol=1e-15, btol=1e-15, conlim=0, maxiter=600)[0]
    coefficients[seen] = found
    coefficients[seen] /= weight[seen]
    return coefficients


def _refined(design: sp.csr_array, target: NDArray) -> NDArray[np.float64] | None:
    """The least coefficients that fit best, by normal equations whose errors are taken off again and again.

    Columns have length one. Each step divides what is left of a combination of squared singular value s by 1 + s /
    `_SHIFT`; combinations that fit nothing stay zero. None where they have no factors.
    """
    if not (design.shape[1] and np.isfinite(design.data).all() and np.isfinite(target).all()):
        return None
    transposed = sp.csr_array(design.T)
    normal = UpperTriangle.of(sp.csr_array(transposed @ design + _SHIFT * sp.eye_array(design.shape[1])))
    solver = factorisation(normal, definite=True)
    try:
        solver.factorise(normal)
    except SolverError:
        solver.release()
        return None
    found = np.zeros(design.shape[1])
    for _ in range(_STEPS):
        step = solver.solve(transposed @ (target - design @ found))
        found += step
        if np.abs(step).max(initial=0) <= _STILL * np.abs(found).max(initial=0):
            break
    solver.release()
    return found
