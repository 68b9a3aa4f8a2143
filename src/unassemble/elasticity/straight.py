"""Pieces that the identities leave bent, made straight by what their elements say.

Where a homogeneous body is held all around, no boundary term is left that would fix the axes: the identities have more
solutions than translations and scale. With the boundary terms known to vanish, inside, they are scalar equations, the
same for each coordinate, whose solutions are the affine functions. Any d of these are an affine picture y of the points
x. But the matrix knows the metric, which the elements tell.

In the picture each element is what it is in the body, so that its tables G^{ae}_ij = int d_a phi_i d_e phi_j are known;
and with x = M y, W the inverse transpose of M, and w_c its rows,

    A^{cb}_ij = |det M| (lambda w_c . G_ij w_b + mu w_b . G_ij w_c + mu delta_cb sum_k w_k . G_ij w_k).

Each block is linear in the tables, with coefficients T^{cb} that least squares find. The tables of two nodes are
symmetric where the cells around one of them are all there, so that only

    T^{cb} = kappa (w_c w_b^T + w_b w_c^T) / 2 + mu delta_cb S,     kappa = lambda + mu,     S = W^T W,

shows, up to a common factor. The sum of the T^{cc} is (kappa + d mu) S. In its metric the w_c are orthonormal, and
T^{cc} is a multiple of the identity plus one of rank one, whose direction is w_c.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..elements.candidates import Block, candidates
from ..elements.reference import rules
from ..elements.surface import contested
from ..linalg import svd
from ..nodes.nodal import NodalMatrix, determined
from ..nodes.shape import Shape, set_aside
from ..recovery import Evidence
from ..tolerances import ALIKE, CERTIFIED, SINGULAR
from .materials.cells import coupled
from .materials.entries import BlockEntries, MaterialModel, Pairs
from .nullspace.atlas import null_fields


def straight(
    nodal: NodalMatrix, valid: NDArray[np.bool_], body: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Shape] | None:
    """Nodes (k,) of a piece whose axes elements tell, and its shape, from rows of its nodes (m,) that are whole.

    What is `valid`, (n, d, d), see :func:`.nodal.valid_pairs`. None where more is free than an affine map, or no
    elements explain it.
    """
    d = nodal.dim
    inside = valid & valid.all(axis=(1, 2), keepdims=True)
    null = null_fields(nodal, inside, body, terms=np.empty((d, d, d, 0)))
    exact = null.values <= SINGULAR
    if not len(exact) or exact[-1] or exact.sum() <= d or (shown := _picture(null.fields[..., exact])) is None:
        return None
    held, picture, fields = shown
    points = np.full((nodal.n, d), np.nan)
    points[null.nodes[held]] = picture
    if (told := _frame(nodal, points)) is None:
        return None
    matrix, ratio = told
    residual, gap = map(float, null.values[[d, exact.sum()]])
    seen = Evidence(fields, residual, gap, null.rows)
    return null.nodes[held], Shape(picture @ matrix.T, seen, ratio=ratio)


def _picture(null: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64], int] | None:
    """An affine picture among fields (N, d, k) without boundary terms; None where there is more than that.

    Which nodes are held, (N,), the picture of these, (N', d), and how many of the fields they share.
    """
    d, functions = null.shape[1], _functions(null)
    held = np.ones(len(null), dtype=bool)
    if functions.shape[1] > d:  # those of nodes that can move by themselves are among them
        constant = np.full(len(null), len(null) ** -0.5)
        held = ~set_aside(np.column_stack([constant, functions])[:, None], d + 1)[1]
        functions = _functions(null[held])
    if functions.shape[1] != d:
        return None
    fields = int((scipy.linalg.svdvals(null[held].reshape(-1, null.shape[2])) > ALIKE).sum())
    return held, functions, fields


def _functions(null: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, m) orthonormal basis of all components of the fields, constants aside."""
    flat = (null - null.mean(axis=0)).reshape(len(null), -1)
    u, s, _ = svd(flat, full_matrices=False)
    return np.asarray(u[:, s > ALIKE * max(s.max(initial=0), ALIKE)])


def _frame(nodal: NodalMatrix, picture: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """The map M in x = M y for which one isotropic material explains the entries, and its lambda / mu; None if none.

    M is found up to size and a point reflection. The picture y, (n, d), is that of one piece; NaN elsewhere.
    """
    graph, entries = coupled(nodal, picture), BlockEntries.of(nodal, determined(picture))
    for blocks in candidates(graph, picture) if len(entries.key) else ():
        told = entries.explained_by([Pairs.of(one.cells, entries) for one in blocks], graph)
        if told is None or not len(told.key) or len(blocks) > 1:
            continue
        for tables, values in _tables(blocks[0], picture, told):
            tensors = _tensors(tables, values)
            if tensors is not None and (found := _isotropic(tensors)) is not None:
                return found
    return None


def _tables(block: Block, picture: NDArray, entries: BlockEntries) -> Iterator[tuple[NDArray, NDArray]]:
    """Tables G and entries of pairs of nodes, (e, d, d) each and relative to their row, for one rule after the other.

    Of the rows of some nodes that lost no neighbour, without the pairs of cells of which not all can be there.
    """
    i, j = np.divmod(entries.key, entries.n)
    nodes = np.unique([i, j])
    whole, chosen = nodes[entries.complete[nodes]], np.zeros(entries.n, dtype=bool)
    chosen[whole[np.unique(np.linspace(0, len(whole) - 1, SAMPLE).astype(int))]] = True
    some = entries.at(np.flatnonzero(chosen[i] | chosen[j]))
    block = replace(block, cells=block.cells[Pairs.of(block.cells, some).seen])
    pairs = Pairs.of(block.cells, some)
    doubtful = contested(block.kind.base, block.cells[:, : block.kind.corners])
    sure = np.ones(len(some.key), dtype=bool)
    sure[pairs.place[doubtful][pairs.there[doubtful]]] = False
    weight = 1 / some.size[sure, None, None]
    for rule in rules(block.kind):  # lambda = 1, mu = 0
        model = MaterialModel(picture, block.cells, block.kind, rule)
        tables = model.assembled(pairs, some, np.ones((len(block.cells), 1)) * [1.0, 0.0])
        yield tables[sure] * weight, some.value[sure] * weight


def _tensors(tables: NDArray, values: NDArray) -> NDArray[np.float64] | None:
    """(d, d, d, d) symmetric T^{cb} by c, b, a, e; None where none fit, or the tables do not tell them."""
    d = tables.shape[1]
    design, right = tables.reshape(-1, d * d), values.reshape(-1, d * d)
    if len(design) < d * d:
        return None
    solution, _, rank, size = scipy.linalg.lstsq(design, right, cond=ALIKE)
    if rank < d * (d + 1) // 2 or size[0] == 0 or np.abs(design @ solution - right).max() > CERTIFIED:
        return None
    t = solution.T.reshape(d, d, d, d)
    return np.asarray((t + t.swapaxes(2, 3)) / 2)


def _isotropic(tensors: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """The map to the frame in which the tensors are those of an isotropic material, and its lambda / mu; None if none.

    In the plane kappa < 0 would be the same matrix as kappa > 0 with the body turned by a right angle. Only the
    latter has positive energy.
    """
    d = len(tensors)
    tensors = tensors * np.sign(np.einsum("ccaa", tensors))
    try:
        lower = np.linalg.cholesky(np.einsum("ccae->ae", tensors))
    except np.linalg.LinAlgError:
        return None
    inverse = np.linalg.inv(lower)
    r = inverse @ tensors @ inverse.T
    value, vector = np.linalg.eigh(r[range(d), range(d)])
    mu = (1 - value[:, -1].mean()) / (d - 1)
    kappa = 1 - d * mu
    u = vector[:, :, -1]
    u[1:] *= np.sign(np.einsum("a,bae,be->b", u[0], r[0, 1:], u[1:]))[:, None]
    u = scipy.linalg.polar(u)[0]
    model = kappa / 2 * (np.einsum("ca,be->cbae", u, u) + np.einsum("ba,ce->cbae", u, u))
    model += mu * np.einsum("cb,ae->cbae", np.eye(d), np.eye(d))
    if not (mu > 0 and np.abs(r - model).max() <= CERTIFIED * kappa):
        return None
    return u @ inverse, float(kappa / mu - 1)
