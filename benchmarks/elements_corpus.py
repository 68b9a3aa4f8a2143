"""Scalar matrices of other elements, and with a mass term, on third-party meshes: how many come back, and right.

    python benchmarks/elements_corpus.py [FOLDER] [--cases P2 Q1 mass] [--meshes NAME] [--points 0 3000]

Every mesh of the folders `planar` and `quad` below FOLDER (npz; ``../shared/corpus`` unless told) is assembled by
scikit-fem, with rows in random order: quadratic and cubic triangles, quadrilaterals with four, eight and nine nodes
(four beside triangles), zeros stored and dropped, c = 1e-3 and -1e3; and triangles, linear and quadratic, and
quadrilaterals with c L + s M, s h^2 / c = 1e-3, 1 and 100, h^2 the mean area of cells, twice that of triangles. Printed
are status, largest error of a piece relative to its diameter, and processor time. "Right" has the same cells and an
error of at most 1e-9; rectangles of quadratic triangles, whose matrix is the same for both diagonals where zeros are
dropped, may have another diagonal if the mesh is called ambiguous. Exit status 1 where a certified mesh is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from skfem import MeshQuad, MeshTri

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from conforming.assembled import Assembled, assembled, cell_sets, same_but_for_diagonals  # noqa: E402
from meshes import largest_error_of_pieces, specimen  # noqa: E402
from unassemble import RecoveryError, recover  # noqa: E402

CASES = ("P2", "P3", "Q1", "Q2", "S2", "mass", "P2 mass", "Q1 mass")
FACTORS, RATIOS = (1e-3, -1e3), (1e-3, 1.0, 100.0)
WRONG = 1e-9


def main() -> int:
    """Print a line for each matrix, and what they add up to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT.parent / "shared" / "corpus")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES)
    parser.add_argument("--meshes", nargs="+", help="these only")
    parser.add_argument(
        "--points", type=int, nargs=2, default=(0, 10**9), help="least and most of the meshes that are used"
    )
    arguments = parser.parse_args()
    wrong, sums = 0, []
    for case in arguments.cases:
        right: dict[str, list[bool]] = {}
        for name, meshes in loaded(arguments.folder, case, arguments.meshes, arguments.points):
            for kind, label, known in matrices(case, meshes):
                good, bad, line = judged(known)
                right.setdefault(kind, []).append(good)
                wrong += bad
                print(f"{case:7} {name:30} {label:20} {len(known.points):7,} {line}{'  WRONG' * bad}", flush=True)
        sums += [f"{case:7} {kind:8} {sum(some):4} of {len(some):4} right" for kind, some in right.items()]
    print(*sums, sep="\n")
    return int(wrong > 0)


def loaded(folder: Path, case: str, names: list[str] | None, size: tuple[int, int]) -> Iterator[tuple[str, list]]:
    """Meshes that a case has matrices of."""
    for path in sorted((folder / ("quad" if case[0] in "QS" else "planar")).glob("*.npz")):
        data = np.load(path)
        points = np.ascontiguousarray(data["points"][:, :2].T)
        kinds = {"triangles": MeshTri, "quads": MeshQuad}
        found = [kind(points, np.ascontiguousarray(data[key].T)) for key, kind in kinds.items() if key in data]
        wanted = (not names or path.stem in names) and size[0] <= points.shape[1] <= size[1]
        if wanted and (len(found) == 1 or case == "Q1"):
            yield path.stem, found


def matrices(case: str, meshes: list) -> Iterator[tuple[str, str, Assembled]]:
    """With the group that each is counted in."""
    if "mass" in case:
        for ratio in RATIOS:
            yield f"{ratio:g}", f"s h^2 / c = {ratio:g}", with_mass(meshes[0], ratio, case[:2])
        return
    element = "mixed" if len(meshes) > 1 else case
    for zeros in (True, False):
        for seed, c in enumerate(FACTORS):
            kind = "stored" if zeros else "dropped"
            yield kind, f"c = {c:g}, {kind}", assembled(element, *meshes, c=c, zeros=zeros, seed=seed)


def with_mass(mesh: MeshTri, ratio: float, element: str) -> Assembled:
    """c L + s M, rows at random."""
    if element in ("P2", "Q1"):
        x, y = mesh.p[:, mesh.t]
        areas = np.abs((x * np.roll(y, -1, axis=0) - np.roll(x, -1, axis=0) * y).sum(axis=0)) / 2
        return assembled(element, mesh, c=2.5, reaction=2.5 * ratio / ((2 if element == "P2" else 1) * areas.mean()))
    one = specimen(mesh.p.T, mesh.t.T)
    x, y = one.points[one.triangles].transpose(2, 1, 0)
    areas = np.abs((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) / 2
    n = len(one.points)
    row, column = (np.repeat(one.triangles, 3, axis=1), np.tile(one.triangles, (1, 3)))
    value = np.repeat(areas / 12, 9) * np.tile((np.ones((3, 3)) + np.eye(3)).ravel(), len(areas))
    mass = sp.coo_array((value, (row.ravel(), column.ravel())), shape=(n, n))
    matrix = 2.5 * (one.matrix + ratio / (2 * areas.mean()) * mass)
    return Assembled(sp.csr_array(matrix), one.points, {frozenset(cell) for cell in one.triangles.tolist()})


def judged(known: Assembled) -> tuple[bool, bool, str]:
    """Right, and certified or rightly ambiguous; certified and wrong; in words."""
    start = time.process_time()
    try:
        found = recover(known.matrix)
    except RecoveryError as error:
        return False, False, f"refused    {'':9} {time.process_time() - start:7.1f} s  {error}"[:230]
    seconds = time.process_time() - start
    cells = cell_sets(found)
    ambiguous = found.status == "ambiguous" and found.element == "P2"
    same = same_but_for_diagonals(cells, known.cells) if ambiguous else cells == known.cells
    error = largest_error_of_pieces(found, known.points) if same else np.nan
    good = same and error <= WRONG
    right = good and (found.certified or ambiguous)
    why = "" if right else f"  {found.reason}" + ("" if same else " (other cells)")
    line = f"{found.status:11} {error:9.1e} {seconds:7.1f} s{why[:160]}"
    return right, found.certified and not good, line


if __name__ == "__main__":
    sys.exit(main())
