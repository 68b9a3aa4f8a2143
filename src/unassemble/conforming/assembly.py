"""Entries of a mesh as a function of its positions, by quadrature, with their derivative.

With gradients of the shape functions as complex numbers g, an entry is K_ab = sum_q w_q det J Re(conj(g_a) g_b). When
a node l moves by d, the gradients and the determinant change so that

    dK_ab = -Re( d sum_q w_q det J g_l conj(g_a g_b) ).

Moves that are holomorphic in a cell, sum_l d_l g_l = 0, change nothing: they are locally similarities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.kinds import Kind
from ..elements.reference import Rule, shape_gradients
from .parts import Part

_AT_ONCE = 40_000  # cells


class Entries:
    """Weights w = -K of all pairs of a part, for positions of its nodes, or of its corners where it is straight.

    A :class:`~unassemble.planar.polish.Model`.

    Parameters
    ----------
    part : Part
    rules : mapping of Kind to Rule
    straight : bool
        Whether positions are those of corners, from which all nodes follow.
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
        """(e,) -K_ab of the part's edges."""
        return self._summed(z, lambda g, volume: -_weighted(volume, _pairs(np.conj(g), g).real))

    def roundings(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) size of the rounding errors of assembled entries, in units of the machine precision."""
        return self._summed(z, lambda g, volume: _weighted(volume, _pairs(np.abs(g), np.abs(g))))

    def flipped(self, z: NDArray) -> int:
        """Cells that are not right side out at some point of the quadrature."""
        return sum(int((volume <= 0).any(axis=1).sum()) for b in self._blocks for _, _, volume in b.at(self.nodes(z)))

    def jacobian(self, z: NDArray, spread: NDArray) -> EntriesJacobian:
        """The derivative at z."""
        return EntriesJacobian(self._blocks, self.nodes(z), self.n, spread)

    def _summed(self, z: NDArray, of_pairs: Callable[[NDArray, NDArray], NDArray]) -> NDArray[np.float64]:
        z, total = self.nodes(z), np.zeros(len(self._part.edges))
        for block in self._blocks:
            for some, g, volume in block.at(z):
                total += np.bincount(block.places[some].ravel(), of_pairs(g, volume).ravel(), len(total))
        return total


class _Block:
    """Cells of one kind with their quadrature."""

    def __init__(self, part: Part, kind: Kind, cells: NDArray[np.int64], rule: Rule, straight: bool):
        self.cells, self.places = cells, part.places(cells)
        self.moved = cells[:, : kind.corners] if straight else cells
        self._slopes, self._weights = shape_gradients(kind, rule[0]), rule[1]
        self.local = np.eye(kind.nodes)
        if straight:
            self.local = np.zeros((kind.nodes, kind.corners))
            self.local[: kind.corners] = np.eye(kind.corners)
            for k, some in enumerate(kind.between, kind.corners):
                np.add.at(self.local[k], list(some), 1 / len(some))

    def at(self, z: NDArray) -> Iterator[tuple[slice, NDArray, NDArray]]:
        """Some cells at a time: which, gradients (m, q, k) complex, and weights times det J (m, q)."""
        for first in range(0, len(self.cells), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            corner = z[self.cells[some]]
            s, t = (corner @ self._slopes[:, :, r].T for r in (0, 1))
            determinant = (np.conj(s) * t).imag
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = -1j / determinant
            g = (inverse * t)[..., None] * self._slopes[:, :, 0] - (inverse * s)[..., None] * self._slopes[:, :, 1]
            yield some, g, determinant * self._weights


class EntriesJacobian:
    """dw / d(x, y); a :class:`~unassemble.planar.normal.Jacobian`."""

    def __init__(self, blocks: list[_Block], z: NDArray, n: int, spread: NDArray):
        self._blocks, self._z, self.n, self.spread = blocks, z, n, spread

    @property
    def matrix(self) -> sp.bsr_array:
        """(e, 2 n) in blocks of x and y."""
        total = sp.csr_array((len(self.spread), self.n), dtype=np.complex128)
        for block in self._blocks:
            rows, columns, values = [], [], []
            for some, g, volume in block.at(self._z):
                pairs = np.conj(_pairs(g, g)) * volume[..., None]
                value = pairs.transpose(0, 2, 1) @ (g @ block.local)
                row = np.broadcast_to(block.places[some][:, :, None], value.shape)
                rows.append(row.astype(np.int32).ravel())
                columns.append(np.broadcast_to(block.moved[some][:, None], value.shape).astype(np.int32).ravel())
                values.append((value / self.spread[row]).ravel())
            place = np.concatenate(rows), np.concatenate(columns)
            total = total + sp.coo_array((np.concatenate(values), place), shape=total.shape).tocsr()
        blocks = np.stack([total.data.real, -total.data.imag], axis=-1)[:, None]
        return sp.bsr_array((blocks, total.indices, total.indptr), shape=(total.shape[0], 2 * self.n))

    def forward(self, displacement: NDArray) -> NDArray:
        """J d for d (n,) complex: (e,) real."""
        total = np.zeros(len(self.spread))
        for block in self._blocks:
            for some, g, volume in block.at(self._z):
                stretch = np.einsum("mqk,mk->mq", g @ block.local, displacement[block.moved[some]]) * volume
                change = np.einsum("mqp,mq->mp", np.conj(_pairs(g, g)), stretch).real
                total += np.bincount(block.places[some].ravel(), change.ravel(), len(total))
        return total / self.spread

    def transpose(self, change: NDArray) -> NDArray:
        """J' r for r (e,) real: (n,) complex, x in the real part and y in the imaginary one."""
        result = np.zeros(self.n, dtype=np.complex128)
        change = change / self.spread
        for block in self._blocks:
            for some, g, volume in block.at(self._z):
                pull = np.einsum("mqp,mp->mq", _pairs(g, g), change[block.places[some]]) * volume
                force = np.einsum("mqk,mq->mk", np.conj(g @ block.local), pull).ravel()
                moved = block.moved[some].ravel()
                result.real += np.bincount(moved, force.real, self.n)
                result.imag += np.bincount(moved, force.imag, self.n)
        return result


def _pairs(first: NDArray, second: NDArray) -> NDArray:
    """(m, q, p) products of values (m, q, k) of all pairs."""
    a, b = np.triu_indices(first.shape[2], 1)
    return first[..., a] * second[..., b]


def _weighted(volume: NDArray, values: NDArray) -> NDArray:
    """(m, p) sums over the points of a quadrature."""
    return np.einsum("mq,mqp->mp", volume, values)
