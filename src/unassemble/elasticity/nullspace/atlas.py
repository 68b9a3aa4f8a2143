"""The atlas: charts joined where they overlap into fields on the whole body.

Neighbouring charts share two layers of nodes and more. Coefficients c_P of the fields Z_P are wanted for which the
charts agree
there and the residual of every chart is least:

    minimise  sum over P of |S_P c_P|^2  +  sum over nodes j and charts P of |Z_P(j) c_P - mean over the charts of j|^2

over |c| = 1. This has a few unknowns per chart and is well conditioned: the charts' own
conditioning is behind us. Exact null fields of the body are exactly those of value zero.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import svd
from ...nodes.nodal import NodalMatrix
from ...tolerances import ALIKE
from .charts import Chart, chart, patches
from .identities import identities

_log = logging.getLogger(__name__)
PATCH = {2: 6000, 3: 1900}  # rows per chart: larger ones cost more to factorise, smaller ones overlap more
_MOST = 64  # fields of the whole body to look for, at most
_LEAST = 8


@dataclass(frozen=True, eq=False)
class NullFields:
    """Fields on the nodes of a body that fit its identities best.

    Attributes
    ----------
    nodes : (n,) int64
        Nodes that some valid identity touches.
    fields : (n, d, k) float64
        Orthonormal.
    values : (k,) float64
        Singular values, increasing; fields beyond the null fields are those of the joined charts, and their values
        upper bounds.
    rows : int
        Nodes with valid identities.
    charts : int
    """

    nodes: NDArray[np.int64]
    fields: NDArray[np.float64]
    values: NDArray[np.float64]
    rows: int
    charts: int


def null_fields(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    body: NDArray[np.int64],
    *,
    patch: int | None = None,
    terms: NDArray[np.float64] | None = None,
) -> NullFields:
    """Least singular fields of all valid identities of the nodes of a body, (m,); see :func:`.identities.identities`.

    A chart has no more rows than `patch`.
    """
    parts = _patches(nodal, body, patch or PATCH[nodal.dim])
    made = [chart(nodal, valid, rows, whole=len(parts) == 1, terms=terms) for rows in parts]
    made = [one for one in made if len(one.nodes)]
    _log.debug("%d charts of %s fields", len(made), [len(one.values) for one in made])
    if not made:
        return NullFields(np.empty(0, np.int64), np.empty((0, nodal.dim, 0)), np.empty(0), 0, 0)
    if len(made) == 1:
        one = made[0]
        return NullFields(one.nodes, one.fields, one.values, one.rows, 1)
    nodes, fields = _join(made, nodal.n)
    return _measured(nodal, valid, parts, nodes, fields, made, terms)


def _patches(nodal: NodalMatrix, body: NDArray[np.int64], size: int) -> list[NDArray[np.int64]]:
    if len(body) <= 1.5 * size:
        return [body]
    graph = nodal.graph
    return [body[part] for part in patches(graph[body][:, body], size)]


def _join(charts: list[Chart], n: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Nodes of the charts, and orthonormal fields on them whose charts agree best."""
    d = charts[0].fields.shape[1]
    copies = np.zeros(n)
    for one in charts:
        copies[one.nodes] += 1
    place = _places(charts)
    form = np.diag(1 + np.concatenate([one.values**2 for one in charts]))
    for k, m in _overlapping(charts, n):
        product = _product(charts[k], charts[m], copies)
        form[place[k], place[m]] -= product
        if k != m:
            form[place[m], place[k]] -= product.T
    coefficients = _lowest(form, min(_MOST, len(form)))
    fields = np.zeros((n, d, coefficients.shape[1]))
    for one, here in zip(charts, place, strict=True):
        fields[one.nodes] += one.fields @ coefficients[here]
    nodes = np.flatnonzero(copies)
    mean = fields[nodes] / copies[nodes, None, None]
    flat = np.linalg.qr(mean.reshape(len(nodes) * d, -1))[0]
    return nodes, flat.reshape(len(nodes), d, -1)


def _places(charts: list[Chart]) -> list[slice]:
    """Which of all coefficients are each chart's."""
    end = np.cumsum([len(one.values) for one in charts])
    return [slice(int(last) - len(one.values), int(last)) for one, last in zip(charts, end, strict=True)]


def _overlapping(charts: list[Chart], n: int) -> Iterator[tuple[int, int]]:
    """Pairs of charts that share nodes, k <= m."""
    nodes = np.concatenate([one.nodes for one in charts])
    which = np.repeat(np.arange(len(charts)), [len(one.nodes) for one in charts])
    shares = sp.csr_array((np.ones(len(nodes)), (which, nodes)), shape=(len(charts), n))
    first, second = sp.triu(shares @ shares.T).nonzero()
    return zip(first.tolist(), second.tolist(), strict=True)


def _product(one: Chart, other: Chart, copies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Products of the fields of two charts over the nodes that they share, each over the number of its copies."""
    shared, mine, others = np.intersect1d(one.nodes, other.nodes, assume_unique=True, return_indices=True)
    left = (one.fields[mine] / copies[shared, None, None]).reshape(-1, len(one.values))
    return np.asarray(left.T @ other.fields[others].reshape(-1, len(other.values)))


def _lowest(form: NDArray, count: int) -> NDArray:
    """Eigenvectors of the least eigenvalues of a positive semidefinite form, by inverse iteration."""
    n = len(form)
    if n <= 4 * count:
        values, v = scipy.linalg.eigh(form)
        return np.asarray(v[:, : max(int((values[:count] < ALIKE).sum()) + 1, min(_LEAST, count))])
    factor = scipy.linalg.cho_factor(form + 1e-13 * np.eye(n))
    x = np.random.default_rng(0).standard_normal((n, count))
    for _ in range(4):
        x = np.linalg.qr(scipy.linalg.cho_solve(factor, x))[0]
    values, v = scipy.linalg.eigh(x.T @ form @ x)
    # The stiff rest says nothing but where it begins.
    kept = max(int((values < ALIKE).sum()) + 1, min(_LEAST, count))
    return np.asarray(x @ v[:, :kept])


def _measured(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    parts: list[NDArray[np.int64]],
    nodes: NDArray[np.int64],
    fields: NDArray[np.float64],
    made: list[Chart],
    terms: NDArray[np.float64] | None,
) -> NullFields:
    """Rayleigh-Ritz on the whole body, through the identities part by part."""
    d, k = fields.shape[1:]
    place = np.full(nodal.n, -1)
    place[nodes] = np.arange(len(nodes))
    triangle = np.zeros((0, k))
    for part in parts:
        local = identities(nodal, valid, part, terms)
        residual = local.residual(fields[place[local.columns]]).reshape(-1, k)
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, np.linalg.qr(residual, mode="r")]), mode="r"))
    _, values, v = svd(triangle)
    fields = (fields.reshape(-1, k) @ v[::-1].T).reshape(-1, d, k)
    return NullFields(nodes, fields, values[::-1], sum(one.rows for one in made), len(made))
