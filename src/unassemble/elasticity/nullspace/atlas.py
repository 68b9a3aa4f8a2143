"""The atlas: charts joined where they overlap into fields on the whole body.

The identities behave like a differential operator of fourth order, so that one factorisation of the whole body is dear
in space and ill-conditioned, while an iteration needs many steps. But they are local, and so is their answer: the rows
of some two thousand neighbouring nodes, a chart, determine the positions of all nodes they touch, up to few freedoms.

Neighbouring charts share two layers of nodes and more. Coefficients c_P of the fields Z_P are wanted for which the
charts agree there and the residual of every chart is least:

    minimise  sum over P of |S_P c_P|^2  +  sum over nodes j and charts P of |Z_P(j) c_P - mean over the charts of j|^2

over |c| = 1. This has a few unknowns per chart and is well conditioned: the charts' own conditioning is behind us.
Exact null fields of the body are exactly those of value zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import UpperTriangle, nearly_singular
from ...nodes.nodal import NodalMatrix
from ...nodes.shape import least_fields, singular
from ...tolerances import ALIKE, LITTLE, SMALL
from .identities import Identities, identities

PATCH = {2: 6000, 3: 1900}  # rows per chart: larger ones cost more to factorise, smaller ones overlap more
_MOST = 64  # fields of the whole body to look for, at most
_LEAST = 8

Of = Callable[[NDArray[np.int64]], Identities]  # those of some rows


def null_fields(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    body: NDArray[np.int64],
    *,
    patch: int | None = None,
    terms: NDArray[np.float64] | None = None,
) -> Fields:
    """Least singular fields of all valid identities of a body's nodes, (m,), by charts of no more rows than `patch`."""
    of: Of = partial(identities, nodal, valid, terms=terms)
    size, graph = patch or PATCH[nodal.dim], nodal.graph
    parts = _patches(graph, body, size) if len(body) > 1.5 * size else [body]
    made = [_chart(of, graph, rows, whole=len(parts) == 1) for rows in parts]
    made = [one for one in made if len(one.nodes)] or made[:1]
    if len(made) == 1:
        return made[0]
    nodes, fields = _joined(made, nodal.n)
    d, k = fields.shape[1:]
    place, triangle = np.full(nodal.n, -1), np.zeros((0, k))
    place[nodes] = np.arange(len(nodes))
    for part in parts:  # Rayleigh-Ritz on the whole body, part by part
        local = of(part)
        residual = local.residual(fields[place[local.columns]]).reshape(-1, k)
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, np.linalg.qr(residual, mode="r")]), mode="r"))
    flat, values = singular(triangle, fields.reshape(-1, k))
    return Fields(nodes, flat.reshape(-1, d, k), values, sum(one.rows for one in made), len(made))


