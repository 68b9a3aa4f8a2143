"""Planar elements as the certificate has them: shape functions and quadrature of its own."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import roots_legendre

# Orbits (weight, repeated barycentric coordinate), weights adding up to 1 over all points: Dunavant, "High degree
# efficient symmetrical Gaussian quadrature rules for the triangle", IJNME 21, 1985.
_TRIANGLE_RULES: dict[str, tuple[tuple[float, float], ...]] = {
    "degree 1": ((1.0, 1 / 3),),
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


def corners_of(name: str) -> NDArray[np.float64]:
    """(3 or 4, 2) corners of the reference cell."""
    return _CORNERS[name.rstrip("0123456789")]


def rule_of(name: str) -> tuple[NDArray, NDArray]:
    """Points (q, 2) and weights: ``"n x n Gauss"`` for quadrilaterals, ``"degree 1"``, 2, 4 or 5 for triangles."""
    if name.endswith("Gauss"):
        return _gauss_rule(int(name.split()[0]))
    points, weights = [], []
    for weight, r in _TRIANGLE_RULES[name]:
        orbit = {(r, r), (r, 1 - 2 * r), (1 - 2 * r, r)} if abs(r - 1 / 3) > 1e-9 else {(r, r)}
        points += sorted(orbit)
        weights += [weight / 2] * len(orbit)
    return np.array(points), np.array(weights)


def _gauss_rule(order: int) -> tuple[NDArray, NDArray]:
    """Points (q, 2) of the square from -1 to 1, and weights."""
    x, w = roots_legendre(order)
    return np.array([(s, t) for s in x for t in x]), np.outer(w, w).ravel()


def masses(name: str, x: NDArray, y: NDArray, *, lumped: bool) -> NDArray:
    """(m, pairs) integrals of products of shape functions, a node's with itself among them, exact in the plane.

    With `lumped` masses a node has the integral of its own, and pairs have nothing.

    By Gauss's points on a square, on triangles folded: (s, t) -> (s, (1 - s) t) on the unit square.
    """
    at, weight = _gauss_rule(5)
    if name.startswith("triangle"):
        s, t = (at.T + 1) / 2
        at, weight = np.column_stack([s, (1 - s) * t]), weight / 4 * (1 - s)
    value, along_s, along_t = functions(name, at)
    a, b = np.triu_indices(value.shape[1])
    determinant = (x @ along_s.T) * (y @ along_t.T) - (x @ along_t.T) * (y @ along_s.T)
    products = np.where(a == b, value[:, a], 0.0) if lumped else value[:, a] * value[:, b]
    return (np.abs(determinant) * weight) @ products


def functions(name: str, at: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """(q, k) shape functions at points (q, 2) of the reference cell, and their derivatives along both coordinates.

    Polynomials that are one in their own node and zero in the others. Triangles have all monomials up to a degree,
    quadrilaterals all up to that degree in each direction, but for the highest one where no node is inside.
    """
    inside = {"triangle6": [1 / 2], "triangle10": [1 / 3, 2 / 3], "quad8": [1 / 2], "quad9": [1 / 2]}.get(name, [])
    corner = corners_of(name)
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
