"""How far rounding bends slender bodies: coordinates of free strips, as charts leave them and with one more step.

Run ``python benchmarks/slender.py``; options ``--lengths 601 2001``, ``--kinds tri-p1 quad-q1``. A strip has so many
nodes by 3, of about equal distances. Errors are the largest of any node, relative to the diameter; the gap is the
singular value of the first field that bends it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))

from assembled import ELEMENTS, box, error, stiffness

from unassemble.elasticity import recover_elasticity


def line(kind: str, length: int) -> str:
    """Recover one strip, with and without the step, and put the errors into words."""
    case = stiffness(kind, box(kind, (length, 3), stretch=(0.53 * length, 1)), lam=1.5)
    found = recover_elasticity(case.matrix, cells=False)
    with patch("unassemble.elasticity.nullspace.placing.affordable", return_value=False):
        charts = recover_elasticity(case.matrix, cells=False)
    before, after = error(charts.points, case.points), error(found.points, case.points)
    taken = "not taken" if (found.points == charts.points).all() else f"{after:.0e}"
    gap = found.evidence[0].gap
    return f"{kind:8} {length:6d} x 3 nodes: gap {gap:.1e}, charts {before:.0e}, with the step {taken}, {found.status}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lengths", nargs="+", type=int, default=[601, 2001, 6001, 20001])
    parser.add_argument("--kinds", nargs="+", default=["tri-p1", "quad-q1"], choices=ELEMENTS)
    chosen = parser.parse_args()
    for kind in chosen.kinds:
        for length in chosen.lengths:
            print(line(kind, length), flush=True)


if __name__ == "__main__":
    main()
