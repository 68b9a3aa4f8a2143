"""Linear elasticity in the plane and in space, assembled by scikit-fem, and what people put into its matrices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.helpers import ddot, sym_grad
from skfem.models import laplace

from .truth import Truth, damaged, rounded  # first: it names the folders of the tests

from assembled import ELEMENTS, Assembled, box, stiffness  # isort: skip
from supported import ORDERS, SUPPORTS, ZEROS, given  # isort: skip

Generator = np.random.Generator
FLAT = ("tri-p1", "quad-q1", "tri-p2", "quad-s2", "quad-q2")
SOLID = ("tet-p1", "hex-q1", "tet-p2")
MOST = {"tri-p1": 8, "quad-q1": 8, "tri-p2": 4, "quad-s2": 4, "quad-q2": 4, "tet-p1": 5, "hex-q1": 4, "tet-p2": 3}


@dataclass(frozen=True, eq=False)
class Body:
    """A matrix, node by node, and what it was assembled on."""

    case: Assembled
    #: (m, k) all nodes of each cell.
    cells: NDArray[np.int64]
    #: (m,) how much each cell contributes to the rows in which it shows most.
    shares: NDArray[np.float64]


def any_kind(rng: Generator) -> str:
    """Linear elements in the plane come more often."""
    return str(rng.choice(["tri-p1", "tri-p1", "quad-q1", "quad-q1", "tet-p1", "hex-q1", *FLAT, *SOLID]))


def any_mesh(rng: Generator, kind: str, *, few: bool = False) -> skfem.Mesh:
    """A box, structured or not, or a few cells of one; triangles of random points and of bisection as well."""
    flat = kind in FLAT
    most = 3 if few else MOST[kind]
    counts = rng.integers(2, most + 1, 2 if flat else 3)
    stretch = 10 ** rng.uniform(-1, 1, len(counts)) if rng.random() < 0.2 else None
    mesh = box(kind, counts, perturb=float(rng.choice([0.0, 0.2])), seed=int(rng.integers(1 << 30)),
               grading=float(rng.choice([1.0, 1.0, 1.5])), stretch=stretch)  # fmt: skip
    if kind in ("tri-p1", "tri-p2") and rng.random() < 0.3:
        mesh = bisected(rng, few=few or kind == "tri-p2")
    if rng.random() < (0.5 if few else 0.15):
        left = rng.random(mesh.nelements) < rng.uniform(0.3, 0.9)
        left[rng.integers(mesh.nelements)] = True
        mesh = mesh.restrict(np.flatnonzero(left))
    if rng.random() < 0.3:
        move = 0.15 * rng.uniform(-1, 1, mesh.p.shape) * shortest(mesh)
        mesh = type(mesh)(mesh.p + move, mesh.t) if kind not in SOLID or kind.startswith("tet") else mesh
    return mesh


def bisected(rng: Generator, *, few: bool) -> skfem.MeshTri:
    """Right isosceles triangles: a square cut again and again at some of them."""
    mesh = skfem.MeshTri.init_sqsymmetric() if rng.integers(2) else skfem.MeshTri()
    while mesh.nvertices < (6 if few else 25):
        some = rng.random(mesh.nelements) < 0.4
        mesh = mesh.refined(np.flatnonzero(some)) if some.any() else mesh
    return mesh


def shortest(mesh: skfem.Mesh) -> float:
    ends = mesh.p[:, mesh.t[[0, 1]]]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=0).min())


def body_on(kind: str, mesh: skfem.Mesh, factor: NDArray, lam: float, *, within=None, form=None) -> Body:
    """Elasticity with mu of each cell its factor, and lambda that times another; or `within`, a function of place."""
    lam_mu = (lam * factor[:, None], factor[:, None])
    if within is None and form is None:
        case = stiffness(kind, mesh, lam=lambda x: lam_mu[0] + 0 * x[0], mu=lambda x: lam_mu[1] + 0 * x[0])
    else:
        case = stiffness(kind, mesh, lam=within, mu=lambda x: 1 + 0 * x[0], within=True, form=form)
    basis = skfem.Basis(mesh, ELEMENTS[kind][1](), intorder={"hex-q1": 2}.get(kind))
    groups = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
    order = np.concatenate([group[0] for group in groups if group is not None and group.size])
    place = np.empty(basis.N, dtype=np.int64)
    place[order] = np.arange(basis.N)
    cells = place[basis.element_dofs.T]
    return Body(case, cells, shares_of(factor[:, None, None] * np.abs(laplace.coo_data(basis).tolocal()), cells))


def shares_of(local: NDArray, cells: NDArray) -> NDArray[np.float64]:
    """How much cells (m, k) contribute to the rows of nodes, as those of a Laplacian (m, k, k), at the most, (m,)."""
    size = np.bincount(cells.ravel(), np.diagonal(local, axis1=1, axis2=2).ravel())[cells]
    return (local / np.minimum(size[:, :, None], size[:, None, :])).max(axis=(1, 2))


def truth_of(body: Body) -> Truth:
    """Node by node, without supports."""
    node, direction = np.divmod(np.arange(body.case.matrix.shape[0]), body.case.dim)
    cells = tuple(map(tuple, body.cells.tolist()))
    return Truth(body.case.matrix, node, body.case.points, "homothety", direction, cells, body.shares)


def as_handed_over(body: Body, rng: Generator, *, exact: float = 0.6) -> Truth:
    """With a support, an order of the unknowns, zeros or none, and maybe rounded."""
    case, n = body.case, len(body.case.points)
    order = rng.permutation(n)
    rows = (order[:, None] * case.dim + np.arange(case.dim)).ravel()
    moved = Assembled(sp.csr_array(case.matrix[rows][:, rows]), case.points[order], case.cells)
    place = np.argsort(order)
    ordered = str(rng.choice(["interleaved", "interleaved", *ORDERS]))
    support = str(rng.choice(["free", "free", *SUPPORTS]))
    held = given(moved, support, ordered, str(rng.choice(ZEROS)), seed=int(rng.integers(1 << 30)))
    cells = tuple(map(tuple, place[body.cells].tolist()))
    truth = Truth(held.matrix, held.node, case.points[order], "homothety", held.direction, cells, body.shares)
    if truth.matrix.shape[0] < 3:
        return as_handed_over(body, rng, exact=exact)
    if rng.random() < 0.1:
        gone = rng.choice(len(held.node), min(int(rng.integers(1, 7)), len(held.node) - 1), replace=False)
        truth = truth.kept(np.setdiff1d(np.arange(len(held.node)), gone))
    return truth if rng.random() < exact else rounded(truth, rng)


def plain_body(rng: Generator, *, few: bool = False) -> Body:
    """One material, or one in each half."""
    kind = any_kind(rng)
    mesh = any_mesh(rng, kind, few=few)
    factor = np.ones(mesh.nelements)
    if rng.random() < 0.3:
        factor = np.where(mesh.p[0, mesh.t].mean(axis=0) > np.median(mesh.p[0]), 1.0, rng.uniform(0.1, 3))
    return body_on(kind, mesh, factor, float(rng.choice([0.0, 1.0, 1.5, rng.uniform(-0.3, 3)])))


def plain(rng: Generator) -> Truth:
    """A body with supports."""
    return as_handed_over(plain_body(rng), rng)


def few_elements(rng: Generator) -> Truth:
    """One to a dozen cells."""
    return as_handed_over(plain_body(rng, few=True), rng)


def contrasts(rng: Generator) -> Truth:
    """Some cells 1e-12 to 1e12 as stiff as the others, as void in the optimisation of topology; or all at random."""
    kind = any_kind(rng)
    mesh = any_mesh(rng, kind)
    factor, contrast = np.ones(mesh.nelements), 10 ** rng.uniform(-12, 12)
    sort = rng.integers(4)
    if sort == 0:
        factor[rng.random(len(factor)) < rng.uniform(0.05, 0.7)] = contrast
    elif sort == 1:
        middle = mesh.p[:, mesh.t].mean(axis=1)
        centre = middle[:, rng.integers(len(factor))]
        away = (middle - centre[:, None]) / np.ptp(mesh.p, axis=1)[:, None]
        factor[np.linalg.norm(away, axis=0) < rng.uniform(0.2, 0.6)] = contrast
    elif sort == 2:
        factor = 10 ** (rng.uniform(-0.5, 0.5, len(factor)) * np.log10(contrast))
    else:  # a density to the power of three, as penalised
        factor = 1e-9 + rng.uniform(0, 1, len(factor)) ** 3 * (1 - 1e-9)
    return as_handed_over(body_on(kind, mesh, factor, float(rng.uniform(0, 3))), rng, exact=0.8)


def smooth(rng: Generator) -> Truth:
    """A first Lame coefficient that varies within cells."""
    kind = any_kind(rng)
    mesh = any_mesh(rng, kind, few=rng.random() < 0.3)
    size = 10 ** rng.uniform(-9, 0.5)
    wave = rng.uniform(-3, 3, 3)
    within = lambda x: 1 + size * np.exp(sum(w * one for w, one in zip(wave, x, strict=False)))  # noqa: E731
    return as_handed_over(body_on(kind, mesh, np.ones(mesh.nelements), 1.0, within=within), rng, exact=0.8)


@skfem.BilinearForm
def meridian(u, v, w):
    """Elasticity of a body of revolution: r = x[0], the hoop strain u_r / r besides, times r."""
    e, f = sym_grad(u), sym_grad(v)
    r = w.x[0]
    hoop, other = u[0] / r, v[0] / r
    divergence = (e[0, 0] + e[1, 1] + hoop) * (f[0, 0] + f[1, 1] + other)
    return r * (1.5 * divergence + 2 * ddot(e, f) + 2 * hoop * other)


@skfem.BilinearForm
def weighted(u, v, w):
    """Plane elasticity times r: weight without the hoop strain."""
    e, f = sym_grad(u), sym_grad(v)
    trace = (e[0, 0] + e[1, 1]) * (f[0, 0] + f[1, 1])
    return w.x[0] * (1.5 * trace + 2 * ddot(e, f))


def axisymmetric(rng: Generator) -> Truth:
    """A meridian section, near the axis or far from it, whole or with the weight alone."""
    kind = str(rng.choice(FLAT))
    mesh = any_mesh(rng, kind, few=rng.random() < 0.3)
    axis = mesh.p[0].min() - 10 ** rng.uniform(-2, 6)
    form = weighted if rng.random() < 0.4 else meridian
    moved = mesh.translated((-axis, 0.0))
    body = body_on(kind, moved, np.ones(mesh.nelements), 1.0, within=lambda x: x[0], form=form)
    back = replace(body.case, points=body.case.points + [axis, 0.0])  # supports are on the planes of a box
    return as_handed_over(replace(body, case=back), rng, exact=0.8)


def sprung(rng: Generator) -> Truth:
    """Springs of any kind to the ground and between nodes, some of which hang on them and have lost rows."""
    body = plain_body(rng, few=rng.random() < 0.4)
    case, d = body.case, body.case.dim
    n, more = len(case.points), int(rng.choice([0, 0, 1, 3]))
    extent = np.ptp(case.points, axis=0)
    beyond = case.points.min(axis=0) + rng.uniform(-0.5, 1.5, (more, d)) * extent
    points = np.vstack([case.points, beyond])
    total = np.zeros((n + more, d) * 2)
    typical, axial = case.matrix.diagonal().mean(), rng.choice(["axial", "all", "one axis"])
    pairs = [rng.choice(n + more, 2, replace=False) for _ in range(int(rng.choice([0, 1, 1, 3, n])))]
    pairs += [np.array([n + k, rng.integers(n)]) for k in range(more)]
    same = rng.random() < 0.5
    share = 10 ** rng.uniform(-9, 1)
    for i, j in pairs:
        length = points[i] - points[j]
        axis = length / max(np.linalg.norm(length), 1e-300)
        block = {"axial": np.outer(axis, axis), "all": np.eye(d), "one axis": np.diag(np.arange(d) == 0)}[axial]
        block = typical * (share if same else 10 ** rng.uniform(-9, 1)) * block
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            total[a, :, b] += sign * block
    for i in rng.choice(n + more, int(rng.choice([0, 0, 1, 4])) % (n + 1), replace=False):
        total[i, :, i] += typical * share * (np.eye(d) if rng.integers(2) else np.diag(np.arange(d) == 0))
    whole = sp.block_diag([case.matrix, sp.csr_array((more * d, more * d))], format="csr")
    whole = sp.csr_array(whole + sp.csr_array(total.reshape((n + more) * d, -1)))
    truth = as_handed_over(replace(body, case=Assembled(whole, points, case.cells)), rng, exact=0.8)
    live = np.flatnonzero(abs(truth.matrix).sum(axis=1) > 0)
    truth = truth.kept(live)
    if pairs and rng.random() < 0.4:
        present = np.unique(truth.node)
        some = np.isin(truth.node, rng.choice(present, min(3, len(present)), replace=False))
        lost = some & (rng.random(len(some)) < 0.5)
        truth = truth.kept(np.flatnonzero(~lost)) if not lost.all() else truth
    return truth


def hanging(rng: Generator) -> Truth:
    """Few elements, some of whose nodes lack rows and hang on a spring that joins them to another node."""
    body = plain_body(rng, few=rng.random() < 0.7)
    case, d, n = body.case, body.case.dim, len(body.case.points)
    ends = rng.permutation(n)[: 2 * min(int(rng.integers(1, 3)), n // 2)].reshape(-1, 2)
    total = np.zeros((n, d) * 2)
    for i, j in ends:
        axis = case.points[i] - case.points[j]
        block = (np.outer(axis, axis) / (axis @ axis), np.eye(d), np.diag(np.arange(d) == 0))[rng.integers(3)]
        block = case.matrix.diagonal().mean() * 10 ** rng.uniform(-3, 1) * block
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            total[a, :, b] += sign * block
    keep = np.ones((n, d), dtype=bool)
    keep[ends[:, 0]] = rng.random((len(ends), d)) < 0.5
    beside = np.isin(body.cells, ends[:, 0]).any(axis=1)
    if rng.integers(2) and beside.any():  # nodes of the same cells are gone
        others = rng.choice(np.unique(body.cells[beside]), int(rng.integers(1, 4)))
        keep[np.setdiff1d(others, ends)] = False
    sprung_on = replace(case, matrix=sp.csr_array(case.matrix + sp.csr_array(total.reshape(n * d, -1))))
    truth = truth_of(replace(body, case=sprung_on))
    rows = np.lexsort((truth.direction, rng.permutation(n)[truth.node]))
    rows = rows[keep.ravel()[rows]]
    return truth.kept(rows) if len(rows) > 3 else hanging(rng)


def spoiled(rng: Generator) -> Truth:
    """Entries that are not what they were."""
    return damaged(as_handed_over(plain_body(rng, few=rng.random() < 0.3), rng, exact=1.0), rng)


BODIES = {
    "body": plain,
    "body-few": few_elements,
    "body-contrast": contrasts,
    "body-smooth": smooth,
    "body-axisymmetric": axisymmetric,
    "body-springs": sprung,
    "body-hanging": hanging,
    "body-damaged": spoiled,
}
