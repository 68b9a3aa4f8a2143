"""The certificate of meshes of any planar element: shape functions, quadrature and assembly of its own.

Knows nothing of how the mesh was found, and imports no solver.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import roots_legendre

from .budget import AT_ONCE
from .certify import Certificate, Terms, compared

_CELLS = AT_ONCE // 100  # whose products have about a hundred numbers each

# Orbits (weight, repeated barycentric coordinate), weights adding up to 1 over all points: Dunavant, "High degree
# efficient symmetrical Gaussian quadrature rules for the triangle", IJNME 21, 1985.
_TRIANGLE_RULES: dict[str, tuple[tuple[float, float], ...]] = {
    "degree 2": ((1 / 3, 1 / 6),),
    "degree 4": (
        (0.22338158967801146569500700843312, 0.44594849091596488631832925388305),
        (0.10995174365532186763832632490021, 0.09157621350977074345957146340220),
    ),
    "degree 5": (
        (0.225, 1 / 3),
        (0.12593918054482715259568394550018, 0.10128650732345633880098736191512),
        (0.13239415278850618073764938783315, 0.47014206410511508977044120951345),
    ),
}


def certify_elements(
    edges: NDArray,
    entries: NDArray,
    points: NDArray,
    blocks: Mapping[str, NDArray],
    factors: Mapping[str, NDArray],
    rules: Mapping[str, str],
    terms: Terms | None = None,
) -> Certificate:
    """Re-assemble factor * Laplacian with isoparametric elements and compare off-diagonal entries.

    With further terms the diagonal as well.

    Parameters
    ----------
    edges : (e, 2) int64
        Pairs i < j of the matrix.
    entries : (e,) float64
        A_ij.
    points : (n, 2) float64
    blocks : mapping of str to (m, k) int64
        Cells by meshio's names and in its order.
    factors : mapping of str to (m,) float64
        The factor c of each cell's piece.
    rules : mapping of str to str
        Quadrature: ``"n x n Gauss"`` for quadrilaterals; ``"degree 2"``, ``"degree 4"`` or ``"degree 5"`` for
        triangles.
    terms : Terms, optional
        Not lumped.

    Returns
    -------
    Certificate
        Cells are flipped that are not right side out in each corner and at each point of the quadrature; they count
        through all kinds.
    """
    n = len(points)
    keys, values, flipped, first = [], [], [], 0
    for name, cells in blocks.items():
        base = "triangle" if name.startswith("triangle") else "quad"
        at, weights = _triangle_rule(rules[name]) if base == "triangle" else _gauss_rule(int(rules[name].split()[0]))
        vertex = np.array([(0, 0), (1, 0), (0, 1)] if base == "triangle" else [(-1, -1), (1, -1), (1, 1), (-1, 1)])
        (phi_s, phi_t), (corner_s, corner_t) = _slopes(name, at), _slopes(name, vertex)
        a, b = np.triu_indices(cells.shape[1], 1 if terms is None else 0)
        for start in range(0, len(cells), _CELLS):
            some = cells[start : start + _CELLS]
            x, y = (points[some] - points[some[:, :1]]).transpose(2, 0, 1)  # digits of differences, not of coordinates
            xs, ys, xt, yt = x @ phi_s.T, y @ phi_s.T, x @ phi_t.T, y @ phi_t.T
            determinant = xs * yt - xt * ys
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a flat cell certifies nothing
                scaled = weights / np.abs(determinant)
                ss, st, tt = scaled * (xt**2 + yt**2), scaled * (xs * xt + ys * yt), scaled * (xs**2 + ys**2)
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
                value += terms.reaction * _masses(name, x, y)
            values.append(value.ravel())
        first += len(cells)
    key = np.concatenate(keys)
    summed = sp.coo_array((np.concatenate(values), (key // n, key % n)), shape=(n, n)).tocsr()
    summed.sort_indices()
    key = np.repeat(np.arange(n), np.diff(summed.indptr)) * n + summed.indices
    return compared(n, edges, entries, key, summed.data, np.concatenate(flipped), terms)


def _gauss_rule(order: int) -> tuple[NDArray, NDArray]:
    """Points (q, 2) of the square from -1 to 1, and weights."""
    x, w = roots_legendre(order)
    return np.array([(s, t) for s in x for t in x]), np.outer(w, w).ravel()


def _triangle_rule(name: str) -> tuple[NDArray, NDArray]:
    """Points (q, 2) of the unit triangle, and weights."""
    points, weights = [], []
    for weight, r in _TRIANGLE_RULES[name]:
        orbit = {(r, r), (r, 1 - 2 * r), (1 - 2 * r, r)} if abs(r - 1 / 3) > 1e-9 else {(r, r)}
        points += sorted(orbit)
        weights += [weight / 2] * len(orbit)
    return np.array(points), np.array(weights)


def _masses(name: str, x: NDArray, y: NDArray) -> NDArray:
    """(m, pairs) integrals of products of shape functions, a node's with itself among them, exact in the plane.

    By Gauss's points on a square, on triangles folded: (s, t) -> (s, (1 - s) t) on the unit square.
    """
    at, weight = _gauss_rule(5)
    if name.startswith("triangle"):
        s, t = (at.T + 1) / 2
        at, weight = np.column_stack([s, (1 - s) * t]), weight / 4 * (1 - s)
    along_s, along_t = _slopes(name, at)
    value = _values(name, *at.T)
    a, b = np.triu_indices(value.shape[1])
    determinant = (x @ along_s.T) * (y @ along_t.T) - (x @ along_t.T) * (y @ along_s.T)
    return (np.abs(determinant) * weight) @ (value[:, a] * value[:, b])


def _values(name: str, s: NDArray, t: NDArray) -> NDArray:
    """(q, k) shape functions at points of the reference cell."""
    if name.startswith("triangle"):
        u, sides = (1 - s - t, s, t), ((0, 1), (1, 2), (2, 0))
        if name == "triangle":
            value = list(u)
        elif name == "triangle6":
            value = [v * (2 * v - 1) for v in u] + [4 * u[i] * u[j] for i, j in sides]
        else:
            value = [v * (3 * v - 1) * (3 * v - 2) / 2 for v in u]
            for i, j in sides:
                value += [4.5 * u[i] * u[j] * (3 * u[i] - 1), 4.5 * u[i] * u[j] * (3 * u[j] - 1)]
            value.append(27 * u[0] * u[1] * u[2])
    elif name == "quad8":
        value = [(1 + a * s) * (1 + b * t) * (a * s + b * t - 1) / 4 for a, b in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
        value += [
            (1 - s * s) * (1 + b * t) / 2 if a == 0 else (1 + a * s) * (1 - t * t) / 2
            for a, b in [(0, -1), (1, 0), (0, 1), (-1, 0)]
        ]
    elif name == "quad":
        value = [(1 + a * s) * (1 + b * t) / 4 for a, b in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
    else:
        along = [[v * (v - 1) / 2, 1 - v * v, v * (v + 1) / 2] for v in (s, t)]
        places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
        value = [along[0][i] * along[1][j] for i, j in places]
    return np.column_stack(value)


def _slopes(name: str, at: NDArray) -> tuple[NDArray, NDArray]:
    """(q, k) derivatives of the shape functions along both reference coordinates."""
    s, t = at[:, 0].astype(float), at[:, 1].astype(float)
    one = np.ones_like(s)
    if name.startswith("triangle"):
        return _triangle_slopes(int(name[8:] or 3), (1 - s - t, s, t), ((-one, one, 0 * one), (-one, 0 * one, one)))
    if name == "quad8":
        return _serendipity_slopes(s, t)
    return _lagrange_slopes(2 if name == "quad9" else 1, s, t)


def _triangle_slopes(k: int, u: tuple[NDArray, ...], du: tuple[tuple[NDArray, ...], ...]) -> tuple[NDArray, NDArray]:
    """From barycentric coordinates u and their derivatives."""
    found = []
    for d in du:
        if k == 3:
            found.append(np.column_stack(d))
            continue
        sides = ((0, 1), (1, 2), (2, 0))
        if k == 6:  # u (2 u - 1) and 4 u v
            corner = [(4 * u[i] - 1) * d[i] for i in range(3)]
            side = [4 * (u[i] * d[j] + u[j] * d[i]) for i, j in sides]
            found.append(np.column_stack(corner + side))
            continue
        # u (3 u - 1) (3 u - 2) / 2, then 9/2 u v (3 u - 1) next to u and 9/2 u v (3 v - 1) next to v, then 27 u v w
        corner = [(27 * u[i] ** 2 - 18 * u[i] + 2) / 2 * d[i] for i in range(3)]
        side = []
        for i, j in sides:
            side.append(4.5 * ((6 * u[i] - 1) * u[j] * d[i] + u[i] * (3 * u[i] - 1) * d[j]))
            side.append(4.5 * ((6 * u[j] - 1) * u[i] * d[j] + u[j] * (3 * u[j] - 1) * d[i]))
        inside = 27 * (d[0] * u[1] * u[2] + u[0] * d[1] * u[2] + u[0] * u[1] * d[2])
        found.append(np.column_stack([*corner, *side, inside]))
    return found[0], found[1]


def _lagrange_slopes(degree: int, s: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
    """Products of Lagrange polynomials in s and t."""
    if degree == 1:
        value, slope = [lambda x: (1 - x) / 2, lambda x: (1 + x) / 2], [lambda x: 0 * x - 0.5, lambda x: 0 * x + 0.5]
        places = [(0, 0), (1, 0), (1, 1), (0, 1)]
    else:
        value = [lambda x: x * (x - 1) / 2, lambda x: 1 - x * x, lambda x: x * (x + 1) / 2]
        slope = [lambda x: x - 0.5, lambda x: -2 * x, lambda x: x + 0.5]
        places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
    return (
        np.column_stack([slope[i](s) * value[j](t) for i, j in places]),
        np.column_stack([value[i](s) * slope[j](t) for i, j in places]),
    )


def _serendipity_slopes(s: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
    """Of (1 + a s) (1 + b t) (a s + b t - 1) / 4 in corners (a, b), and of bubbles on sides."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    along_s = [a * (1 + b * t) * (2 * a * s + b * t) / 4 for a, b in corners]
    along_t = [b * (1 + a * s) * (a * s + 2 * b * t) / 4 for a, b in corners]
    for a, b in [(0, -1), (1, 0), (0, 1), (-1, 0)]:
        along_s.append(-s * (1 + b * t) if a == 0 else a * (1 - t * t) / 2)
        along_t.append(b * (1 - s * s) / 2 if a == 0 else -t * (1 + a * s))
    return np.column_stack(along_s), np.column_stack(along_t)
