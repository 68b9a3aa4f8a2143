"""The certificate of meshes of any planar element: shape functions, quadrature and assembly of its own.

Knows nothing of how the mesh was found, and imports no solver.
"""

from collections.abc import Mapping

import numpy as np
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

_CORNERS = {
    "triangle": np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
    "quad": np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]),
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

    With further terms, which are not lumped, the diagonal as well. `edges` (e, 2): pairs i < j of the matrix; `entries`
    (e,): A_ij; `points` (n, 2); `blocks`: cells (m, k) by meshio's names and in its order; `factors` (m,) of each: the
    c of each cell's piece; `rules`: quadrature, ``"n x n Gauss"`` for quadrilaterals, ``"degree 2"``, ``"degree 4"`` or
    ``"degree 5"`` for triangles. Cells are flipped that are not right side out in each corner and at each point of the
    quadrature; they count through all kinds.
    """
    n = len(points)
    keys, values, flipped, first = [], [], [], 0
    for name, cells in blocks.items():
        base = "triangle" if name.startswith("triangle") else "quad"
        at, weights = _triangle_rule(rules[name]) if base == "triangle" else _gauss_rule(int(rules[name].split()[0]))
        _, phi_s, phi_t = _functions(name, at)
        _, corner_s, corner_t = _functions(name, _CORNERS[base])
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
    places, flipped_cells = np.divmod(np.concatenate(keys), n), np.concatenate(flipped)
    return compared(n, edges, entries, places, np.concatenate(values), flipped_cells, terms)


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
    value, along_s, along_t = _functions(name, at)
    a, b = np.triu_indices(value.shape[1])
    determinant = (x @ along_s.T) * (y @ along_t.T) - (x @ along_t.T) * (y @ along_s.T)
    return (np.abs(determinant) * weight) @ (value[:, a] * value[:, b])


def _functions(name: str, at: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """(q, k) shape functions at points (q, 2) of the reference cell, and their derivatives along both coordinates.

    Polynomials that are one in their own node and zero in the others. Triangles have all monomials up to a degree,
    quadrilaterals all up to that degree in each direction, but for the highest one where no node is inside.
    """
    inside = {"triangle6": [1 / 2], "triangle10": [1 / 3, 2 / 3], "quad8": [1 / 2], "quad9": [1 / 2]}.get(name, [])
    corner = _CORNERS[name.rstrip("0123456789")]
    side = [(1 - x) * p + x * q for p, q in zip(corner, np.roll(corner, -1, axis=0), strict=True) for x in inside]
    centre = [corner.mean(axis=0)] if name in ("triangle10", "quad9") else []
    nodes, degree = np.array([*corner, *side, *centre]), len(inside) + 1
    power = [(a, b) for a in range(degree + 1) for b in range(degree + 1)]
    most = degree if len(corner) == 3 else 2 * degree - (name == "quad8")
    a, b = np.array([one for one in power if sum(one) <= most]).T
    # All coefficients are whole quarters.
    C = np.rint(4 * np.linalg.inv(nodes[:, :1] ** a * nodes[:, 1:] ** b)) / 4
    s, t = at[:, :1], at[:, 1:]
    return (
        s**a * t**b @ C,
        a * s ** np.maximum(a - 1, 0) * t**b @ C,
        b * s**a * t ** np.maximum(b - 1, 0) @ C,
    )
