"""Scalar matrices in the plane and on surfaces, assembled by scikit-fem, and what people put into them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from scipy.spatial import Delaunay, cKDTree
from skfem import Basis, BilinearForm, ElementTriP1, Mesh, MeshTri
from skfem.helpers import dot, grad
from skfem.models import laplace

from .bodies import bisected
from .truth import Truth, damaged, rounded  # it names the folders of the tests

from conditions import convected, eliminated, identity_rows, mesh_of, robin, shuffled  # isort: skip
from conforming.assembled import ELEMENTS, assembled as conforming  # isort: skip
from families import FAMILIES  # isort: skip
from meshes import random_mesh  # isort: skip
from surfaces import sheet, sphere, surface, torus  # isort: skip

Generator = np.random.Generator
MESHES = ("jittered", "random", "drawn out", "graded", "squares", "triangles")
TAKEN = ("boundary", "one side", "identity", "Robin", "many factors", "convection", "noise")
OTHERS = ("rows inside", "two materials", "bent", "random rim")


def any_domain(rng: Generator, most: int = 100) -> MeshTri:
    """A mesh of triangles of any kind, jittered, of random points, drawn out, graded, a lattice moved a little."""
    kind, n = rng.choice(MESHES), int(np.exp(rng.uniform(np.log(12), np.log(most))))
    if kind == "jittered":
        return mesh_of(*random_mesh(n, seed=int(rng.integers(1 << 30)), holes=bool(rng.integers(2))))
    points = rng.uniform(size=(n, 2))
    if kind == "drawn out":
        points[:, 0] *= np.where(points[:, 0] < 0.1, 10 ** rng.uniform(-4, -1), 1)
    elif kind == "graded":
        points *= np.linalg.norm(points, axis=1, keepdims=True) ** rng.uniform(0.5, 3)
    elif kind != "random":
        k = max(int(n**0.5), 4)
        i, j = np.divmod(np.arange(k * k), k)
        apart = [i + 0.5 * (j % 2), 0.866 * j] if kind == "triangles" else [i, j]
        points = np.stack(apart, 1) + 10 ** rng.uniform(-6, -0.6) * rng.uniform(-1, 1, (k * k, 2))
    hole = rng.uniform(0.3, 0.7, 2) if rng.integers(4) == 0 else None
    return triangulated(points, hole)


def triangulated(points: NDArray, hole: NDArray | None = None) -> MeshTri:
    """Delaunay triangles that are not flat, about a hole."""
    triangles = Delaunay(points).simplices
    a, b, c = (points @ [1, 1j])[triangles].T
    longest = np.abs([b - a, c - b, a - c]).max(axis=0)
    solid = np.abs((np.conj(b - a) * (c - a)).imag) > 1e-7 * longest**2
    if hole is not None:
        middle = points[triangles].mean(axis=1) / np.ptp(points)
        solid &= np.linalg.norm(middle - hole, axis=1) > 0.15
    used, triangles = np.unique(triangles[solid], return_inverse=True)
    return mesh_of(points[used], triangles.reshape(-1, 3))


def few_triangles(rng: Generator) -> MeshTri:
    """One to a dozen."""
    mesh = triangulated(rng.uniform(size=(int(rng.integers(3, 9)), 2)))
    sort = rng.integers(4)
    if sort == 1:
        mesh = bisected(rng, few=True)
    elif sort == 2:
        mesh = MeshTri.init_tensor(*(np.cumsum(rng.uniform(0.5, 1.5, rng.integers(2, 4))) for _ in "xy"))
    if rng.random() < 0.3 and mesh.nelements > 2:
        mesh = mesh.restrict(rng.permutation(mesh.nelements)[: int(rng.integers(1, mesh.nelements))])
    return mesh


def family(rng: Generator) -> MeshTri:
    """In which it is hard to tell cells from holes."""
    for _ in range(20):
        points, triangles = FAMILIES[rng.choice([*FAMILIES])](rng)
        if 3 <= len(points) <= 150 and len(triangles):
            return mesh_of(points, triangles)
    return few_triangles(rng)


def any_triangles(rng: Generator, most: int = 100) -> MeshTri:
    """Any of these, of domains with up to about so many vertices."""
    sort = rng.choice(4, p=[0.5, 0.25, 0.05, 0.2])
    if sort == 0:
        return any_domain(rng, most)
    if sort == 1:
        return few_triangles(rng)
    return family(rng) if sort == 2 else bisected(rng, few=False)


def truth_on(matrix: sp.csr_array, points: NDArray, mesh: Mesh, **options) -> Truth:
    """Rows at (n, 2) points; cells are those all of whose vertices are rows."""
    far, row_of = cKDTree(points).query(mesh.p.T)
    cells = np.where(far < 1e-12 * np.ptp(mesh.p), row_of, -1)[mesh.t.T]
    cells = tuple(map(tuple, cells[(cells >= 0).all(axis=1)].tolist()))
    return Truth(sp.csr_array(matrix), np.arange(len(points)), points, "similarity", cells=cells, options=options)


def finished(truth: Truth, rng: Generator, *, exact: float = 0.8) -> Truth:
    """Of any scale and sign, maybe with its operator named, maybe rounded."""
    truth = replace(truth, matrix=sp.csr_array(truth.matrix * rng.choice([1.0, 1.0, -1.0, 1e-3, 12.7])))
    if rng.random() < 0.3 and "operator" not in truth.options:
        truth = replace(truth, options={"operator": "laplacian"})
    return truth if rng.random() < exact else rounded(truth, rng)


def assembled_with(mesh: MeshTri, form, rng: Generator, **more) -> Truth:
    """A form on linear triangles, rows at random; zeros stored or not."""
    matrix = sp.csr_array(form.assemble(Basis(mesh, ElementTriP1(), intorder=4), **more))
    if rng.integers(2):
        matrix.data[np.abs(matrix.data) < 1e-14 * np.abs(matrix.data).max(initial=0.0)] = 0
        matrix.eliminate_zeros()
    return truth_on(*shuffled(matrix, mesh.p.T, int(rng.integers(1 << 30))), mesh)


def conditions(rng: Generator) -> Truth:
    """What boundary conditions leave of a matrix, or another operator."""
    mesh, condition = any_domain(rng), str(rng.choice(TAKEN + OTHERS))
    if condition == "bent":
        return bent(mesh, rng)
    given = taken(mesh, condition, rng) if condition in TAKEN else other(mesh, condition, rng)
    return replace(truth_on(*given, mesh, operator="laplacian"), intact=condition not in ("noise", "random rim"))


def taken(mesh: MeshTri, condition: str, rng: Generator) -> tuple[sp.csr_array, NDArray]:
    """A condition on the boundary, and maybe errors in the entries."""
    if condition == "boundary":
        return eliminated(mesh)
    if condition == "one side":
        turn, from_ = rng.uniform(0, 2 * np.pi), rng.uniform(-0.3, 0.3)
        return eliminated(mesh, lambda x: np.cos(turn) * x[0] + np.sin(turn) * x[1] < from_)
    if condition == "identity":
        return identity_rows(mesh)
    if condition == "Robin":
        return robin(mesh, 10 ** rng.uniform(-3, 3))
    if condition == "many factors":
        matrix, points = robin(mesh, 0.0)
        place = {tuple(x): k for k, x in enumerate(points.tolist())}
        more = sp.lil_array(matrix.shape)
        for ends in mesh.facets[:, mesh.boundary_facets()].T:
            rows = [place[tuple(mesh.p[:, v].tolist())] for v in ends]
            more[np.ix_(rows, rows)] += rng.integers(2) * rng.uniform(0.5, 2) * np.array([[2, 1], [1, 2]])
        return sp.csr_array(matrix + more), points
    if condition == "convection":
        matrix, points = convected(mesh, tuple(rng.standard_normal(2) * 10 ** rng.uniform(-1, 1.5)))
        return (matrix + matrix.T) / 2, points
    matrix, points = eliminated(mesh) if rng.integers(2) else robin(mesh, 1.0)
    upper, sigma = sp.triu(matrix).tocoo(), 10 ** rng.uniform(-14.5, -8)
    errors = sp.coo_array((sigma * rng.standard_normal(upper.nnz) * upper.data, upper.coords), shape=upper.shape)
    return sp.csr_array(matrix + errors + sp.triu(errors, 1).T), points


def other(mesh: MeshTri, condition: str, rng: Generator) -> tuple[sp.csr_array, NDArray]:
    """Another operator, or random entries; the boundary taken out of two in three of them."""
    x, y = mesh.p
    factor = np.ones(mesh.nelements)
    if condition == "two materials":
        turn = rng.uniform(0, 2 * np.pi)
        beyond = (np.cos(turn) * x + np.sin(turn) * y)[mesh.t].mean(axis=0) > rng.uniform(-0.2, 0.2)
        factor = np.where(beyond, 1 + 10 ** rng.uniform(-9, 0.5), 1.0)
    form = BilinearForm(lambda u, v, w: factor[:, None] * dot(grad(u), grad(v)))
    matrix = sp.csr_array(form.assemble(Basis(mesh, ElementTriP1())))
    gone = mesh.boundary_nodes() if condition == "random rim" or rng.integers(3) else np.empty(0, int)
    if condition == "rows inside":
        gone = rng.choice(mesh.nvertices, max(1, mesh.nvertices // 20), replace=False)
    left = np.setdiff1d(np.arange(mesh.nvertices), gone)
    if condition == "random rim":
        near = np.isin(np.arange(mesh.nvertices), mesh.t[:, np.isin(mesh.t, gone).any(axis=0)])
        upper = sp.triu(matrix, 1).tocoo()
        upper.data *= np.where(near[upper.row] & near[upper.col], rng.uniform(0.2, 3, upper.nnz), 1)
        matrix = sp.csr_array(upper + upper.T + sp.diags_array(matrix.diagonal()))
    return shuffled(matrix[left][:, left], mesh.p.T[left])


def on_surface(points: NDArray, triangles: NDArray, rng: Generator, **options) -> Truth:
    """c L on a surface in space."""
    known = surface(points, triangles, seed=int(rng.integers(1 << 30)))
    cells = tuple(map(tuple, known.triangles.tolist()))
    n = len(points)
    return Truth(known.matrix, np.arange(n), known.points, "lengths", cells=cells, options=options)


def bent(mesh: MeshTri, rng: Generator) -> Truth:
    """A plane that is bent, by 1e-6 of its size to all of it, with its boundary or without."""
    x, y = mesh.p
    height = 10 ** rng.uniform(-6, 0) * np.sin(3 * x + rng.uniform(0, 6)) * np.cos(2 * y)
    truth = on_surface(np.column_stack([x, y, height]), mesh.t.T, rng)
    if rng.integers(3) == 0:
        return truth
    ends = np.concatenate([np.array(truth.cells)[:, pair] for pair in ([0, 1], [1, 2], [0, 2])])
    ends, often = np.unique(np.sort(ends), axis=0, return_counts=True)
    left = np.setdiff1d(truth.node, ends[often == 1])
    return without(truth, left) if len(left) > 3 else truth


def without(truth: Truth, left: NDArray) -> Truth:
    """The same with some rows of a scalar matrix alone."""
    place = np.full(len(truth.node), -1)
    place[left] = np.arange(len(left))
    cells = place[np.array(truth.cells)]
    kept = truth.kept(left)
    cells = tuple(map(tuple, cells[(cells >= 0).all(axis=1)].tolist()))
    return replace(kept, node=np.arange(len(left)), points=truth.points[left], cells=cells)


def whole(rng: Generator) -> Truth:
    """c L + D as it comes, of any mesh of triangles, right isosceles ones of bisection too."""
    mesh = any_triangles(rng)
    truth = assembled_with(mesh, laplace, rng)
    if rng.integers(2):
        diagonal = 10 ** rng.uniform(-3, 2) * rng.standard_normal(len(truth.node))
        truth = replace(truth, matrix=sp.csr_array(truth.matrix + sp.diags_array(diagonal)))
    return finished(truth, rng, exact=0.5)


def few(rng: Generator) -> Truth:
    """One to a dozen triangles, with terms on the boundary now and then, or without some rows."""
    mesh = few_triangles(rng)
    sort = rng.integers(3)
    if sort == 0:
        truth = truth_on(*robin(mesh, 10 ** rng.uniform(-3, 3)), mesh)
    elif sort == 1 and mesh.nvertices > 4:
        truth = assembled_with(mesh, laplace, rng)
        truth = without(truth, np.sort(rng.permutation(len(truth.node))[: int(rng.integers(3, len(truth.node)))]))
    else:
        truth = assembled_with(mesh, laplace, rng)
    return finished(truth, rng)


def smooth(rng: Generator) -> Truth:
    """A coefficient that varies smoothly: no mesh has one factor for all triangles then."""
    size, wave = 10 ** rng.uniform(-9, 0.5), rng.uniform(-3, 3, 2)

    @BilinearForm
    def form(u, v, w):
        return (1 + size * np.exp(wave[0] * w.x[0] + wave[1] * w.x[1])) * dot(grad(u), grad(v))

    return finished(assembled_with(any_triangles(rng, 50), form, rng), rng)


def axisymmetric(rng: Generator) -> Truth:
    """Weighted with r, near the axis or far from it."""
    mesh = any_triangles(rng, 50)
    far = 10 ** rng.uniform(-2, 8) - mesh.p[0].min()
    form = BilinearForm(lambda u, v, w: (w.x[0] + far) / (1 + far) * dot(grad(u), grad(v)))
    return finished(assembled_with(mesh, form, rng), rng)


def with_mass(rng: Generator) -> Truth:
    """A consistent mass matrix besides, or convection made symmetric, or a mass matrix with a density that varies."""
    mesh, sort = any_triangles(rng, 50), rng.integers(4)
    size = 10 ** rng.uniform(-4, 4) * rng.choice([-1, 1])
    field = rng.standard_normal(2)

    def flow(u, v):
        return (field[0] * u.grad[0] + field[1] * u.grad[1]) * v

    @BilinearForm
    def form(u, v, w):
        if sort == 0:
            return dot(grad(u), grad(v)) + size * (1 + w.x[0] ** 2) * u * v
        if sort == 1:
            return dot(grad(u), grad(v)) + size * w.x[0] * (flow(u, v) + flow(v, u))
        return dot(grad(u), grad(v)) + size * u * v

    return finished(assembled_with(mesh, form, rng), rng)


def elements(rng: Generator) -> Truth:
    """Quadratic and cubic triangles, quadrilaterals: whole, without rim, with a mass matrix or a smooth coefficient."""
    name = str(rng.choice(["P2", "P3", "Q1", "Q1", "Q2", "S2"]))
    small = rng.random() < 0.4
    if name.startswith("P"):
        mesh = few_triangles(rng) if small else any_domain(rng, 40)
    else:
        most = 4 if small or name != "Q1" else 9
        mesh = skfem.MeshQuad.init_tensor(*(np.cumsum(rng.uniform(0.5, 1.5, rng.integers(2, most))) for _ in "xy"))
        mesh = mesh.translated(-mesh.p.mean(axis=1))
        mesh = skfem.MeshQuad(mesh.p + rng.choice([0, 0.1]) * rng.uniform(-1, 1, mesh.p.shape), mesh.t)
    sort = rng.integers(5)
    if sort == 0:
        gone = eliminated(mesh, element=ELEMENTS[name]())
        if gone[0].shape[0] > 2:
            return finished(Truth(sp.csr_array(gone[0]), np.arange(len(gone[1])), gone[1], "similarity"), rng)
    if sort == 1:
        size, basis = 10 ** rng.uniform(-8, 0.5), Basis(mesh, ELEMENTS[name]())
        form = BilinearForm(lambda u, v, w: (1 + size * np.exp(w.x[0])) * dot(grad(u), grad(v)))
        known = shuffled(sp.csr_array(form.assemble(basis)), basis.doflocs.T)
        return finished(Truth(known[0], np.arange(len(known[1])), known[1], "similarity"), rng)
    reaction = 10 ** rng.uniform(-3, 3) if sort == 2 else 0.0
    known = conforming(name, mesh, zeros=bool(rng.integers(2)), seed=int(rng.integers(1 << 30)), reaction=reaction)
    cells = tuple(map(tuple, known.cells))
    return finished(Truth(known.matrix, np.arange(len(known.points)), known.points, "similarity", cells=cells), rng)


def spoiled(rng: Generator) -> Truth:
    """Entries that are not what they were."""
    return damaged((whole, few, elements)[rng.integers(3)](rng), rng)


def any_surface(rng: Generator) -> tuple[NDArray, NDArray]:
    """Closed, with a handle, or with a rim and holes."""
    seed = int(rng.integers(1 << 30))
    sort = rng.integers(4)
    if sort == 0:
        return torus(int(rng.integers(3, 9)), int(rng.integers(3, 7)), seed)
    if sort == 1:
        return sheet(int(rng.integers(4, 10)), seed, holes=False)
    return sphere(int(rng.integers(4, 60)), seed)


def surfaces(rng: Generator) -> Truth:
    """One coefficient."""
    options = {"operator": "surface"} if rng.integers(2) else {}
    truth = on_surface(*any_surface(rng), rng, **options)
    if rng.random() < 0.3:
        diagonal = rng.standard_normal(len(truth.node))
        truth = replace(truth, matrix=sp.csr_array(truth.matrix + sp.diags_array(diagonal)))
    return truth if rng.random() < 0.8 else rounded(truth, rng)


def surface_coefficients(rng: Generator) -> Truth:
    """One coefficient for each triangle, which hardly differ or differ much: of a closed surface others fit as well."""
    points, triangles = any_surface(rng)
    spread = 10 ** rng.uniform(-6, 0)
    factor = 1 + spread * rng.uniform(-0.9, 1, len(triangles))
    total = sp.csr_array((len(points), len(points)))
    place = rng.permutation(len(points))
    for own, weight in zip(triangles, factor, strict=True):
        total = total + weight * element_of(points[own], place[own], len(points))
    options = {"operator": "surface"} if rng.integers(2) else {}
    cells = tuple(map(tuple, place[triangles].tolist()))
    n = len(points)
    return Truth(total, np.arange(n), points[np.argsort(place)], "lengths", cells=cells, options=options)


def element_of(corners: NDArray, rows: NDArray, n: int) -> sp.csr_array:
    """The matrix of one triangle in space, by the tests' own helper, which permutes its rows."""
    one = surface(corners, np.array([[0, 1, 2]]))
    back = np.array([int(np.argmin(np.linalg.norm(one.points - x, axis=1))) for x in corners])
    dense = one.matrix.toarray()[np.ix_(back, back)]
    return sp.csr_array((dense.ravel(), (np.repeat(rows, 3), np.tile(rows, 3))), shape=(n, n))


SCALAR = {
    "scalar": whole,
    "scalar-few": few,
    "scalar-conditions": conditions,
    "scalar-smooth": smooth,
    "scalar-axisymmetric": axisymmetric,
    "scalar-mass": with_mass,
    "scalar-elements": elements,
    "scalar-damaged": spoiled,
    "surface": surfaces,
    "surface-coefficients": surface_coefficients,
}