def _joined(charts: list[Fields], n: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Nodes of the charts, and orthonormal fields on them whose charts agree best."""
    nodes, d = np.concatenate([one.nodes for one in charts]), charts[0].fields.shape[1]
    copies = np.bincount(nodes, minlength=n).astype(float)
    which = np.repeat(np.arange(len(charts)), [len(one.nodes) for one in charts])
    shares = sp.csr_array((np.ones(len(nodes)), (which, nodes)), shape=(len(charts), n))
    end = np.cumsum([len(one.values) for one in charts]).tolist()
    place = [slice(last - len(one.values), last) for one, last in zip(charts, end, strict=True)]
    form = np.diag(1 + np.concatenate([one.values**2 for one in charts]))
    for k, m in np.column_stack(sp.triu(shares @ shares.T).nonzero()).tolist():
        shared, mine, others = np.intersect1d(charts[k].nodes, charts[m].nodes, assume_unique=True, return_indices=True)
        left = (charts[k].fields[mine] / copies[shared, None, None]).reshape(-1, len(charts[k].values))
        product = left.T @ charts[m].fields[others].reshape(-1, len(charts[m].values))
        form[place[k], place[m]] -= product
        if k != m:
            form[place[m], place[k]] -= product.T
    copies = np.maximum(copies, 1)

    def met(coefficients: NDArray) -> NDArray:
        """(n, d, k) the mean of the charts."""
        fields = np.zeros((n, d, coefficients.shape[1]))
        for one, here in zip(charts, place, strict=True):
            fields[one.nodes] += one.fields @ coefficients[here]
        return fields / copies[:, None, None]

    def gradient(coefficients: NDArray) -> NDArray:
        """The form times coefficients, from differences of the charts: those next to nothing keep their digits."""
        mean, found = met(coefficients), np.empty_like(coefficients)
        for one, here in zip(charts, place, strict=True):
            apart = one.fields @ coefficients[here] - mean[one.nodes]
            found[here] = one.values[:, None] ** 2 * coefficients[here] + np.einsum("ndk,ndl->kl", one.fields, apart)
        return found

    nodes = np.unique(nodes)
    mean = met(_lowest(form, min(_MOST, len(form)), gradient))[nodes]
    flat = np.linalg.qr(mean.reshape(len(nodes) * d, -1))[0]
    return nodes, flat.reshape(len(nodes), d, -1)


def _lowest(form: NDArray, count: int, gradient: Callable[[NDArray], NDArray]) -> NDArray:
    """Eigenvectors of the least eigenvalues of a positive semidefinite form, by inverse iteration.

    Soft fields have the squares of their singular values as eigenvalues, beside which rounding of the form is not
    small: null vectors are mixed with them. `gradient` is the form times vectors, without that rounding.
    """
    factor = scipy.linalg.cho_factor(form + 1e-13 * np.eye(len(form)))
    x = np.random.default_rng(0).standard_normal((len(form), count))
    for _ in range(4):
        x = np.linalg.qr(scipy.linalg.cho_solve(factor, x))[0]
    values, v = scipy.linalg.eigh(x.T @ form @ x)
    x = x @ v
    null = values < ALIKE**2
    for _ in range(2):  # the error is then that of the gradient, not of the factor
        x[:, null] -= scipy.linalg.cho_solve(factor, gradient(x[:, null]))
    # The stiff rest says nothing but where it begins.
    return np.asarray(x[:, : max(int((values < ALIKE).sum()) + 1, min(_LEAST, count))])


@dataclass(frozen=True, eq=False)
class Fields:
    """Fields on some nodes that fit the identities of some rows best."""

    nodes: NDArray[np.int64]  # that some valid identity touches
    fields: NDArray[np.float64]  # (n, d, k) orthonormal
    values: NDArray[np.float64]  # singular values, increasing: norms of residuals; of several charts some upper bounds
    rows: int  # nodes whose identities were used
    charts: int = 1


def _chart(of: Of, graph: sp.csr_array, rows: NDArray[np.int64], *, whole: bool) -> Fields:
    """Compute the least singular fields of the identities of some rows, by themselves and in a graph of nodes.

    If these are not the `whole` body's, fields are added until the rest is stiff, so that the charts together hold
    every field of the body that fits.
    """
    local = of(rows)
    own = len(local.rows)
    if own and not whole:
        local = _supported(local, of, graph)
    n, d = len(local.columns), local.dim
    if not n:
        return Fields(local.columns, np.empty((0, d, 0)), np.empty(0), 0)
    with nearly_singular(UpperTriangle.of(local.normal_matrix())) as solver:
        flat, values = least_fields(partial(_residuals, local), solver, n * d, d, ALIKE if whole else SMALL)
        if not whole:
            flat, values = flat[:, values < LITTLE], values[values < LITTLE]
        # One step in correction form: its error is that of the residual, not of the factor.
        null = values < ALIKE
        if null.any():
            gradient = local.gradient(local.residual(flat[:, null].reshape(n, d, -1)))
            flat[:, null] -= solver.solve(gradient.reshape(n * d, -1))
            flat = np.linalg.qr(flat)[0]
        flat, values = singular(_residuals(local, flat), flat)
    return Fields(local.columns, flat.reshape(n, d, -1), values, own)


def _residuals(local: Identities, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, k) residuals of fields (n d, k)."""
    return local.residual(x.reshape(len(local.columns), local.dim, -1)).reshape(-1, x.shape[1])


def _supported(local: Identities, of: Of, graph: sp.csr_array) -> Identities:
    """The identities, and those of the neighbours of rows at the rim that have too few to place what they touch.

    Each node takes d equations, which the rows that touch it share. A row with many neighbours that no other row of the
    chart touches leaves most of these free to move, each by itself. Neighbours that are short of equations, too, would
    only add to that.
    """
    short = _short(local)
    if not short.any():
        return local
    near = np.unique(graph[local.rows[short]].indices)
    more = of(np.union1d(local.rows, near))
    kept = ~_short(more) | np.isin(more.rows, local.rows)
    return more if kept.all() else of(more.rows[kept])


def _short(local: Identities) -> NDArray[np.bool_]:
    """(m,) rows with fewer equations than their share of what the nodes take that they touch."""
    touching = np.bincount(local.indices, minlength=len(local.columns))
    return np.asarray(np.add.reduceat(local.dim / touching[local.indices], local.indptr[:-1]) > local.equations)


def _patches(graph: sp.csr_array, nodes: NDArray[np.int64], size: int) -> list[NDArray[np.int64]]:
    """Cut nodes of a graph into halves, as they follow each other from one end, until they are so many at most."""
    if len(nodes) <= size:
        return [nodes]
    order = sp.csgraph.reverse_cuthill_mckee(graph[nodes][:, nodes], symmetric_mode=True)
    halves = np.array_split(order, 2)
    return [part for half in halves for part in _patches(graph, nodes[np.sort(half)], size)]
