"""Entries of a mesh as a function of its positions, by quadrature, with their derivative.

Let s and t be the derivatives of the position z = x + iy along the two reference coordinates, D = Im(conj(s) t) the
determinant, and p_a, r_a the derivatives of the shape functions. Their gradients are the complex numbers
g_a = -i (t p_a - s r_a) / D, and an entry is K_ab = sum_q w_q D Re(conj(g_a) g_b): the metric |t|^2, Re(conj(s) t),
|s|^2 over D times products p_a p_b, p_a r_b + r_a p_b, r_a r_b, which are the same in all cells. When a node l moves by
d, gradients and determinant change so that

    dK_ab = -Re( d sum_q w_q D g_l conj(g_a g_b) ).

Moves that are holomorphic in a cell, sum_l d_l g_l = 0, change nothing: they are locally similarities.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..elements.kinds import Kind
from ..elements.reference import Rule, shape_gradients
from ..planar.normal import Jacobian
from .parts import Part

_CELLS = AT_ONCE // 1024  # few enough for the cache: a cell has about a hundred numbers at a time


class AssembledEntries:
    """Weights w = -K of all pairs of a part, for positions of its nodes, or of its corners where it is straight.

    A :class:`~unassemble.planar.polish.Model`.

    `straight`: whether positions are those of corners, from which all nodes follow.
    """

    def __init__(self, part: Part, rules: Mapping[Kind, Rule], *, straight: bool):
        self._part = part
        self._whole = part.from_corners() if straight and part.degree > 1 else None
        self.n = part.n_corners if straight else part.n
        self._blocks = [_Block(part, kind, cells, rules[kind], straight) for kind, cells in part.blocks.items()]

    def nodes(self, z: NDArray) -> NDArray[np.complex128]:
        """Positions of all nodes."""
        return z if self._whole is None else np.asarray(self._whole @ z)

    def weights(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) -K_ab of the part's edges; not finite where a cell is flat."""
        z = self.nodes(z)
        with np.errstate(all="ignore"):
            return -_total(
                len(self._part.edges), ((b, [b.products(*at.metric) for _, at in b.parts(z)]) for b in self._blocks)
            )

    def roundings(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) size of the rounding errors of assembled entries, in units of the machine precision.

        That of terms conj(g_a) g_b before they cancel, at most the root of K_aa K_bb.
        """
        z, sizes = self.nodes(z), []
        for block in self._blocks:
            a, b = np.triu_indices(block.cells.shape[1], 1)
            with np.errstate(all="ignore"):  # flat cells
                roots = [np.sqrt(np.abs(block.squares(*at.metric))) for _, at in block.parts(z)]
                sizes.append((block, [size[:, a] * size[:, b] for size in roots]))
        return _total(len(self._part.edges), sizes)

    def areas(self, z: NDArray) -> NDArray[np.float64]:
        """Determinants of all cells at all points of the quadrature."""
        z = self.nodes(z)
        return np.concatenate([at.determinant.ravel() for block in self._blocks for _, at in block.parts(z)])

    def jacobian(self, z: NDArray, spread: NDArray) -> Jacobian:
        """dw / d(x, y) at z."""
        total, z = sp.csr_array((len(spread), self.n), dtype=np.complex128), self.nodes(z)
        for block in self._blocks:
            rows, columns, values = [], [], []
            for some, at in block.parts(z):
                squares, (along_p, along_r) = at.squares(), at.gradient()
                value = np.empty((*block.places[some].shape, block.moved.shape[1]), np.complex128)
                for k in range(value.shape[2]):
                    g = along_p * block.slopes[0][:, k] + along_r * block.slopes[1][:, k]
                    value[:, :, k].real = block.products(*(_real(g, one) for one in squares))
                    value[:, :, k].imag = block.products(*(_real(-1j * g, one) for one in squares))
                row = np.broadcast_to(block.places[some][:, :, None], value.shape)
                rows.append(row.astype(np.int32).ravel())
                columns.append(np.broadcast_to(block.moved[some][:, None], value.shape).astype(np.int32).ravel())
                values.append((value / spread[row]).ravel())
            place = np.concatenate(rows), np.concatenate(columns)
            total = total + sp.coo_array((np.concatenate(values), place), shape=total.shape).tocsr()
        data = np.stack([total.data.real, -total.data.imag], axis=-1)[:, None]
        return Jacobian(sp.bsr_array((data, total.indices, total.indptr), shape=(len(spread), 2 * self.n)))


@dataclass(frozen=True, eq=False)
class _Local:
    """Some cells at the points of a quadrature, (m, q) each: s, t, the determinant and the weights."""

    s: NDArray[np.complex128]
    t: NDArray[np.complex128]
    determinant: NDArray[np.float64]
    weights: NDArray[np.float64]

    @property
    def metric(self) -> tuple[NDArray, NDArray, NDArray]:
        """What products of derivatives of shape functions are multiplied by."""
        scaled = self.weights / self.determinant
        return scaled * _real(self.t, self.t), -scaled * _real(self.s, self.t), scaled * _real(self.s, self.s)

    def squares(self) -> tuple[NDArray, NDArray, NDArray]:
        """The same for w D g_a g_b, complex."""
        scaled = -self.weights / self.determinant
        return scaled * self.t**2, -scaled * self.s * self.t, scaled * self.s**2

    def gradient(self) -> tuple[NDArray, NDArray]:
        """What derivatives of shape functions are multiplied by in g, complex."""
        inverse = -1j / self.determinant
        return inverse * self.t, -inverse * self.s


class _Block:
    """Cells of one kind with their quadrature."""

    def __init__(self, part: Part, kind: Kind, cells: NDArray[np.int64], rule: Rule, straight: bool):
        self.cells, self.places = cells, part.places[kind]
        self.moved = cells[:, : kind.corners] if straight else cells
        self._weights = rule[1]
        self._p, self._r = np.ascontiguousarray(shape_gradients(kind, rule[0]).transpose(2, 0, 1))
        a, b = np.triu_indices(kind.nodes, 1)
        p, r = self._p, self._r
        self.pairs = p[:, a] * p[:, b], p[:, a] * r[:, b] + r[:, a] * p[:, b], r[:, a] * r[:, b]
        local = np.eye(kind.nodes)
        if straight:
            local = np.zeros((kind.nodes, kind.corners))
            local[: kind.corners] = np.eye(kind.corners)
            for k, some in enumerate(kind.between, kind.corners):
                np.add.at(local[k], list(some), 1 / len(some))
        self.slopes = p @ local, r @ local

    def parts(self, z: NDArray) -> Iterator[tuple[slice, _Local]]:
        """Some cells at a time."""
        for first in range(0, len(self.cells), _CELLS):
            some = slice(first, first + _CELLS)
            moved = z[self.moved[some]]
            moved = moved - moved[:, :1]  # digits of differences, not of coordinates
            s, t = (_matmul(moved, slopes.T) for slopes in self.slopes)
            yield some, _Local(s, t, s.real * t.imag - s.imag * t.real, self._weights)

    def products(self, first: NDArray, mixed: NDArray, last: NDArray) -> NDArray:
        """(m, pairs) sums over points, of real factors (m, q)."""
        return first @ self.pairs[0] + mixed @ self.pairs[1] + last @ self.pairs[2]

    def squares(self, first: NDArray, mixed: NDArray, last: NDArray) -> NDArray:
        """(m, k) the same for pairs of a node with itself."""
        return first @ self._p**2 + mixed @ (2 * self._p * self._r) + last @ self._r**2


def _total(n: int, sums: Iterable[tuple[_Block, list[NDArray]]]) -> NDArray[np.float64]:
    """(n,) for each edge what its pairs in cells (m, pairs) add up to."""
    total = np.zeros(n)
    for block, some in sums:
        total += np.bincount(block.places.ravel(), np.concatenate(some).ravel(), n)
    return total


def _real(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Real part of a conj(b)."""
    return np.asarray(a.real * b.real + a.imag * b.imag)


def _matmul(values: NDArray[np.complex128], factors: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Complex times real."""
    result = np.empty((len(values), factors.shape[1]), np.complex128)
    result.real, result.imag = (np.ascontiguousarray(part) @ factors for part in (values.real, values.imag))
    return result
