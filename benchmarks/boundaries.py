"""Boundary conditions on third-party meshes: how much comes back, and whether all of it is right.

    python benchmarks/boundaries.py [FOLDER] [--conditions eliminated robin] [--meshes NAME] [--most 3000]
    python benchmarks/boundaries.py --bound [--conditions eliminated identity]
    python benchmarks/boundaries.py --random 20000 100000 [--count 3]
    python benchmarks/boundaries.py ../shared/corpus/quad --element Q1 --conditions eliminated identity

Every mesh of the folder (npz with points and triangles, or quads; ``../shared/corpus/planar`` unless told) gets each
boundary condition as scikit-fem puts it in, in random order of the rows. Printed are the share of the points that are
determined, the largest error among them after the best similarity, relative to the diameter of their piece, and
processor time in direct solves with the same matrix. The last lines count meshes with 70, and with 90 per cent
determined. With ``--random``, meshes of random points around two holes are taken instead, all boundary vertices
eliminated, and the median of several runs is printed, each held against direct solves of its own. Exit status 1 where
a determined point, or the factor of a triangle between three of them, is off by more than 1e-8.

With ``--bound`` nothing is recovered: the share of the points is printed that whole entries determine and check at the
very mesh, to first order, which no method can surpass with these entries.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp
import skfem

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "boundaries")]

from conditions import (  # noqa: E402
    convected,
    determined_factors,
    eliminated,
    identity_rows,
    largest_error_of,
    materials,
    mesh_of,
    parts,
    robin,
)

from meshes import random_mesh  # noqa: E402
from unassemble import RecoveryError, recover  # noqa: E402
from unassemble.boundaries import with_boundary_edges, with_diagonals  # noqa: E402
from unassemble.boundaries.fit import WholeEntries  # noqa: E402
from unassemble.boundaries.judge import determined  # noqa: E402
from unassemble.boundaries.rim import Rim  # noqa: E402
from unassemble.linalg import UpperTriangle, factorisation  # noqa: E402
from unassemble.matrix import check_matrix  # noqa: E402
from unassemble.planar.cotangent import edge_weights  # noqa: E402
from unassemble.topology import Piece  # noqa: E402

CONDITIONS = {
    "eliminated": eliminated,
    "identity": identity_rows,
    "robin": lambda mesh: robin(mesh, 1.0),
    "convection": lambda mesh: symmetric(*convected(mesh, (3.0, -2.0))),
}
MATERIALS = {"two": (1.0, 5.0), "four": (1.0, 3.0, 0.2, 20.0)}
for number, values in MATERIALS.items():
    for outside, function in (("", None), ("-eliminated", skfem.condense), ("-identity", skfem.enforce)):
        CONDITIONS[f"{number}-materials{outside}"] = partial(materials, factors=values, outside=function)
ELEMENTS = {
    "P1": skfem.ElementTriP1(),
    "P2": skfem.ElementTriP2(),
    "P3": skfem.ElementTriP3(),
    "Q1": skfem.ElementQuad1(),
    "Q2": skfem.ElementQuad2(),
}
FEWEST = 20  # rows of matrices that are worth a line
WRONG = 1e-8


def symmetric(matrix, points):
    """Half the matrix and half its transpose."""
    return (matrix + matrix.T) / 2, points


def main() -> int:
    """Print a line for each mesh and condition, and what they add up to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT.parent / "shared" / "corpus" / "planar")
    parser.add_argument("--conditions", nargs="+", choices=CONDITIONS, default=list(CONDITIONS))
    parser.add_argument(
        "--element", choices=ELEMENTS, default="P1", help="those but P1 are eliminated or identity only"
    )
    parser.add_argument("--meshes", nargs="+", help="these only")
    parser.add_argument("--most", type=int, default=10**9, help="vertices of the meshes that are used")
    parser.add_argument("--bound", action="store_true", help="print what the mesh itself determines")
    parser.add_argument("--random", nargs="+", type=int, help="vertices of random meshes, instead of a folder")
    parser.add_argument("--count", type=int, default=3, help="meshes of each of these sizes")
    arguments = parser.parse_args()
    if arguments.random:
        return int(max(timed(n, arguments.count) for n in arguments.random) > WRONG)
    wrong, element = False, ELEMENTS[arguments.element]
    for condition in arguments.conditions:
        shares = []
        put = CONDITIONS[condition] if arguments.element == "P1" else partial(CONDITIONS[condition], element=element)
        for name, mesh in meshes(arguments.folder, arguments.meshes, arguments.most, element.refdom.nnodes):
            matrix, points = put(mesh)
            if matrix.shape[0] < FEWEST:
                continue
            if arguments.bound:
                share, error, line = bound(matrix, points)
            else:
                share, error, line = measured(matrix, points, true_factors(condition, mesh))
            shares.append(share)
            wrong |= error > WRONG
            print(f"{condition:25s} {name:36s} {line}{'   WRONG' if error > WRONG else ''}", flush=True)
        good = [sum(share >= least for share in shares) for least in (0.01, 0.7, 0.9)]
        word = "determined" if arguments.bound else "certified"
        print(f"{condition}: of {len(shares)} meshes {good[0]} {word}, {good[1]} to 70 %, {good[2]} to 90 %\n")
    return int(wrong)


