"""Planar recovery in units of one direct solve with the same matrix, by stage, with growth and memory.

    python benchmarks/planar.py [--sizes 10000,100000,1000000] [--repeat 3] [--only CASE] [--output FILE.json]

Every case runs in a process of its own, so that its peak memory is its own. The unit is PARDISO's
(or SuperLU's) analysis, Cholesky factorisation and one solve of the same Laplacian with one vertex held. The
peer is PyAMG: set-up and solution to 1e-10 of the same system by smoothed aggregation and conjugate gradients.
All times are medians over repetitions, in which the cases take turns; behind them stand the least and the largest
ratio to the direct solve of the same turn.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import scipy.sparse as sp

CASES = ("direct solve", "pyamg", "c = 1", "c unknown", "c unknown, polished")


def main() -> None:
    """Print a table of ratios; write all figures where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="10000,100000,1000000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", choices=CASES[1:], action="append", help="measure this case; may be repeated")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep the matrices there, and use those kept")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.case:
        print(json.dumps(measure(arguments.case, arguments.folder)))
        return
    sizes = [int(float(size)) for size in arguments.sizes.split(",")]
    cases = [case for case in CASES if case == CASES[0] or case in (arguments.only or CASES)]
    results = [run_size(size, arguments.repeat, cases, arguments.keep) for size in sizes]
    print_growth(results)
    if arguments.output:
        arguments.output.write_text(json.dumps(results, indent=1) + "\n")


def run_size(size: int, repeat: int, cases: list[str], keep: Path | None) -> dict:
    """Cases at one size, taking turns."""
    with tempfile.TemporaryDirectory() as name:
        folder = keep / str(size) if keep else Path(name)
        if not (folder / "true.npy").exists():
            write_matrices(size, folder)
        vertices = len(np.load(folder / "true.npy", mmap_mode="r"))
        runs: dict[str, list[dict]] = {case: [] for case in cases}
        for _ in range(repeat):
            for case in cases:
                runs[case].append(in_own_process(case, folder))
    result = {"vertices": vertices, "cases": {case: summarise(runs[case]) for case in cases}}
    print_table(result)
    return result


def write_matrices(size: int, folder: Path) -> None:
    """L and a multiple of it, and the true positions."""
    from irregular import irregular_mesh, laplacian

    folder.mkdir(parents=True, exist_ok=True)
    points, triangles = irregular_mesh(size)
    for c, file in ((1.0, "plain"), (-3.7e4, "scaled")):
        matrix, true = laplacian(points, triangles, c)
        sp.save_npz(folder / f"{file}.npz", matrix, compressed=False)
    np.save(folder / "true.npy", true)


