"""Affine pictures of a homogeneous piece, out of all functions that satisfy the scalar equations inside it.

With the boundary terms known to vanish, inside, the identities are scalar equations, the same for each coordinate. In
most meshes only affine functions solve them, and any d of these, with no combination constant, are a picture of the
piece. Boxes of equal or graded hexahedra have more: functions that the mass matrix along each edge takes to zero, like
r^(i + j + k), r = -2 +- sqrt(3), away from each corner. There cells tell which functions are affine: those that are so
in each of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import svd
from ..elements.candidates import Block, candidates, coupled
from ..elements.reference import reference_nodes
from ..nodal import NodalMatrix
from ..nullspace.identities import identities, no_terms
from ..nullspace.shape import EXACT, set_aside

_NONE = 1e-6  # singular value of functions that are none, beside others of norm one
_AFFINE = 1e-9  # how far functions of norm one that are affine in each cell may be from it
_ROUNDS = 3  # in which a picture that is nearly affine tells the corners of cells, and these a better one


@dataclass(frozen=True, eq=False)
class Picture:
    """An affine picture, and what else satisfies the equations.

    Attributes
    ----------
    points : (n, d) float64
        About as large in all directions; NaN elsewhere.
    functions : (n, m) float64
        A basis of all functions that satisfy the equations, constants aside; zero elsewhere.
    fields : int
        Independent fields that satisfy them.
    """

    points: NDArray[np.float64]
    functions: NDArray[np.float64]
    fields: int

    @property
    def told_by_cells(self) -> bool:
        """Whether there are others than affine functions."""
        return self.functions.shape[1] > self.points.shape[1]


def picture(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], null: NDArray[np.float64]
) -> Picture | None:
    """Find an affine picture among null fields; None where there is none, or nothing tells it from others.

    Parameters
    ----------
    nodal : NodalMatrix
    inside : (n, d, d) bool
        Rows whose boundary terms vanish in homogeneous material.
    nodes : (N,) int64
        Of the piece.
    null : (N, d, k) float64
        Orthonormal fields that satisfy its identities.
    """
    if not inside[nodes].any():
        return None
    null = _without_terms(nodal, inside, nodes, null)
    d, functions = nodal.dim, _functions(null)
    if functions.shape[1] < d:
        return None
    held, points = np.ones(len(nodes), dtype=bool), functions
    if functions.shape[1] > d:
        told = _affine_in_cells(nodal, inside, nodes, functions)
        if told is not None:
            held, functions, points = told
        else:
            _, loose = set_aside(np.column_stack([np.full(len(nodes), len(nodes) ** -0.5), functions])[:, None], d + 1)
            held = ~loose
            functions = points = _functions(null[held])
            if functions.shape[1] != d:
                return None
    fields = int((scipy.linalg.svdvals(null[held].reshape(-1, null.shape[2])) > _NONE).sum())
    shown = Picture(np.full((nodal.n, d), np.nan), np.zeros((nodal.n, functions.shape[1])), fields)
    shown.points[nodes[held]], shown.functions[nodes[held]] = points, functions
    return shown


def _without_terms(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], null: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, d, k') those of the fields without boundary terms inside."""
    n, d, k = null.shape
    place = np.full(nodal.n, -1)
    place[nodes] = np.arange(n)
    scalar = identities(nodal, inside, nodes, no_terms(d))
    residual = scalar.residual(null[place[scalar.columns]]).reshape(-1, k)
    _, values, v = svd(np.linalg.qr(residual, mode="r"))
    kept = np.concatenate([values, np.zeros(k - len(values))]) <= 10 * EXACT
    return np.asarray(null.reshape(-1, k) @ v[kept].T).reshape(n, d, -1)


def _functions(null: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, m) orthonormal basis of all components of the fields, constants aside."""
    flat = (null - null.mean(axis=0)).reshape(len(null), -1)
    u, s, _ = svd(flat, full_matrices=False)
    return np.asarray(u[:, s > _NONE * max(s.max(initial=0), _NONE)])


def _affine_in_cells(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], functions: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]] | None:
    """Which nodes belong to cells, (N,), the functions there, (N', m), and those affine in every cell, (N', d).

    To begin with, those are nearest to affine that differ least along edges, or from the mean of their neighbours.
    """
    graph = nodal.graph[nodes][:, nodes]
    i, j = sp.triu(graph, 1).nonzero()
    whole = np.asarray(inside[nodes].all(axis=(1, 2)))
    from_mean = ((sp.diags_array(graph.sum(axis=1)) - graph) @ functions)[whole]
    for away in (functions[i] - functions[j], from_mean):
        told = _improved(nodal, inside, nodes, functions, away)
        if told is not None:
            return told
    return None


def _improved(
    nodal: NodalMatrix, inside: NDArray[np.bool_], nodes: NDArray[np.int64], functions: NDArray, away: NDArray
) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]] | None:
    """The same from what functions are beside affine, (r, m): what is nearest shows cells, and these what is nearer."""
    d = nodal.dim
    held = np.ones(len(nodes), dtype=bool)
    for _ in range(_ROUNDS):
        rough = np.full((nodal.n, d), np.nan)
        rough[nodes[held]] = functions @ _least(away)[0][:, :d]
        cells = _boxes(nodal, inside, rough)
        if cells is None:
            return None
        functions = _functions(functions[np.isin(nodes[held], cells.cells)][:, None])
        held = np.isin(nodes, cells.cells)
        if functions.shape[1] <= d:
            return (held, functions, functions) if functions.shape[1] == d else None
        away = _bending(cells, nodes[held], functions)
        v, size = _least(away)
        if size[d - 1] <= _AFFINE and size[d] > _NONE:
            return held, functions, functions @ v[:, :d]
    return None


def _least(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, m) combinations of the columns of (r, m), and how large they are, increasing."""
    _, size, v = svd(np.linalg.qr(values, mode="r"))
    size = np.concatenate([size, np.zeros(values.shape[1] - len(size))])
    return v[::-1].T, size[::-1]


def _boxes(nodal: NodalMatrix, inside: NDArray[np.bool_], rough: NDArray[np.float64]) -> Block | None:
    """The cells that a picture shows, where they have more nodes than an affine map needs."""
    complete = np.asarray(inside.all(axis=(1, 2)))
    found = candidates(coupled(nodal, rough), rough, complete, linear_simplices=False)
    return next((blocks[0] for blocks in found), None)


def _bending(block: Block, nodes: NDArray[np.int64], functions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(r, m) what functions are in cells beside affine."""
    reference = reference_nodes(block.kind)
    design = np.column_stack([np.ones(len(reference)), reference])
    beside = scipy.linalg.null_space(design.T)
    values = functions[np.searchsorted(nodes, block.cells)]
    return np.einsum("ks,ekm->esm", beside, values, optimize=True).reshape(-1, functions.shape[1])
