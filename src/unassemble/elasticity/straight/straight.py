"""Pieces that the identities leave bent, made straight by what their elements say.

Where a homogeneous body is held all around, no boundary term is left that would fix the axes: the identities have more
solutions than translations and scale. With the boundary terms known to vanish, inside, they are scalar equations, the
same for each coordinate, whose solutions are the affine functions. Any d of these are an affine picture y of the points
x. But the matrix knows the metric, which the elements tell.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ...linalg import svd
from ...nodes.nodal import NodalMatrix, determined
from ...nodes.shape import in_gauge, set_aside
from ...recovery import Evidence
from ...tolerances import ALIKE, SINGULAR
from ..nullspace.atlas import null_fields
from ..nullspace.placing import Solution, pieces_of
from .frame import frame


class Straight(NamedTuple):
    """A piece whose axes elements told: points (n, d), NaN elsewhere; lambda / mu; what the identities alone say."""

    points: NDArray[np.float64]
    ratio: float
    evidence: Evidence


def straightened(nodal: NodalMatrix, found: Solution | None, valid: NDArray[np.bool_]) -> Solution | None:
    """The solution, None where identities determine nothing, with bent pieces straight where elements explain them."""
    whole = valid.all(axis=(1, 2))
    if found is not None:  # pieces of which more than translation and scale is free
        whole &= np.isin(found.component, [piece for piece, freedom in enumerate(found.freedoms) if freedom])
    inside = valid & whole.reshape(-1, 1, 1)
    straight = list(_straight(nodal, inside)) if inside.any() else []
    return in_place(found, valid, straight) if straight else found


def _straight(nodal: NodalMatrix, inside: NDArray[np.bool_]) -> Iterator[Straight]:
    """Pieces that rows inside, (n, d, d) bool, hold together, and of which elements tell the axes."""
    component, n_pieces = pieces_of(nodal, inside)
    graph = nodal.graph
    for piece in range(n_pieces):
        body = np.flatnonzero(component == piece)
        null = null_fields(nodal, inside, body, terms=np.empty((nodal.dim,) * 3 + (0,)))
        exact = null.values <= SINGULAR
        if not len(exact) or exact[-1] or exact.sum() <= nodal.dim:
            continue
        if (shown := _picture(null.fields[..., exact])) is None:
            continue
        held, picture, fields = shown
        points = np.full((nodal.n, nodal.dim), np.nan)
        points[null.nodes[held]] = picture
        if (told := frame(nodal, points)) is None:
            continue
        matrix, ratio = told
        here = determined(points)
        points[here] = in_gauge(points[here] @ matrix.T, graph[here][:, here])
        residual, gap = map(float, null.values[[nodal.dim, exact.sum()]])
        yield Straight(points, ratio, Evidence(fields, residual, gap, null.rows))


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


def in_place(found: Solution | None, valid: NDArray[np.bool_], straight: list[Straight]) -> Solution:
    """Straight pieces, one at least, in place of the bent ones that they are part of."""
    base = found or Solution(valid, np.empty(0, np.int64), np.empty(0), (), (), exact=True, warnings=())
    better = {int(base.component[determined(one.points)].max()) for one in straight} if found else set()
    parts = [
        (base.component == k, base.points, *of_piece)
        for k, of_piece in enumerate(zip(base.evidence, base.freedoms, strict=True))
        if k not in better
    ]
    parts += [(determined(one.points), one.points, one.evidence, "") for one in straight]
    component, points = np.full(len(valid), -1), np.full(straight[0].points.shape, np.nan)
    for k, (here, x, _, _) in enumerate(parts):
        component[here], points[here] = k, x[here]
    _, _, evidence, freedoms = zip(*parts, strict=True)
    ratios = tuple(one.ratio for one in straight)
    return replace(base, component=component, points=points, evidence=evidence, freedoms=freedoms, straight=ratios)
