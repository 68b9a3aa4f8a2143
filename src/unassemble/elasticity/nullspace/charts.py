"""Charts: the positions that the identities of a few neighbouring nodes allow.

The identities behave like a differential operator of fourth order, so that one factorisation of the whole body is dear
in space and ill-conditioned, while an iteration needs many steps. But they are local, and so is their answer: the rows
of some two thousand neighbouring nodes determine the positions of all nodes they touch, up to few freedoms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import Factorisation, UpperTriangle, nearly_singular, svd
from ...linalg.definite import STEPS
from ...nodes.nodal import NodalMatrix
from ...nodes.shape import MOST_FIELDS
from ...tolerances import ALIKE, LITTLE, SMALL
from .identities import Identities, identities


@dataclass(frozen=True, eq=False)
class Fields:
    """Fields on some nodes that fit the identities of some rows best."""

    nodes: NDArray[np.int64]  # that some valid identity touches
    fields: NDArray[np.float64]  # (n, d, k) orthonormal
    values: NDArray[np.float64]  # singular values, increasing: norms of residuals; of several charts some upper bounds
    rows: int  # nodes whose identities were used
    charts: int = 1


def chart(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    rows: NDArray[np.int64],
    terms: NDArray[np.float64] | None,
    *,
    whole: bool,
) -> Fields:
    """Compute the least singular fields of the identities of some rows; see :func:`.identities.identities`.

    If these are not the `whole` body's, fields are added until the rest is stiff, so that the charts together hold
    every field of the body that fits.
    """
    local = identities(nodal, valid, rows, terms)
    own = len(local.rows)
    if own and not whole:
        local = _supported(local, nodal, valid, terms)
    n, d = len(local.columns), local.dim
    if not n:
        return Fields(local.columns, np.empty((0, d, 0)), np.empty(0), 0)
    count = min(4 * d, n * d)
    with nearly_singular(UpperTriangle.of(local.normal_matrix())) as solver:
        while True:
            fields, values = _least_fields(local, solver, count)
            if count == n * d or count >= MOST_FIELDS or values[-1] > (ALIKE if whole else SMALL):
                break
            count = min(2 * count, n * d)
        if not whole:
            keep = values < LITTLE
            fields, values = fields[..., keep], values[keep]
        fields, values = _refined(local, solver, fields, values)
    return Fields(local.columns, fields, values, own)


def _supported(
    local: Identities, nodal: NodalMatrix, valid: NDArray[np.bool_], terms: NDArray[np.float64] | None
) -> Identities:
    """The identities, and those of the neighbours of rows at the rim that have too few to place what they touch.

    Each node takes d equations, which the rows that touch it share. A row with many neighbours that no other row of the
    chart touches leaves most of these free to move, each by itself. Neighbours that are short of equations, too, would
    only add to that.
    """
    short = _short(local)
    if not short.any():
        return local
    near = np.unique(nodal.graph[local.rows[short]].indices)
    more = identities(nodal, valid, np.union1d(local.rows, near), terms)
    kept = ~_short(more) | np.isin(more.rows, local.rows)
    return more if kept.all() else identities(nodal, valid, more.rows[kept], terms)


def _short(local: Identities) -> NDArray[np.bool_]:
    """(m,) rows with fewer equations than their share of what the nodes take that they touch."""
    touching = np.bincount(local.indices, minlength=len(local.columns))
    return np.asarray(np.add.reduceat(local.dim / touching[local.indices], local.indptr[:-1]) > local.equations)


def _least_fields(local: Identities, solver: Factorisation, count: int) -> tuple[NDArray, NDArray]:
    """Inverse iteration on a block of fields, then Rayleigh-Ritz on squares: values to half the digits."""
    n, d = len(local.columns), local.dim
    x = np.random.default_rng(0).standard_normal((n * d, count))
    for _ in range(STEPS):
        x = np.linalg.qr(solver.solve(x))[0]
    residual = local.residual(x.reshape(n, d, -1)).reshape(-1, count)
    squares, v = scipy.linalg.eigh(residual.T @ residual)
    return (x @ v).reshape(n, d, -1), np.sqrt(np.maximum(squares, 0))


def _refined(local: Identities, solver: Factorisation, fields: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """One step of inverse iteration in correction form: its error is that of the residual, not of the factor.

    Fields are rotated to singular ones by residuals, not by their squares, which keeps all digits.
    """
    n, d, k = fields.shape
    null = values < ALIKE
    if null.any():
        gradient = local.gradient(local.residual(fields[..., null]))
        fields = fields.copy()
        fields[..., null] -= solver.solve(gradient.reshape(n * d, -1)).reshape(n, d, -1)
        fields = np.linalg.qr(fields.reshape(n * d, k))[0].reshape(n, d, k)
    _, values, v = svd(np.linalg.qr(local.residual(fields).reshape(-1, k), mode="r"))
    values = np.concatenate([values, np.zeros(k - len(values))])
    return (fields.reshape(n * d, k) @ v[::-1].T).reshape(n, d, k), values[::-1]


def patches(graph: sp.csr_array, size: int) -> list[NDArray[np.int64]]:
    """Cut a graph into halves of so many nodes at most, again and again, by breadth-first distance from one end."""
    done: list[NDArray[np.int64]] = []
    open_: list[NDArray[np.int64]] = [np.arange(graph.shape[0])]
    breadth_first = sp.csgraph.breadth_first_order
    while open_:
        nodes = open_.pop()
        if len(nodes) <= size:
            done.append(nodes)
            continue
        sub = graph[nodes][:, nodes]
        order = breadth_first(sub, 0, directed=False, return_predecessors=False)
        order = breadth_first(sub, order[-1], directed=False, return_predecessors=False)
        order = np.concatenate([order, np.setdiff1d(np.arange(len(nodes)), order)])  # further components follow
        half = len(order) // 2
        open_ += [nodes[np.sort(order[half:])], nodes[np.sort(order[:half])]]
    return done