def in_own_process(case: str, folder: Path) -> dict:
    """One measurement in a fresh interpreter."""
    command = [sys.executable, __file__, "--case", case, "--folder", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{case} failed:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def measure(case: str, folder: Path) -> dict:
    """Time one case, matrix in memory to result in memory, and read the process's peak memory."""
    warm_up()
    matrix = sp.load_npz(folder / ("plain.npz" if case in CASES[:3] else "scaled.npz"))
    if case == "direct solve":
        stages = direct_solve(matrix)
    elif case == "pyamg":
        stages = pyamg_solve(matrix)
    else:
        stages = recovery(matrix, np.load(folder / "true.npy"), refine="polished" in case)
    stages["peak_bytes"] = peak_bytes()
    return stages


def warm_up() -> None:
    """Load the libraries: that is start-up, not work."""
    from unassemble import recover

    recover(np.array([[1.0, -0.5, -0.5], [-0.5, 1.0, -0.5], [-0.5, -0.5, 1.0]]))


def peak_bytes() -> int:
    """Peak resident memory of this process; getrusage would count the parent's before exec as well."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def direct_solve(matrix: sp.csr_array) -> dict:
    """The unit: the best real factorisation that the same solver has for this matrix."""
    from unassemble.linalg import UpperTriangle, factorisation

    upper = sp.triu(matrix[:-1, :-1], format="csr")
    upper.sort_indices()
    rhs = np.random.default_rng(0).standard_normal(upper.shape[0])
    start = time.perf_counter()
    held = UpperTriangle(upper.data, upper.indices, upper.indptr)
    factor = factorisation(held, definite=True)
    analysed = time.perf_counter()
    factor.factorise(held)
    factored = time.perf_counter()
    factor.solve(rhs)
    end = time.perf_counter()
    stages = {"analyse": analysed - start, "factorise": factored - analysed, "solve": end - factored}
    return {"seconds": end - start, "stages": stages}


def pyamg_solve(matrix: sp.csr_array) -> dict:
    """The peer."""
    import pyamg

    held = sp.csr_matrix(matrix[:-1, :-1])
    rhs = np.random.default_rng(0).standard_normal(held.shape[0])
    start = time.perf_counter()
    solver = pyamg.smoothed_aggregation_solver(held, symmetry="symmetric")
    built = time.perf_counter()
    residuals: list[float] = []
    solver.solve(rhs, tol=1e-10, accel="cg", residuals=residuals, maxiter=500)
    end = time.perf_counter()
    return {
        "seconds": end - start,
        "stages": {"set-up": built - start, "solve": end - built},
        "iterations": len(residuals) - 1,
    }


def recovery(matrix: sp.csr_array, true: np.ndarray, *, refine: bool) -> dict:
    """Matrix in memory to mesh in memory, certificate included."""
    from unassemble import recover

    start = time.perf_counter()
    found = recover(matrix, refine=refine)
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "stages": dict(found.timings),
        "backward_error": found.backward_error,
        "status": found.status,
        "error": largest_error(found.points, true),
    }


def largest_error(points: np.ndarray, true: np.ndarray) -> float:
    """Largest distance after the best similarity or reflection, relative to the diameter of the true mesh."""
    target = (true - true.mean(axis=0)) @ [1, 1j]
    source = (points - points.mean(axis=0)) @ [1, 1j]
    fits = [s * (np.vdot(s, target) / np.vdot(s, s)) for s in (source, np.conj(source))]
    return float(min(np.abs(fit - target).max() for fit in fits) / (2 * np.abs(target).max()))


def summarise(runs: list[dict]) -> dict:
    """Medians of times and memory; the rest from the last run."""
    summary = dict(runs[-1])
    summary["every"] = [run["seconds"] for run in runs]
    summary["seconds"] = median(summary["every"])
    summary["peak_bytes"] = median(run["peak_bytes"] for run in runs)
    summary["stages"] = {name: median(run["stages"][name] for run in runs) for name in runs[-1]["stages"]}
    return summary


def print_table(result: dict) -> None:
    """Ratios to the direct solve."""
    unit = result["cases"]["direct solve"]
    print(f"\n{result['vertices']} vertices; one direct solve = 1")
    for case, figures in result["cases"].items():
        ratios = [own / one for own, one in zip(figures["every"], unit["every"], strict=True)]
        line = f"  {case:22s} time {figures['seconds'] / unit['seconds']:6.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        line += f"   peak memory {figures['peak_bytes'] / unit['peak_bytes']:5.2f}"
        if "error" in figures:
            line += f"   largest error {figures['error']:.0e}   {figures['status']} ({figures['backward_error']:.0e})"
        print(line)
        parts = [f"{name} {seconds / unit['seconds']:.2f}" for name, seconds in figures["stages"].items()]
        print(f"  {'':22s} {', '.join(parts)}", flush=True)


def print_growth(results: list[dict]) -> None:
    """Exponent p of cost ~ v^p between successive sizes and over all of them."""
    if len(results) < 2:
        return
    vertices = np.log([result["vertices"] for result in results])
    print("\ngrowth of time as a power of the number of vertices (least squares; largest between neighbours)")
    for case in results[0]["cases"]:
        seconds = np.log([result["cases"][case]["seconds"] for result in results])
        slope = np.polyfit(vertices, seconds, 1)[0]
        steps = np.diff(seconds) / np.diff(vertices)
        print(f"  {case:22s} {slope:.2f}   ({steps.max():.2f})")


if __name__ == "__main__":
    main()
