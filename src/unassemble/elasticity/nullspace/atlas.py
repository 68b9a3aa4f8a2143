"""The atlas: charts joined where they overlap into fields on the whole body.

Neighbouring charts share two layers of nodes and more. Coefficients c_P of the fields Z_P are wanted for which the
charts agree there and the residual of every chart is least:

    minimise  sum over P of |S_P c_P|^2  +  sum over nodes j and charts P of |Z_P(j) c_P - mean over the charts of j|^2

over |c| = 1. This has a few unknowns per chart and is well conditioned: the charts' own conditioning is behind us.
Exact null fields of the body are exactly those of value zero.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import svd
from ...nodes.nodal import NodalMatrix
from ...tolerances import ALIKE
from .charts import Fields, chart, patches
from .identities import identities

PATCH = {2: 6000, 3: 1900}  # rows per chart: larger ones cost more to factorise, smaller ones overlap more
_MOST = 64  # fields of the whole body to look for, at most
_LEAST = 8


def null_fields(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    body: NDArray[np.int64],
    *,
    patch: int | None = None,
    terms: NDArray[np.float64] | None = None,
) -> Fields:
    """Least singular fields of all valid identities of a body's nodes, (m,), by charts of no more rows than `patch`."""
    size, graph = patch or PATCH[nodal.dim], nodal.graph
    parts = [body[part] for part in patches(graph[body][:, body], size)] if len(body) > 1.5 * size else [body]
    made = [chart(nodal, valid, rows, terms, whole=len(parts) == 1) for rows in parts]
    made = [one for one in made if len(one.nodes)] or made[:1]
    if len(made) == 1:
        return made[0]
    nodes, fields = _joined(made, nodal.n)
    d, k = fields.shape[1:]
    place, triangle = np.full(nodal.n, -1), np.zeros((0, k))
    place[nodes] = np.arange(len(nodes))
    for part in parts:  # Rayleigh-Ritz on the whole body, part by part
        local = identities(nodal, valid, part, terms)
        residual = local.residual(fields[place[local.columns]]).reshape(-1, k)
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, np.linalg.qr(residual, mode="r")]), mode="r"))
    _, values, v = svd(triangle)
    fields = (fields.reshape(-1, k) @ v[::-1].T).reshape(-1, d, k)
    return Fields(nodes, fields, values[::-1], sum(one.rows for one in made), len(made))


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
    coefficients = _lowest(form, min(_MOST, len(form)))
    fields = np.zeros((n, d, coefficients.shape[1]))
    for one, here in zip(charts, place, strict=True):
        fields[one.nodes] += one.fields @ coefficients[here]
    nodes = np.flatnonzero(copies)
    mean = fields[nodes] / copies[nodes, None, None]
    flat = np.linalg.qr(mean.reshape(len(nodes) * d, -1))[0]
    return nodes, flat.reshape(len(nodes), d, -1)


def _lowest(form: NDArray, count: int) -> NDArray:
    """Eigenvectors of the least eigenvalues of a positive semidefinite form; of large ones by inverse iteration."""
    n = len(form)
    if n <= 4 * count:
        values, v = scipy.linalg.eigh(form)
        values = values[:count]
    else:
        factor = scipy.linalg.cho_factor(form + 1e-13 * np.eye(n))
        x = np.random.default_rng(0).standard_normal((n, count))
        for _ in range(4):
            x = np.linalg.qr(scipy.linalg.cho_solve(factor, x))[0]
        values, v = scipy.linalg.eigh(x.T @ form @ x)
        v = x @ v
    # The stiff rest says nothing but where it begins.
    return np.asarray(v[:, : max(int((values < ALIKE).sum()) + 1, min(_LEAST, count))])
