"""Digits lost to Poisson's ratio near one half and to grading: coordinates and elements of cubes.

Run ``python benchmarks/elasticity_accuracy.py``; options ``--kinds``, ``--ratios``, ``--gradings``, ``--size``. A
grading of g puts the vertices of each edge at the g-th powers of equal steps. Errors are the largest of any node,
relative to the diameter; that of Poisson's ratio is absolute. Free bodies, inner vertices moved at random.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))

from assembled import ELEMENTS, box, error, recover_elasticity, stiffness

from unassemble.errors import RecoveryError


def line(kind: str, size: int, grading: float, nu: float) -> str:
    """Recover one cube and put the errors into words."""
    dim = 2 if kind.startswith(("tri", "quad")) else 3
    mesh = box(kind, (size if dim == 3 else size * size // 2,) * dim, perturb=0.1, grading=grading)
    given = stiffness(kind, mesh, lam=2 * nu / (1 - 2 * nu), mu=1.0)
    steps = np.diff(np.unique(mesh.p[0][np.all((mesh.p[1:] < 1e-12), axis=0)]))
    text = f"{kind:8} {len(given.points):6d} nodes, steps 1:{steps.max() / steps.min():<5.0f} nu {nu:<8g}"
    try:
        found = recover_elasticity(given.matrix)
    except RecoveryError as failure:
        return f"{text} {failure}"
    ratio = "not one number" if found.poisson_ratio is None else f"{abs(found.poisson_ratio - nu):.0e}"
    return (
        f"{text} {found.status}, coordinates {error(found.points, given.points):.0e}, Poisson's ratio {ratio}, "
        f"gap {found.evidence[0].gap:.0e}, cells {found.n_cells} of {len(given.cells)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", default=["tri-p1", "quad-q1", "tet-p1", "hex-q1"], choices=ELEMENTS)
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.3, 0.499, 0.49999])
    parser.add_argument("--gradings", nargs="+", type=float, default=[1.0, 2.0, 3.0])
    parser.add_argument("--size", type=int, default=8, help="vertices per edge in space")
    chosen = parser.parse_args()
    for kind in chosen.kinds:
        for grading in chosen.gradings:
            for nu in chosen.ratios:
                print(line(kind, chosen.size, grading, nu), flush=True)


if __name__ == "__main__":
    main()
