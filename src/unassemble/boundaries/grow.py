"""What a core determines grows by a few vertices at a time.

Vertices that whole entries tie to each other, and to others whose places are known, are known as well where these
entries determine and check them: to first order, which shows before any of them is fitted, and by fitting. The smallest
such sets come first, many at once, since they have nothing to do with each other.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..planar.cotangent import areas, weight_roundings
from ..tolerances import CERTIFIED
from ..topology import Piece
from .fit import WholeEntries
from .patch import fit_near

_log = logging.getLogger(__name__)

Vertices = tuple[int, ...]  # in ascending order


def grow(
    problem: WholeEntries, z: NDArray[np.complex128], scale: NDArray, whole: NDArray[np.bool_], known: NDArray[np.bool_]
) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """Positions, and the vertices (n,) that are known with some, (n,) bool, such that whole entries (e,) fit."""
    piece, held = problem.piece, known
    failed, idle = set[Vertices](), 0
    while idle < 3:
        ties = _Ties.of(piece, problem.gradient(z, scale), whole, known)
        sets = ties.sets(failed)
        if not sets:
            break
        there, more = _fitted(problem, z, scale, known, ties, sets)
        among = whole & more[piece.stencil].all(axis=0)
        there = fit_near(problem, there, scale, among, more & ~held, ((0.0, 5),))  # errors would add up
        fits = np.abs(problem.misfits(there, scale)) <= 1e-12 * weight_roundings(piece, there)
        idle += 1
        if more.sum() > known.sum() and fits[among].all():
            z, known, idle = there, more, 0
        failed.update(some for some in sets if not known[list(some)].any())
        _log.debug("%d vertices known, %d sets do not fit", known.sum(), len(failed))
    return z, known


@dataclass(frozen=True, eq=False)
class _Ties:
    """What whole entries say of vertices that are not known."""

    stencil: NDArray[np.int64]  # (4, e)
    gradient: NDArray[np.complex128]  # (4, e)
    vertices: dict[int, list[int]]  # of each entry, those that are not known
    entries: dict[int, list[int]]  # of each of these vertices
    front: list[int]  # those of them with neighbours that are known

    @classmethod
    def of(cls, piece: Piece, gradient: NDArray, whole: NDArray[np.bool_], known: NDArray[np.bool_]) -> _Ties:
        """With gradients (4, e) as :func:`..planar.cotangent.weight_gradient` has them."""
        some = np.flatnonzero(whole & ~known[piece.stencil].all(axis=0))
        vertices, entries = dict[int, list[int]](), defaultdict[int, list[int]](list)
        for e, corners in zip(some.tolist(), piece.stencil[:, some].T.tolist(), strict=True):
            vertices[e] = [v for v in dict.fromkeys(corners) if not known[v]]
            for v in vertices[e]:
                entries[v].append(e)
        beside = np.unique(piece.edges[known[piece.edges].any(axis=1)])
        return cls(piece.stencil, gradient, vertices, entries, [v for v in beside.tolist() if v in entries])

    def within(self, some: Vertices) -> list[int]:
        """Entries that depend on some vertices and on known ones only."""
        return sorted({e for v in some for e in self.entries[v] if set(self.vertices[e]).issubset(some)})

    def sets(self, failed: set[Vertices]) -> list[Vertices]:
        """Sets without common vertices, the smallest ones of each first, none that has failed."""
        found = {some for v in self.front if (some := self._about(v, failed))}
        taken, chosen = set[int](), list[Vertices]()
        for some in sorted(found, key=lambda some: (len(some), some)):
            if taken.isdisjoint(some):
                taken.update(some)
                chosen.append(some)
        return chosen

    def _about(self, v: int, failed: set[Vertices]) -> Vertices | None:
        """The first determined vertices among those about one of the front; what entries tie most comes next."""
        own = [v]
        while len(own) <= 24:
            some = tuple(sorted(own))
            if len(self.within(some)) > 2:
                some = self._held(some)
                if some and some not in failed:
                    return some
            tied = defaultdict[int, float](float)
            for e in {e for w in own for e in self.entries[w]}:
                tied.update({w: 0.0 for w in self.vertices[e] if w not in own})
            if not tied:
                break
            for w in tied:
                tied[w] = sum(0.1 ** len(set(self.vertices[e]).difference(own, [w])) for e in self.entries[w])
            own.append(max(tied, key=lambda w: (tied[w], -w)))
        return None

    def _held(self, some: Vertices) -> Vertices:
        """Those of some vertices that entries which depend on no others determine and check."""
        while some and (entries := self.within(some)):
            which = held(self.stencil[:, entries], self.gradient[:, entries], some)
            if which == some:
                return some
            some = which
        return ()


def held(stencil: NDArray, gradient: NDArray, some: Vertices) -> Vertices:
    """Those of some vertices that entries of these stencils (4, e) determine and check where all others are known."""
    vertices, count = np.array(some), stencil.shape[1]
    place = np.searchsorted(vertices, stencil).clip(max=len(some) - 1)
    own = np.where(vertices[place] == stencil, gradient, 0)
    jacobian = np.zeros((count, len(some)), dtype=np.complex128)
    np.add.at(jacobian, (np.tile(np.arange(count), 4), place.ravel()), own.ravel())
    rows = np.stack([jacobian.real, -jacobian.imag], axis=-1).reshape(count, -1)
    rows /= np.linalg.norm(rows, axis=0) + np.finfo(float).tiny
    if not np.isfinite(rows).all():
        return ()
    left, size, _ = np.linalg.svd(rows)
    checked = np.abs(left[:, (size > 1e-5).sum() :]).max(axis=1, initial=0.0) > 1e-6
    _, size, right = np.linalg.svd(rows[checked])
    moves = np.abs(right[(size > 1e-5).sum() :]).max(axis=0, initial=0.0)
    return tuple(vertices[moves.reshape(-1, 2).max(axis=1) < 1e-6].tolist())


def _fitted(
    problem: WholeEntries, start: NDArray, scale: NDArray, known: NDArray[np.bool_], ties: _Ties, sets: list[Vertices]
) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """Positions, with those of sets that fit, and the vertices (n,) that are known then."""
    piece, z, known = problem.piece, start.copy(), known.copy()
    entries = {some: ties.within(some) for some in sets}
    free, used = np.zeros(len(z), dtype=bool), np.zeros(len(piece.edges), dtype=bool)
    free[np.concatenate(sets)] = True
    used[np.concatenate(list(entries.values()))] = True
    with np.errstate(all="ignore"):  # those that fit nowhere may be led far away
        there = fit_near(problem, start, scale, used, free, ((1e-3, 5), (0.0, 20)))
        fits = np.abs(problem.misfits(there, scale)) <= CERTIFIED * weight_roundings(piece, there)
        gradient, area = problem.gradient(there, scale), areas(piece, there)
    folded = np.zeros(len(z), dtype=bool)
    folded[piece.triangles[(known | free)[piece.triangles].all(axis=1) & ~(area > 0)]] = True
    for some, own in entries.items():
        if fits[own].all() and not folded[list(some)].any():
            chosen = list(held(piece.stencil[:, own], gradient[:, own], some))
            z[chosen], known[chosen] = there[chosen], True
    return z, known
