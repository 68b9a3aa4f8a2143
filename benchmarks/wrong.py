"""Random matrices that lack something: whether a point is ever called determined that is wrong.

    OMP_NUM_THREADS=1 python benchmarks/wrong.py [--cases 400] [--first 0]

Meshes of 25 to 500 vertices (jittered, of random points, drawn out, graded, lattices moved a little, with holes) get
conditions at random: rows of the boundary taken out, all of them, or on one side, or rows inside; identity rows; Robin
terms, also of another factor on each edge; convection; errors of 3e-15 to 1e-8 in the entries; two materials; bent into
space; random entries at the rim. Printed are counts for each condition, and the largest error of a determined point
after the best similarity, relative to the diameter of its piece. Exit status 1 where one is above 1e-8.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.spatial import Delaunay
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "boundaries")]

from conditions import convected, eliminated, identity_rows, largest_error_of, mesh_of, robin, shuffled  # noqa: E402
from test_conditions import cotangents  # noqa: E402

from meshes import random_mesh  # noqa: E402
from unassemble import RecoveryError, recover  # noqa: E402

WRONG = 1e-8
MESHES = ("jittered", "random", "drawn out", "graded", "squares", "triangles")
TAKEN = ("boundary", "one side", "identity", "Robin", "many factors", "convection", "noise")
OTHERS = ("rows inside", "two materials", "bent", "random rim")


def main() -> int:
    """Print what came of each condition."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    counts: dict[str, Counter] = defaultdict(Counter)
    errors: dict[str, float] = defaultdict(float)
    for seed in range(arguments.first, arguments.first + arguments.cases):
        rng = np.random.default_rng(seed)
        mesh, condition = random_domain(rng), str(rng.choice(TAKEN + OTHERS))
        matrix, points = taken(mesh, condition, rng) if condition in TAKEN else other(mesh, condition, rng)
        try:
            found = recover(matrix, operator="laplacian")
        except RecoveryError:
            counts[condition]["refused"] += 1
            continue
        counts[condition][found.status] += 1
        known = found.node_status == 0
        if found.certified and known.sum() > 2:
            error = largest_error_of(found, points, known)
            errors[condition] = max(errors[condition], error)
            if error > WRONG:
                print(f"WRONG: seed {seed}, {condition}, {len(points)} rows, error {error:.0e}", flush=True)
    for condition, count in counts.items():
        print(f"{condition:14s} {dict(count)}, largest error {errors[condition]:.0e}")
    print(sum(sum(count.values()) for count in counts.values()), "cases, largest error", f"{max(errors.values()):.0e}")
    return int(max(errors.values()) > WRONG)


def random_domain(rng: np.random.Generator) -> MeshTri:
    """A mesh of any kind."""
    kind, n = rng.choice(MESHES), int(np.exp(rng.uniform(np.log(25), np.log(500))))
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
    triangles = Delaunay(points).simplices
    a, b, c = (points @ [1, 1j])[triangles].T
    longest = np.abs([b - a, c - b, a - c]).max(axis=0)
    solid = np.abs((np.conj(b - a) * (c - a)).imag) > 1e-7 * longest**2
    if rng.integers(4) == 0:
        middle = points[triangles].mean(axis=1) / np.ptp(points)
        solid &= np.linalg.norm(middle - rng.uniform(0.3, 0.7, 2), axis=1) > 0.15
    used, triangles = np.unique(triangles[solid], return_inverse=True)
    return mesh_of(points[used], triangles.reshape(-1, 3))


def taken(mesh: MeshTri, condition: str, rng: np.random.Generator) -> tuple[sp.csr_array, np.ndarray]:
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


def other(mesh: MeshTri, condition: str, rng: np.random.Generator) -> tuple[sp.csr_array, np.ndarray]:
    """Another operator, or random entries; the boundary taken out of two in three of them."""
    x, y = mesh.p
    factor = np.ones(mesh.nelements)
    if condition == "two materials":
        turn = rng.uniform(0, 2 * np.pi)
        beyond = (np.cos(turn) * x + np.sin(turn) * y)[mesh.t].mean(axis=0) > rng.uniform(-0.2, 0.2)
        factor = np.where(beyond, 1 + 10 ** rng.uniform(-9, 0.5), 1.0)
    if condition == "bent":
        bent = 10 ** rng.uniform(-6, 0) * np.sin(3 * x + rng.uniform(0, 6)) * np.cos(2 * y)
        matrix = cotangents(np.stack([x, y, bent]), mesh.t)
    else:
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


if __name__ == "__main__":
    sys.exit(main())
