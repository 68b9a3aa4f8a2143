"""Elements of elastic bodies as the certificate has them: shape functions, quadrature, stiffness of its own.

Shape functions are written down by their products, and differentiated by a complex step (Squire and Trapp, SIAM Review
40, 1998), which is exact for polynomials but for rounding. Stiffness comes from strains and stresses in Voigt's order.
"""

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.special import roots_legendre

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]

# Nodes of each kind of cell in meshio's order: the corners of which each is the middle.
_SIDES = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hexahedron": (
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
}
_INSIDE = {
    "quad9": ((0, 1, 2, 3),),
    "hexahedron27": (
        *((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
        tuple(range(8)),
    ),
}
_QUADRATIC = ("triangle6", "quad8", "quad9", "tetra10", "hexahedron20", "hexahedron27")
_RING = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_BOX = {"quad": _RING, "hexahedron": tuple((*at, z) for z in (-1, 1) for at in _RING)}

# Orbits of barycentric coordinates with the weight of each point; weights add up to one. Triangles: Strang and Fix, An
# Analysis of the Finite Element Method, 1973; Dunavant, IJNME 21, 1985. Tetrahedra: Keast, CMAME 55, 1986.
_Orbits = tuple[tuple[float, tuple[float, ...]], ...]


def _twice(r: float) -> tuple[float, float, float]:
    return (r, r, 1 - 2 * r)


def _thrice(r: float) -> tuple[float, float, float, float]:
    return (r, r, r, 1 - 3 * r)


_SIMPLEX_RULES: dict[str, tuple[_Orbits, ...]] = {
    "triangle": (((1.0, (1 / 3, 1 / 3, 1 / 3)),),),
    "tetra": (((1.0, (0.25, 0.25, 0.25, 0.25)),),),
    "triangle6": (
        (
            (0.22338158967801146569500700843312, _twice(0.44594849091596488631832925388305)),
            (0.10995174365532186763832632490021, _twice(0.09157621350977074345957146340220)),
        ),
        ((1 / 3, _twice(1 / 6)),),
        ((1 / 3, (0.5, 0.5, 0.0)),),
        (
            (0.225, (1 / 3, 1 / 3, 1 / 3)),
            (0.12593918054482715259568394550018, _twice(0.10128650732345633880098736191512)),
            (0.13239415278850618073764938783315, _twice(0.47014206410511508977044120951345)),
        ),
        ((-27 / 48, (1 / 3, 1 / 3, 1 / 3)), (25 / 48, _twice(0.2))),
    ),
    "tetra10": (
        (
            (-0.07893333333333333333, (0.25, 0.25, 0.25, 0.25)),
            (0.04573333333333333333, _thrice(1 / 14)),
            (0.14933333333333333333, (*(2 * (0.39940357616679920500,)), *(2 * (0.10059642383320079500,)))),
        ),
        ((0.25, _thrice(0.13819660112501051518)),),
        ((-0.8, (0.25, 0.25, 0.25, 0.25)), (0.45, _thrice(1 / 6))),
        (
            (0.18170206858253505484, (0.25, 0.25, 0.25, 0.25)),
            (0.03616071428571428571, _thrice(1 / 3)),
            (0.06987149451617382553, _thrice(1 / 11)),
            (0.06569484936831875603, (*(2 * (0.43344984642633570177,)), *(2 * (0.06655015357366429823,)))),
        ),
    ),
}


def base_of(name: str) -> str:
    """The linear cell on the same corners."""
    return name.rstrip("0123456789")


def dimension_of(name: str) -> int:
    """Of the space that a kind of cell fills."""
    return 2 if base_of(name) in ("triangle", "quad") else 3


def rules_of(name: str) -> Iterator[Rule]:
    """Quadrature rules in use for a kind of cell, points (q, d) and weights (q,), the usual ones first.

    Which of them integrated a matrix is not written in a mesh, and shows where geometry is not affine.
    """
    d = dimension_of(name)
    if base_of(name) in _BOX:
        for order in (3, 2, 4, 5, 6, 7) if name in _QUADRATIC else (2, 3, 4, 1):
            at, weight = roots_legendre(order)
            yield np.array(list(product(at, repeat=d))), np.array(list(product(weight, repeat=d))).prod(axis=1)
        return
    for orbits in _SIMPLEX_RULES[name]:
        places = [(w, place) for w, orbit in orbits for place in sorted(set(permutations(orbit)))]
        volume = 1 / 2 if d == 2 else 1 / 6
        yield np.array([place[1:] for _, place in places]), volume * np.array([w for w, _ in places])


def _values(name: str, at: NDArray) -> NDArray:
    """(q, k) shape functions at points (q, d), which may be complex."""
    base, d = base_of(name), at.shape[1]
    further = (*_SIDES[base], *_INSIDE.get(name, ())) if name in _QUADRATIC else ()
    if base not in _BOX:
        corner = [1 - at.sum(axis=1), *at.T]
        if name not in _QUADRATIC:
            return np.stack(corner, axis=1)
        middles = [4 * corner[a] * corner[b] for a, b in further]
        return np.stack([*(one * (2 * one - 1) for one in corner), *middles], axis=1)
    corners = np.array(_BOX[base], dtype=float)
    nodes = np.vstack([corners, *(corners[list(some)].mean(axis=0) for some in further)])
    columns = []
    for node in nodes:
        linear = [(1 + x * p) / 2 for x, p in zip(at.T, node, strict=True)]
        bubble = [1 - x * x for x in at.T]
        if name not in _QUADRATIC:
            factors = linear
        elif name in ("quad8", "hexahedron20"):  # serendipity
            factors = [bubble[a] if node[a] == 0 else linear[a] for a in range(d)]
            if node.all():
                factors = [*linear, at @ node - (d - 1)]
        else:
            factors = [bubble[a] if node[a] == 0 else linear[a] * at[:, a] * node[a] for a in range(d)]
        columns.append(np.prod(factors, axis=0))
    return np.stack(columns, axis=1)


def gradients(name: str, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, k, d) gradients of the shape functions at points (q, d) of the reference cell."""
    step = 1e-30
    d = at.shape[1]
    return np.stack([_values(name, at + 1j * step * np.eye(d)[a]).imag / step for a in range(d)], axis=2)


def stiffness(name: str, x: NDArray[np.float64], lame: NDArray[np.float64], rule: Rule) -> NDArray[np.float64]:
    """(m, k d, k d) stiffness of cells with nodes (m, k, d) and coefficients lambda and mu (m, 2), node by node.

    Strains are those of the plane, or of space; in the plane lambda is that of plane strain, or whatever a plane
    stress makes of it. A cell without volume somewhere has infinite entries, and so certifies nothing.
    """
    m, k, d = x.shape
    at, weights = rule
    local = gradients(name, at)
    moved = (x - x[:, :1]).transpose(0, 2, 1)  # digits of differences, not of coordinates
    jacobian = np.einsum("mak,qkr->mqar", moved, local, optimize=True)
    volume = np.abs(np.linalg.det(jacobian))
    flat = ~(volume > 0)
    jacobian[flat] = np.eye(d)
    volume = np.where(flat, np.inf, volume)
    space = np.einsum("qkr,mqra->mqka", local, np.linalg.inv(jacobian), optimize=True)
    shears = ((0, 1),) if d == 2 else ((1, 2), (0, 2), (0, 1))
    strain = np.zeros((m, len(weights), d + len(shears), k, d))
    for a in range(d):
        strain[:, :, a, :, a] = space[..., a]
    for row, (a, b) in enumerate(shears, d):
        strain[:, :, row, :, a] = space[..., b]
        strain[:, :, row, :, b] = space[..., a]
    strain = strain.reshape(m, len(weights), d + len(shears), k * d)
    stress = strain * np.repeat([2.0, 1.0], [d, len(shears)])[:, None] * lame[:, 1, None, None, None]
    stress[:, :, :d] += lame[:, 0, None, None, None] * strain[:, :, :d].sum(axis=2, keepdims=True)
    stress *= (volume * weights)[..., None, None]
    size = len(weights) * (d + len(shears))
    return np.asarray(strain.reshape(m, size, -1).transpose(0, 2, 1) @ stress.reshape(m, size, -1))