def meshes(folder: Path, names: list[str] | None, most: int, corners: int) -> Iterator:
    """Names and meshes of triangles or quadrilaterals, without vertices of no cell."""
    for file in sorted(folder.glob("*.npz")):
        given = np.load(file)
        cells = given["triangles" if corners == 3 else "quads"].astype(np.int64)
        used, cells = np.unique(cells, return_inverse=True)
        if (names is None or file.stem in names) and len(used) <= most:
            yield file.stem, mesh_of(given["points"][used, :2].astype(float), cells.reshape(-1, corners))


def true_factors(condition: str, mesh: skfem.MeshTri) -> Callable | None:
    """The factor at points (2, k) where there are several."""
    values = MATERIALS.get(condition.split("-")[0])
    return None if values is None else lambda centre: np.array(values)[parts(mesh, len(values))(centre)]


def measured(matrix: sp.csr_array, points: np.ndarray, factor: Callable | None) -> tuple[float, float, str]:
    """Share of the points that are determined, their error or that of factors among them, and all in words."""
    start = time.process_time()
    try:
        found = recover(matrix)
    except RecoveryError as refused:
        return 0.0, 0.0, f"{len(points):6d} rows   refused: {str(refused)[:70]}"
    seconds = time.process_time() - start
    if not found.certified:
        return 0.0, 0.0, f"{len(points):6d} rows   {found.status}: {found.reason[:70]}"
    known = found.node_status == 0
    error = largest_error_of(found, points, known) if known.sum() > 2 else 0.0
    if factor is not None and known.sum() > 2:
        factors, centres = determined_factors(found, points)
        error = max(error, np.abs(factors / factor(centres) - 1).max(initial=0.0))
    solves = f"{seconds / unit(matrix):5.0f} solves" if len(points) > 1000 else ""
    return float(known.mean()), error, f"{len(points):6d} rows   {known.mean():5.0%} error {error:.0e} {solves}"


def bound(matrix: sp.csr_array, points: np.ndarray) -> tuple[float, float, str]:
    """Share of the points that whole entries determine at these positions, no error, and the share in words."""
    given = with_boundary_edges(with_diagonals(check_matrix(matrix)))
    gone = given.incomplete_rows if given.replaced is None else given.replaced
    known = 0
    for piece in given.surfaces.pieces:
        outside = gone[piece.vertices][piece.edges].all(axis=1)
        whole = ~outside if given.replaced is not None else piece.inner | (gone.any() & ~outside)
        rim = Rim(piece, whole, np.ones(len(piece.triangles), dtype=bool))
        z = points[piece.vertices] @ [1, 1j]
        z = z if area(piece, z) > 0 else np.conj(z)
        with np.errstate(all="ignore"):  # edges without a triangle
            fits = np.abs(-given.entries[piece.edge_rows] - edge_weights(piece, z)) < 1e-9
        if not (rim.whole & fits).any():
            continue
        problem = WholeEntries(piece, -given.entries[piece.edge_rows], np.zeros(len(fits), dtype=bool))
        known += int(determined(problem, z, np.ones(1), rim.whole & fits)[0].sum())
    share = known / given.n
    return share, 0.0, f"{given.n:6d} rows   {share:5.0%}"


def area(piece: Piece, z: np.ndarray) -> float:
    """Twice the area of a piece, with its sign."""
    a, b, c = z[piece.triangles].T
    return float((np.conj(b - a) * (c - a)).imag.sum())


def timed(n: int, meshes: int) -> float:
    """Print direct solves that random meshes take, all boundary vertices eliminated; the largest error."""
    solves, shares, error = [], [], 0.0
    for seed in range(1, meshes + 1):
        matrix, points = eliminated(mesh_of(*random_mesh(n, seed=seed)))
        start = time.process_time()
        found = recover(matrix)
        seconds = time.process_time() - start
        solves.append(seconds / np.median([unit(matrix) for _ in range(3)]))
        known = (found.node_status == 0) & found.certified
        shares.append(known.mean())
        error = max(error, largest_error_of(found, points, known))
    times = f"{np.median(solves):.0f} ({min(solves):.0f} to {max(solves):.0f}) solves"
    print(f"random {len(points):6d} rows   {min(shares):.0%} error {error:.0e} {times}", flush=True)
    return error


def unit(matrix: sp.csr_array) -> float:
    """Processor seconds of one direct solve with a definite matrix of this pattern: analysis, factors, solution."""
    off = -abs(sp.triu(matrix, 1) + sp.tril(matrix, -1).T)
    off = off + off.T
    size = abs(off).sum(axis=1)
    upper = sp.triu(off + sp.diags_array(np.where(size > 0, 1.001 * size, 1.0)), format="csr")
    upper.sort_indices()
    held = UpperTriangle(upper.data, upper.indices, upper.indptr)
    start = time.process_time()
    solver = factorisation(held, definite=True)
    solver.factorise(held)
    solver.solve(np.ones(upper.shape[0]))
    seconds = time.process_time() - start
    solver.release()
    return seconds


if __name__ == "__main__":
    sys.exit(main())
