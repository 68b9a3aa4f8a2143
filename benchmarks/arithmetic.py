"""Other arithmetic: kernels, threads and solvers that round differently, and matrices that differ in the last bits.

    python benchmarks/arithmetic.py [--only NAME ...] [-- ARGUMENTS OF PYTEST]

runs the tests that are marked `arithmetic`, or what the arguments say, once under each of the arithmetics below, each
in a fresh process. Libraries choose their kernels when they are loaded, by the processor or by the environment. What
would run here is asked first: an arithmetic that this processor does not have, or that is the same here as one before
it, is left out, and a sentence says so.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

ROOT = Path(__file__).parents[1]

#: What is set in the environment, by name. The first is the processor's own choice with one thread.
ENVIRONMENTS: dict[str, dict[str, str]] = {
    "plain": {},
    "MKL_CBWR=COMPATIBLE": {"MKL_CBWR": "COMPATIBLE"},
    "MKL_CBWR=AVX2": {"MKL_CBWR": "AVX2"},
    "MKL_CBWR=AVX512": {"MKL_CBWR": "AVX512"},
    "OPENBLAS_CORETYPE=Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "OPENBLAS_CORETYPE=SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "OPENBLAS_CORETYPE=Zen": {"OPENBLAS_CORETYPE": "Zen"},
    "OPENBLAS_CORETYPE=Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "two threads": {"OMP_NUM_THREADS": "2", "MKL_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"},
    "UNASSEMBLE_SOLVER=superlu": {"UNASSEMBLE_SOLVER": "superlu"},
}

#: What chooses an arithmetic, and is not inherited from the environment that this runs in.
CHOOSES = ("MKL_CBWR", "MKL_ENABLE_INSTRUCTIONS", "OPENBLAS_CORETYPE", "UNASSEMBLE_SOLVER")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

#: Prints the kernels of each OpenBLAS that is loaded (numpy and scipy bring one each), MKL's branch, and the threads.
ASK = """
import ctypes, json, os
import numpy, scipy.linalg, threadpoolctl
from unassemble.linalg import backend
blas = sorted(f"{one['internal_api']} {one.get('architecture', '')}" for one in threadpoolctl.threadpool_info())
branch = None
if backend() == "pardiso":
    from pypardiso.pardiso_wrapper import PyPardisoSolver
    branch = PyPardisoSolver().libmkl.MKL_CBWR_Get(1)
print(json.dumps([blas, branch, backend(), os.environ["OMP_NUM_THREADS"]]))
"""


def main() -> int:
    """Run the tests under each arithmetic; the exit status is 1 where any fail."""
    ours = sys.argv[1:]
    told = ours[ours.index("--") + 1 :] if "--" in ours else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=ENVIRONMENTS, default=list(ENVIRONMENTS))
    arguments = parser.parse_args(ours[: len(ours) - len(told) - ("--" in ours)])
    command = [sys.executable, "-m", "pytest", "-q", *(told or ["-m", "arithmetic and not slow", "tests"])]
    failed = []
    for name in distinct(arguments.only):
        start = time.monotonic()
        status = subprocess.run(command, cwd=ROOT, env=environment(name), check=False).returncode
        print(f"{name}: {'passed' if status == 0 else 'FAILED'} in {time.monotonic() - start:.0f} s", flush=True)
        failed += [name] * (status != 0)
    return int(bool(failed))


def environment(name: str) -> dict[str, str]:
    """The whole environment of a process with an arithmetic."""
    inherited = {key: value for key, value in os.environ.items() if key not in CHOOSES}
    return inherited | ONE_THREAD | ENVIRONMENTS[name]


def distinct(names: list[str]) -> Iterator[str]:
    """Those that this processor has, each once; a sentence about each that is left out."""
    seen: dict[str, str] = {}
    for name in names:
        answer = subprocess.run(
            [sys.executable, "-c", ASK], env=environment(name), capture_output=True, text=True, check=False
        )
        runs = answer.stdout.strip()
        if answer.returncode != 0:
            print(f"{name} is left out: this processor or installation does not have it.", flush=True)
        elif runs in seen:
            print(f"{name} is left out: it computes here as {seen[runs]} does.", flush=True)
        else:
            seen[runs] = name
            blas, branch, solver, threads = json.loads(runs)
            mkl = "" if branch is None else f", MKL branch {branch}"
            print(f"{name}: {', '.join(blas)}{mkl}, {solver}, threads: {threads}", flush=True)
            yield name


def perturbed(matrix: sp.sparray, seed: int = 0) -> sp.csr_array:
    """Each entry moved by one unit in the last place, up, down or not at all; symmetric entries stay symmetric."""
    given = sp.coo_array(matrix)
    if not np.issubdtype(given.dtype, np.inexact):
        given = given.astype(np.float64)
    row, column = given.coords
    pair = np.minimum(row, column).astype(np.int64) * given.shape[1] + np.maximum(row, column)
    pairs, place = np.unique(pair, return_inverse=True)
    step = np.random.default_rng(seed).integers(-1, 2, len(pairs))[place].astype(given.data.real.dtype)
    moved = given.data + step * np.spacing(given.data.real) * (given.data != 0)
    return sp.csr_array(sp.coo_array((moved, (row, column)), shape=given.shape))


if __name__ == "__main__":
    sys.exit(main())
