"""Elements: shape functions, quadrature rules, and with these masses and isotropic elasticity.

An isoparametric cell maps the reference element by x(t) = sum_k x_k phi_k(t). With J = dx/dt, gradients in space are
J^-T times those in the reference element, and |det J| is the volume that goes with a weight.
"""

from collections.abc import Iterator
from functools import cache
from itertools import permutations, product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import LAST_DIGITS
from .kinds import Kind

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]


@cache
def reference_nodes(kind: Kind) -> NDArray[np.float64]:
    """(k, d) nodes of the unit simplex or the unit box, in meshio's order."""
    if kind.simplex:
        corners = np.vstack([np.zeros(kind.dim), np.eye(kind.dim)])
    else:
        ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
        corners = np.array(ring if kind.dim == 2 else [(*r, z) for z in (0, 1) for r in ring], dtype=float)
    return np.vstack([corners, *(corners[list(some)].mean(axis=0) for some in kind.between)])


@cache
def _exponents(kind: Kind) -> NDArray[np.int64]:
    """(k, d) monomials that span the shape functions.

    Simplices have all up to a total degree, boxes all up to a degree in each direction; serendipity boxes, which lack
    nodes inside, those in which at most one direction is squared.
    """
    degree = kind.degree
    every = np.array(list(product(range(degree + 1), repeat=kind.dim)))
    if kind.simplex:
        return every[every.sum(axis=1) <= degree]
    return every if len(every) == kind.nodes else every[(every == 2).sum(axis=1) <= 1]


@cache
def _coefficients(kind: Kind) -> NDArray[np.float64]:
    """(k, k) shape functions in columns, by monomials: one in their own node and zero in the others."""
    return np.linalg.inv((reference_nodes(kind)[:, None, :] ** _exponents(kind)).prod(axis=2))


def shape_functions(kind: Kind, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, k) values of the shape functions at points (q, d) of the reference element."""
    return np.asarray((at[:, None, :] ** _exponents(kind)).prod(axis=2) @ _coefficients(kind))


def shape_gradients(kind: Kind, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, k, d) gradients of the shape functions at points (q, d) of the reference element."""
    power = _exponents(kind)
    slopes = np.empty((len(at), len(power), kind.dim))
    for a in range(kind.dim):
        lower = power - np.eye(kind.dim, dtype=np.int64)[a]
        slopes[:, :, a] = power[:, a] * (at[:, None, :] ** np.maximum(lower, 0)).prod(axis=2)
    return np.einsum("qea,ek->qka", slopes, _coefficients(kind))


def rules(kind: Kind) -> Iterator[Rule]:
    """Quadrature rules in use, points (q, d) and weights (q,), likely ones first.

    Which one integrated an element shows where its geometry is not affine.
    """
    if not kind.simplex:
        yield from (_gauss(kind.dim, order) for order in ((3, 2, 4, 5, 6, 7) if kind.quadratic else (2, 3, 4, 1)))
    elif not kind.quadratic:
        yield np.full((1, kind.dim), 1 / (kind.dim + 1)), np.array([(1, 1, 1 / 2, 1 / 6)[kind.dim]])
    else:
        yield from _triangle_rules() if kind.dim == 2 else _tetrahedron_rules()


def planar_rules(kind: Kind) -> dict[str, Rule]:
    """Rules for the plane by the names that :mod:`unassemble.certificate` knows, likely ones first.

    Reduced integration comes last; with a single point quadrilaterals of four nodes have fields of no energy beside the
    constants (hourglass modes), and the matrix does not determine them.
    """
    if kind.simplex:
        degree_4, degree_2, _, degree_5, _ = _triangle_rules()
        return {"degree 4": degree_4, "degree 5": degree_5, "degree 2": degree_2}
    orders = (3, 4, 5, 6, 7, 2) if kind.quadratic else (2, 3, 4, 5, 6)
    return {f"{order} x {order} Gauss": _gauss(2, order) for order in orders}


def exact_rule(kind: Kind, more: int = 0) -> Rule:
    """A rule that integrates products of gradients exactly on affine cells: Gauss's, on simplices folded.

    The map (s, t, u) -> (s, (1 - s) t, (1 - s) (1 - t) u) takes the box to the simplex; its determinant costs a degree
    in the plane. Products of functions take one point `more` in each direction.
    """
    at, weights = _gauss(kind.dim, kind.degree + 1 + more)
    if kind.simplex:
        left = np.cumprod(1 - at[:, :-1], axis=1)
        at[:, 1:] *= left
        weights = weights * left.prod(axis=1)
    return at, weights


def _gauss(d: int, order: int) -> Rule:
    """Gauss's rule in each direction of the unit box."""
    node, weight = np.polynomial.legendre.leggauss(order)
    points = np.array(list(product((node + 1) / 2, repeat=d)))
    return points, np.array(list(product(weight / 2, repeat=d))).prod(axis=1)


def _symmetric(*orbits: tuple[float, tuple[float, ...]]) -> Rule:
    """A rule from weights, which add up to 1 over all points, and barycentric coordinates up to their order."""
    points = [(w, x) for w, orbit in orbits for x in sorted(set(permutations(orbit)))]
    d = len(points[0][1]) - 1
    volume = (1, 1, 1 / 2, 1 / 6)[d]
    return np.array([x[1:] for _, x in points]), volume * np.array([w for w, _ in points])


