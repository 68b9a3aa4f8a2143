"""Small hostile inputs for ``hostile.py`` and the tests: each kind made of a random generator alone."""

from __future__ import annotations

import io
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import QhullError
from skfem.models import laplace, mass

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "structures"), str(TESTS / "elasticity")]
import assembled  # noqa: E402
import built  # noqa: E402

from families import FAMILIES, HOPELESS  # noqa: E402
from meshes import delaunay, random_mesh, specimen  # noqa: E402

Piece = tuple[NDArray, NDArray]  # rows, and where they are


@dataclass(frozen=True, eq=False)
class Given:
    """A matrix, or the bytes of a file; the pieces of its mesh, None where that is not known; whether it is whole."""

    matrix: Any
    pieces: list[Piece] | None = None
    intact: bool = True
    name: str = ""


def pieces_of(triangles: NDArray) -> NDArray:
    """Edge-connected piece of each triangle."""
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2).astype(np.int64)
    _, side = np.unique(ends @ [triangles.max() + 1, 1], return_inverse=True)
    incidence = sp.coo_array((np.ones(side.size), (np.arange(side.size) // 3, side.ravel()))).tocsr()
    return connected_components(incidence @ incidence.T, directed=False)[1]


def size(rng) -> int:
    return int(rng.choice([*range(1, 8), *range(8, 40), 100, 300], p=[0.2 / 7] * 7 + [0.77 / 32] * 32 + [0.02, 0.01]))


def mesh(rng) -> Given:
    """A random mesh, its zeros stored or not, with any diagonal and scale."""
    points, triangles = np.empty((0, 2)), np.empty((0, 3), np.int64)
    if rng.random() < 0.3:
        points, triangles = delaunay(rng.random((size(rng) + 3, 2)), longest=rng.choice([0.4, 9]))
    elif rng.random() < 0.3:
        points, triangles = random_mesh(size(rng) + 9, int(rng.integers(10**6)))
    else:
        with suppress(QhullError):  # few points in a line
            points, triangles = FAMILIES[rng.choice([*FAMILIES])](rng)
    while len(points) > 400 or len(triangles) == 0:
        points, triangles = delaunay(rng.random((size(rng) + 4, 2)))
    c = float(rng.choice([1, -1, 1e-3, -1e9, 1e-60, 1e60]))
    known = specimen(points, triangles, c=c, diagonal=rng.random() < 0.3, seed=int(rng.integers(10**6)))
    matrix = known.matrix
    if rng.random() < 0.5:
        matrix.data[np.abs(matrix.data) < 1e-14 * abs(c)] = 0
        matrix.eliminate_zeros()
    label = pieces_of(known.triangles)
    rows = [np.unique(known.triangles[label == k]) for k in range(label.max() + 1)]
    return Given(matrix, [(own, known.points[own]) for own in rows])


def glued(rng) -> Given:
    """Several meshes that share vertices, each with at least one of those before."""
    matrices, pieces, n = [], [], 0
    for _ in range(int(rng.integers(2, 5))):
        one = mesh(rng)
        own, common = one.matrix.shape[0], int(rng.choice([0, 1, 1, 1, 2, 3]))
        common = min(common, own, n)
        place = np.append(rng.permutation(n)[:common], n + np.arange(own - common))[rng.permutation(own)]
        n += own - common
        matrices.append((one.matrix.tocoo(), place))
        pieces += [(place[rows], points) for rows, points in one.pieces]
    summed = sum(sp.coo_array((m.data, (p[m.row], p[m.col])), shape=(n, n)).tocsr() for m, p in matrices)
    pairs = Counter(key for m, p in matrices for key in zip(p[m.row], p[m.col], strict=True) if key[0] != key[1])
    return Given(sp.csr_array(summed), pieces if max(pairs.values(), default=0) < 2 else None)


def damaged(rng) -> Given:
    """Any of these with entries exchanged, changed, of other sign, stored as zeros or moved; fewer rows."""
    whole = [mesh, mesh, mesh, glued, scalar, body, structure][rng.integers(7)](rng)
    matrix = sp.coo_array(sp.triu(whole.matrix, 1))
    row, column, value = (np.array(part) for part in (*matrix.coords, matrix.data))
    n, pieces = matrix.shape[0], whole.pieces
    for _ in range(int(rng.integers(1, 4)) if len(value) and n > 3 else 0):
        i, j = rng.integers(len(value), size=2)
        what = rng.integers(7)
        if what == 0:
            value[[i, j]] = value[[j, i]]
        elif what == 1:
            value[i] *= rng.choice([0, 1e-9, 1 + 1e-3, 1.3, 10, 1e9])
        elif what == 2:
            value[i] *= -1
        elif what == 3:
            row, column, value = (np.delete(part, i) for part in (row, column, value))
        elif what == 4:
            a, b = sorted(rng.permutation(n)[:2])
            row, column, value = np.append(row, a), np.append(column, b), np.append(value, rng.choice([0, 0, value[0]]))
        elif what == 5:
            value = -np.abs(value)
        else:
            value *= 1 + 10.0 ** rng.integers(-13, -1) * rng.standard_normal(len(value))
        if len(value) == 0:
            break
    upper = sp.coo_array((value, (row, column)), shape=(n, n))
    lower, diagonal = upper.T, sp.diags_array(whole.matrix.diagonal())
    parts = [sp.coo_array(part) for part in (upper, lower, diagonal)]
    rows, columns = (np.concatenate([part.coords[k] for part in parts]) for k in (0, 1))
    result = sp.coo_array((np.concatenate([part.data for part in parts]), (rows, columns)), shape=(n, n)).tocsr()
    if rng.random() < 0.2:
        kept = np.sort(rng.permutation(n)[: max(n - int(rng.integers(1, 4)), 1)])
        result, place = result[kept][:, kept], np.full(n, -1)
        place[kept] = np.arange(len(kept))
        pieces = pieces and [(place[rows][place[rows] >= 0], at[place[rows] >= 0]) for rows, at in pieces]
    return Given(result, pieces, intact=False)


def scalar(rng) -> Given:
    """Quadratic triangles, quadrilaterals, mass, reaction, convection, a jump of coefficients; of a grid of squares."""
    element = (skfem.ElementTriP1(), skfem.ElementTriP2(), skfem.ElementQuad1())[rng.integers(3)]
    kind = skfem.MeshQuad if isinstance(element, skfem.ElementQuad1) else skfem.MeshTri
    grid = kind.init_tensor(*(np.cumsum(rng.uniform(0.5, 1.5, rng.integers(2, 6))) for _ in "xy"))
    grid = kind(grid.p + rng.choice([0, 0.1]) * rng.uniform(-1, 1, grid.p.shape), grid.t)
    basis = skfem.Basis(grid, element)
    convection = skfem.BilinearForm(lambda u, v, w: u.grad[0] * v)
    jump = skfem.BilinearForm(
        lambda u, v, w: (1 + 4 * (w.x[0] > 1.5)) * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])
    )
    matrix = sum(
        rng.uniform(0.1, 2) * form.assemble(basis)
        for form, p in ((laplace, 0.6), (mass, 0.4), (convection, 0.1), (jump, 0.3))
        if rng.random() < p
    )
    return Given(sp.csr_array(matrix) if sp.issparse(matrix) else sp.csr_array(mass.assemble(basis)))


def body(rng) -> Given:
    """Linear elasticity on a small box, nodes at random."""
    kind = str(rng.choice(["tri-p1", "tri-p1", "quad-q1", "tet-p1", "tri-p2", "hex-q1"]))
    flat = assembled.ELEMENTS[kind][0] in (skfem.MeshTri, skfem.MeshQuad)
    shape = assembled.box(kind, rng.integers(2, 5, 2 if flat else 3), perturb=rng.choice([0, 0.2]))
    one = assembled.permuted_nodes(assembled.stiffness(kind, shape, lam=rng.uniform(-0.3, 3)), int(rng.integers(10**6)))
    return supported(rng, one.matrix, np.repeat(one.points, one.dim, axis=0))


def structure(rng) -> Given:
    """Frames, trusses, grillages, shells."""
    seed, counts = int(rng.integers(10**6)), rng.integers(2, 5, 2)
    makers = [
        lambda: built.plane_frame(counts, seed),
        lambda: built.truss(int(rng.integers(2, 4)), int(rng.integers(5, 12)), seed),
        lambda: built.grillage(counts, seed),
        lambda: built.frame((*counts, 2), seed),
        lambda: built.shell(counts=counts + 1),
    ]
    one = makers[rng.integers(len(makers))]().permuted(seed)
    return supported(rng, sp.csr_array(one.matrix), np.repeat(one.points, one.block, axis=0))


def supported(rng, matrix: sp.csr_array, points: NDArray) -> Given:
    """The same, or without some rows, or in random order; pieces are what is connected."""
    keep = np.arange(len(points))
    if rng.random() < 0.4:
        keep = np.sort(rng.permutation(keep)[: max(len(keep) - int(rng.integers(1, 6)), 1)])
    keep = rng.permutation(keep) if rng.random() < 0.2 else keep
    return Given(sp.csr_array(matrix[keep][:, keep]), [(np.arange(len(keep)), points[keep])])


def hopeless(rng) -> Given:
    """Trees, cacti, planar graphs and grids with random weights, or all weights equal."""
    matrix = HOPELESS[rng.choice([*HOPELESS])](max(size(rng), 5), int(rng.integers(10**6)))
    if rng.random() < 0.2:
        matrix.data[:] = -1
    return Given(matrix)


def symmetric(rng) -> Given:
    """Random symmetric matrices: sparse, dense, banded, of low rank, nearly singular, huge, small, zeros stored."""
    n = size(rng)
    values = rng.standard_normal((n, n)) if rng.random() < 0.7 else rng.integers(-4, 5, (n, n)).astype(float)
    if rng.random() < 0.3:
        values = np.outer(values[0], values[0]) + rng.choice([0, 1e-14]) * values
    if rng.random() < 0.7:
        values[rng.random((n, n)) < rng.uniform(0, 1)] = 0
    if rng.random() < 0.4:
        values = np.triu(np.tril(values, int(rng.integers(4))), 0)
    matrix = sp.coo_array(values + values.T)
    if rng.random() < 0.3:
        matrix.data *= 10.0 ** rng.integers(-300, 300, 1 if rng.random() < 0.8 else len(matrix.data))
        matrix = sp.coo_array((matrix + matrix.T) / 2)
    if rng.random() < 0.3:
        zeros = rng.integers(n, size=(2, 3))
        coords = np.hstack([matrix.coords, zeros, zeros[::-1]])
        matrix = sp.coo_array((np.append(matrix.data, np.zeros(6)), tuple(coords)), shape=(n, n))
    return Given(matrix.tocsr())


def strange(rng) -> Given:
    """Things that are hardly matrices."""
    n = size(rng)
    values = rng.integers(-2, 2, (n, n if rng.random() < 0.7 else n + 1))
    makers = [
        lambda: sp.csr_array(values.astype(rng.choice(["int8", "bool", "complex128", "float32", "uint16"]))),
        lambda: np.where(values == 1, rng.choice([np.nan, np.inf, -np.inf, 1e308]), values),
        lambda: sp.csr_array((n, n)),
        lambda: sp.eye_array(n) * rng.choice([1, 0, -1e-310]),
        lambda: sp.coo_array(values.astype(float)),
        lambda: np.ones(rng.integers(0, 3, rng.integers(4))),
        lambda: rng.choice([None, 3, "", "no such file", "-x"]),
        lambda: sp.diags_array([1.0, -4, -4, 1], offsets=[-2, -1, 1, 2], shape=(n + 2, n + 2)),
    ]
    return Given(makers[rng.integers(len(makers))]())


def file(rng) -> Given:
    """A damaged file of a small matrix."""
    whole = [mesh, symmetric, scalar, body][rng.integers(4)](rng)
    matrix = whole.matrix
    stream, name = io.BytesIO(), str(rng.choice(["a.mtx", "a.npz", "a.mat"]))
    if name == "a.mtx":
        scipy.io.mmwrite(stream, matrix, symmetry=str(rng.choice(["general", "symmetric"])))
    elif name == "a.npz":
        sp.save_npz(
            stream, sp.csr_array(matrix).asformat(rng.choice(["csr", "csc", "coo"])), compressed=rng.random() < 0.5
        )
    else:
        scipy.io.savemat(stream, {"A": sp.csc_matrix(matrix)}, do_compression=bool(rng.random() < 0.5))
    content = bytearray(stream.getvalue())
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(len(content)) if rng.random() < 0.5 else rng.integers(min(len(content), 300)))
        what = rng.integers(5)
        if what == 0:
            content[at] ^= 1 << rng.integers(8)
        elif what == 1:
            content[at : at + 1] = rng.bytes(int(rng.integers(4)))
        elif what == 2:
            content[at] = int(rng.choice([*b"0123456789 -.e\n"]))
        elif what == 3 and rng.random() < 0.5:
            content = content[: at + 1]
        else:
            content[at:at] = content[at : at + 40]
    return Given(bytes(content), whole.pieces, intact=False, name=name)


KINDS = {
    kind.__name__: kind for kind in (mesh, glued, damaged, scalar, body, structure, hopeless, symmetric, strange, file)
}
