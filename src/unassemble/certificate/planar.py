"""Planar meshes of any element: the operator re-assembled on the mesh as written, held against the matrix."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..budget import AT_ONCE
from .comparison import Certificate, Terms, compared
from .elements import corners_of, functions, masses, rule_of

if TYPE_CHECKING:
    from ..matrix import OperatorMatrix
    from ..recovery import PlanarMesh

_CELLS = AT_ONCE // 100  # whose products have about a hundred numbers each


def certify_mesh(
    matrix: OperatorMatrix,
    mesh: PlanarMesh,
    tensor: tuple[float, float, float] | None = None,
    terms: Terms | None = None,
) -> Certificate:
    """A planar mesh as it is written, compared with its matrix.

    Off-diagonal entries are compared or, with further `terms`, all of them; `tensor` is kxx, kxy and kyy.
    """
    blocks = mesh.cells_to_assemble
    if mesh.region is not None:
        factors = {"triangle": mesh.scale[mesh.region]}
    else:  # a vertex of several pieces has the lowest label
        factors = {kind: mesh.scale[mesh.component[cells].max(axis=1)] for kind, cells in blocks.items()}
    given = matrix.edges, matrix.entries, mesh.points
    return certify(*given, blocks, factors, rules=mesh.rules, tensor=tensor, terms=terms)


def certify(
    edges: NDArray,
    entries: NDArray,
    points: NDArray,
    blocks: Mapping[str, NDArray],
    factors: Mapping[str, NDArray],
    *,
    rules: Mapping[str, str] = MappingProxyType({"triangle": "degree 1"}),
    tensor: tuple[float, float, float] | None = None,
    terms: Terms | None = None,
) -> Certificate:
    """Re-assemble factor * div(K grad) with isoparametric elements and compare off-diagonal entries.

    With further terms the diagonal as well. `edges` (e, 2): pairs i < j of the matrix; `entries` (e,): A_ij; `points`
    (n, 2); `blocks`: cells (m, k) by meshio's names and in its order; `factors` (m,) of each: the c of each cell's
    piece; `rules`: quadrature of each, see :func:`.elements.rule_of`; `tensor`: kxx, kxy and kyy of K, the
    identity by default. Cells are flipped that are not right side out in each corner and at each point of the
    quadrature; they count through all kinds.
    """
    (kxx, kxy, kyy), n = tensor or (1.0, 0.0, 1.0), len(points)
    keys, values, flipped, first = [], [], [], 0
    for name, cells in blocks.items():
        at, weights = rule_of(rules[name])
        _, phi_s, phi_t = functions(name, at)
        _, corner_s, corner_t = functions(name, corners_of(name))
        a, b = np.triu_indices(cells.shape[1], 1 if terms is None else 0)
        for start in range(0, len(cells), _CELLS):
            some = cells[start : start + _CELLS]
            x, y = (points[some] - points[some[:, :1]]).transpose(2, 0, 1)  # digits of differences, not of coordinates
            xs, ys, xt, yt = x @ phi_s.T, y @ phi_s.T, x @ phi_t.T, y @ phi_t.T
            determinant = xs * yt - xt * ys
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a flat cell certifies nothing
                scaled = weights / np.abs(determinant)
                ss = scaled * (kxx * yt**2 - 2 * kxy * xt * yt + kyy * xt**2)
                st = scaled * (kxx * ys * yt - kxy * (xs * yt + xt * ys) + kyy * xs * xt)
                tt = scaled * (kxx * ys**2 - 2 * kxy * xs * ys + kyy * xs**2)
                value = (
                    ss @ (phi_s[:, a] * phi_s[:, b])
                    - st @ (phi_s[:, a] * phi_t[:, b] + phi_t[:, a] * phi_s[:, b])
                    + tt @ (phi_t[:, a] * phi_t[:, b])
                )
            at_corner = (x @ corner_s.T) * (y @ corner_t.T) - (x @ corner_t.T) * (y @ corner_s.T)
            right = (determinant > 0).all(axis=1) & (at_corner > 0).all(axis=1)
            flipped.append(first + start + np.flatnonzero(~right))
            keys.append((np.minimum(some[:, a], some[:, b]) * n + np.maximum(some[:, a], some[:, b])).ravel())
            value = value * factors[name][start : start + _CELLS, None]
            if terms is not None and terms.reaction:
                value += terms.reaction * masses(name, x, y, lumped=terms.lumped)
            values.append(value.ravel())
        first += len(cells)
    places = np.divmod(np.concatenate(keys), n)
    return compared(n, edges, entries, places, np.concatenate(values), np.concatenate(flipped), terms)