def _triangle_rules() -> Iterator[Rule]:
    """Of degrees 4, 2, 2, 5 and 3 (Strang and Fix 1973, Dunavant 1985)."""
    root = np.sqrt(10)
    orbits = []
    for sign in (1, -1):
        a = (8 - root + sign * np.sqrt(38 - 44 * np.sqrt(0.4))) / 18
        w = (620 + sign * np.sqrt(213125 - 53320 * root)) / 3720
        orbits.append((float(w), (float(a), float(a), float(1 - 2 * a))))
    yield _symmetric(*orbits)
    yield _symmetric((1 / 3, (1 / 6, 1 / 6, 2 / 3)))
    yield _symmetric((1 / 3, (0.5, 0.5, 0.0)))
    root = np.sqrt(15)
    orbits = [(9 / 40, (1 / 3, 1 / 3, 1 / 3))]
    for sign in (1, -1):
        a = (6 + sign * root) / 21
        orbits.append((float((155 + sign * root) / 1200), (float(a), float(a), float(1 - 2 * a))))
    yield _symmetric(*orbits)
    yield _symmetric((-9 / 16, (1 / 3, 1 / 3, 1 / 3)), (25 / 48, (0.2, 0.2, 0.6)))


def _tetrahedron_rules() -> Iterator[Rule]:
    """Of degrees 4, 2, 3 and 5 (Keast 1986)."""
    centre = (0.25, 0.25, 0.25, 0.25)
    a = (1 + np.sqrt(5 / 14)) / 4
    yield _symmetric(
        (-148 / 1875, centre), (343 / 7500, (1 / 14, 1 / 14, 1 / 14, 11 / 14)), (56 / 375, (a, a, 0.5 - a, 0.5 - a))
    )
    a = (5 - np.sqrt(5)) / 20
    yield _symmetric((1 / 4, (a, a, a, 1 - 3 * a)))
    yield _symmetric((-4 / 5, centre), (9 / 20, (1 / 6, 1 / 6, 1 / 6, 1 / 2)))
    yield _symmetric(
        (6544 / 36015, centre),
        (81 / 2240, (1 / 3, 1 / 3, 1 / 3, 0.0)),
        (161051 / 2304960, (1 / 11, 1 / 11, 1 / 11, 8 / 11)),
        (338 / 5145, (0.0665501535736643, 0.0665501535736643, 0.4334498464263357, 0.4334498464263357)),
    )


def volumes(points: NDArray[np.float64], cells: NDArray[np.int64], kind: Kind, rule: Rule) -> NDArray[np.float64]:
    """(m, q) volumes that go with the points of a rule: its weights times |det J|."""
    moved = (points[cells] - points[cells[:, :1]]).transpose(0, 2, 1)  # digits of differences, not of coordinates
    return np.abs(np.linalg.det(moved[:, None] @ shape_gradients(kind, rule[0]))) * rule[1]


def mass(kind: Kind, at: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, k, k) integrals of phi_i phi_j, from volumes (m, q) at points (q, d), or masses."""
    value = shape_functions(kind, at)
    return np.einsum("mq,qi,qj->mij", weights, value, value, optimize=True)


def elasticity(
    points: NDArray[np.float64], cells: NDArray[np.int64], kind: Kind, rule: Rule
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, k, k, d, d) blocks of isotropic elasticity for (lambda, mu) = (1, 0) and (0, 1), by i, j, c, b.

    The strain energy lambda tr(e)^2 / 2 + mu e : e gives int lambda d_c phi_i d_b phi_j + mu d_b phi_i d_c phi_j +
    delta_cb mu grad phi_i . grad phi_j.
    """
    m, k, d = len(cells), kind.nodes, kind.dim
    at, weights = rule
    local = shape_gradients(kind, at)
    jacobian = np.einsum("mke,qkr->mqer", points[cells], local, optimize=True)
    size = np.abs(np.linalg.det(jacobian))
    jacobian[size <= LAST_DIGITS * np.linalg.norm(jacobian, axis=(2, 3)) ** d] = np.eye(d)  # flat, and of no weight
    g = np.einsum("qkr,mqre->mqke", local, np.linalg.inv(jacobian), optimize=True).reshape(m, len(weights), k * d)
    outer = (g * (size * weights)[..., None]).transpose(0, 2, 1) @ g  # one product of matrices per cell: fast
    first = outer.reshape(m, k, d, k, d).transpose(0, 1, 3, 2, 4)
    trace = np.trace(first, axis1=3, axis2=4)
    return first, first.transpose(0, 1, 2, 4, 3) + trace[..., None, None] * np.eye(kind.dim)


def assembled(blocks: NDArray[np.float64], cells: NDArray[np.int64], n: int) -> sp.csr_array:
    """The matrix of n nodes that element matrices (m, k, k) add up to; node by node, if of blocks: (m, k, k, d, d)."""
    d = blocks.shape[-1] if blocks.ndim == 5 else 1
    unknowns = (cells[:, :, None] * d + np.arange(d)).reshape(len(cells), -1)
    size = unknowns.shape[1]
    flat = (blocks.transpose(0, 1, 3, 2, 4) if blocks.ndim == 5 else blocks).reshape(len(cells), size, size)
    row, column = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
    return sp.csr_array((flat.ravel(), (row.ravel(), column.ravel())), shape=(n * d, n * d))
