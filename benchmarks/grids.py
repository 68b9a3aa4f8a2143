"""Structured grids without their zero entries, in units of an arbitrary mesh with as many vertices.

    python benchmarks/grids.py [--vertices 250000] [--repeat 1] [--only KIND]

Recovery from start to end, polish and certificate included, each in a process of its own. The last column is the
largest error, relative to the diameter.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=float, default=250_000)
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--only", choices=KINDS, action="append", help="measure this kind; may be repeated")
    parser.add_argument("--kind", choices=KINDS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.kind:
        print(json.dumps(measure(arguments.kind, int(arguments.vertices))))
        return
    kinds = [kind for kind in KINDS if kind == GENERIC or kind in (arguments.only or KINDS)]
    runs: dict[str, list[dict]] = {kind: [] for kind in kinds}
    for _ in range(arguments.repeat):
        for kind in kinds:
            command = [sys.executable, __file__, "--kind", kind, "--vertices", str(arguments.vertices)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            runs[kind].append(json.loads(done.stdout.splitlines()[-1]))
    unit = median(run["seconds"] / run["vertices"] for run in runs[GENERIC])
    print(f"{'':28}{'vertices':>9} {'cost':>6} {'error':>9}  slowest stages")
    for kind, some in runs.items():
        cost = median(run["seconds"] / run["vertices"] for run in some) / unit
        last = some[-1]
        stages = ", ".join(f"{name} {second:.1f} s" for name, second in last["stages"])
        print(f"{kind:28}{last['vertices']:9} {cost:6.2f} {last['error']:9.1e}  {last['status']}; {stages}")


def meshes(k: int) -> dict:
    """Makers of meshes of about k^2 vertices."""
    from irregular import irregular_mesh

    from vanishing import half_jittered, holes, polar, squares

    rng = np.random.default_rng(0)
    full = np.ones((k, k), bool)
    corner = np.ones((k, k), bool)
    corner[k // 2 :, k // 2 :] = False
    apart = rng.permutation((k // 4) ** 2)[: max(1, k // 2)]
    single = [(4 * (i // (k // 4)) + 1, 4 * (i % (k // 4)) + 1, 1, 1) for i in apart]
    every = range(k // 10, k - k // 6, k // 5)
    blocks = [(i, j, k // 12, k // 20) for i in every for j in every]
    half = int(k / np.sqrt(2))
    return {
        GENERIC: lambda: irregular_mesh(k * k),
        "five-point": lambda: squares(full),
        "rectangles 3 : 1": lambda: squares(full, width=3.0),
        "L-shape": lambda: squares(corner),
        "holes of one square": lambda: squares(holes(k, k, *single)),
        "holes of several": lambda: squares(holes(k, k, *blocks)),
        "slit": lambda: squares(holes(k, k, (k // 10, k // 2, 8 * k // 10, 1))),
        "crossed": lambda: squares(np.ones((half, half), bool), crossed=True),
        "half squares": lambda: half_jittered(k),
        "polar": lambda: polar(k // 2, 2 * k, 0.2),
    }


GENERIC = "arbitrary"
KINDS = (
    GENERIC, "five-point", "rectangles 3 : 1", "L-shape", "holes of one square", "holes of several", "slit", "crossed",
    "half squares", "polar",
)  # fmt: skip


def measure(kind: str, vertices: int) -> dict:
    """One recovery."""
    from meshes import largest_error, specimen
    from unassemble import recover
    from vanishing import forgotten

    known = forgotten(specimen(*meshes(int(np.sqrt(vertices)))[kind](), c=-3.7))
    start = time.perf_counter()
    found = recover(known.matrix)
    seconds = time.perf_counter() - start
    missing = len(known.triangles) - len(found.triangles) - int((np.diff(found.polygons_offsets) - 2).sum())
    return {
        "vertices": len(known.points),
        "seconds": seconds,
        "status": found.status + (f", {missing} triangles missing" if missing else ""),
        "error": largest_error(found.points, known.points),
        "stages": sorted(found.timings.items(), key=lambda stage: -stage[1])[:4],
    }


if __name__ == "__main__":
    main()
