"""How often cells are told from holes on random meshes, and how long matrices of no mesh keep the search busy.

    python benchmarks/cells.py [--families pierced,crossed,...] [--seeds 60] [--first 0] [--orders 1] [--rows 10000]
                               [--hopeless] [--known-scale]

The meshes are those of tests/families.py, assembled by scikit-fem, vanishing entries dropped, rows in random order, or
in several. An answer counts as right if every edge-connected piece of the mesh comes back to 1e-9 of its diameter, and
with the same cells; certified answers that are not right are listed as WRONG. In brackets stands how other meshes were
excluded.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Iterable
from contextlib import suppress
from itertools import product
from pathlib import Path

import numpy as np
import scipy.sparse as sp

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))


from families import FAMILIES, HOPELESS, member
from meshes import Specimen, largest_error
from unassemble import RecoveryError, recover


def main() -> None:
    """Print a line for each family."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--seeds", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--orders", type=int, default=1, help="of the rows of each mesh, with other factors c")
    parser.add_argument("--rows", type=int, default=10_000, help="leave out larger meshes")
    parser.add_argument("--hopeless", action="store_true", help="only matrices of no mesh")
    parser.add_argument("--known-scale", action="store_true", help="tell the scale")
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    if arguments.hopeless:
        for name in HOPELESS:
            print_hopeless(name, seeds)
        return
    for name in arguments.families.split(","):
        print_family(name, seeds, range(arguments.orders), arguments.rows, known_scale=arguments.known_scale)


def print_family(name: str, seeds: range, orders: range, most: int, *, known_scale: bool) -> None:
    """Outcomes and times on one family; seed 7 in its third order is called 7/2."""
    outcomes: dict[str, list[str]] = defaultdict(list)
    slowest, seconds = "none", [0.0]
    for seed, order in product(seeds, orders):
        known, c = member(name, seed, order)
        if known.matrix.shape[0] > most:
            continue
        start = time.perf_counter()
        case = f"{seed}/{order}" if order else f"{seed}"
        outcomes[outcome(known, c if known_scale else None)].append(case)
        seconds.append(time.perf_counter() - start)
        if seconds[-1] == max(seconds):
            slowest = f"{seconds[-1]:.1f} s (seed {case}, {known.matrix.shape[0]} rows)"
    counts = ", ".join(f"{key} {len(value)}" for key, value in sorted(outcomes.items()))
    print(f"{name}: {counts}; median {np.median(seconds[1:] or seconds):.2f} s, slowest {slowest}")
    for key in sorted(key for key in outcomes if not key.startswith("certified")):
        print(f"    {key}: {' '.join(outcomes[key])}")
    sys.stdout.flush()


def outcome(known: Specimen, scale: float | None) -> str:
    """In a word."""
    try:
        found = recover(known.matrix, scale=scale)
    except RecoveryError:
        return "refused"
    if not found.certified:
        return found.status
    wrong = [rows for rows in pieces(known.triangles) if error(found.points[rows], known.points[rows]) > 1e-9]
    polygons = np.split(found.polygons_data, found.polygons_offsets[1:-1]) if found.n_polygons else []
    if wrong or cells(found.triangles, polygons, known.matrix) != cells(known.triangles, [], known.matrix):
        return "WRONG"
    return f"certified ({found.uniqueness})"


def cells(triangles: np.ndarray, polygons: Iterable[np.ndarray], matrix: sp.csr_array) -> set[frozenset[int]]:
    """Vertices of what is left where entries have vanished: cells that share such an edge are one."""
    parts = [list(map(int, cell)) for cell in (*triangles, *polygons)]
    across: dict[frozenset[int], list[int]] = defaultdict(list)
    for k, cell in enumerate(parts):
        for i, j in zip(cell, cell[1:] + cell[:1], strict=True):
            if not matrix[i, j]:
                across[frozenset((i, j))].append(k)
    pairs = np.array([both for both in across.values() if len(both) == 2], dtype=int).reshape(-1, 2)
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(parts), len(parts)))
    whole: dict[int, set[int]] = defaultdict(set)
    for cell, label in zip(parts, sp.csgraph.connected_components(graph, directed=False)[1], strict=True):
        whole[int(label)].update(cell)
    return {frozenset(vertices) for vertices in whole.values()}


def error(points: np.ndarray, true: np.ndarray) -> float:
    """Infinite where there are no positions."""
    return largest_error(points, true) if np.isfinite(points).all() else np.inf


def pieces(triangles: np.ndarray) -> list[np.ndarray]:
    """Vertices of each edge-connected piece."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, side = np.unique(sides, axis=0, return_inverse=True)
    incidence = sp.coo_array((np.ones(len(sides)), (np.arange(len(sides)) // 3, side.ravel()))).tocsr()
    count, label = sp.csgraph.connected_components(incidence @ incidence.T, directed=False)
    return [np.unique(triangles[label == k]) for k in range(count)]


def print_hopeless(name: str, seeds: range) -> None:
    """Times until a matrix of no mesh is refused."""
    for n in (20, 60, 200, 600):
        if name == "dodecahedron" and n > 20:
            break
        seconds, certified = [], 0
        for seed in seeds:
            matrix = HOPELESS[name](n, seed)
            start = time.perf_counter()
            with suppress(RecoveryError):
                certified += recover(matrix).status == "certified"
            seconds.append(time.perf_counter() - start)
        print(f"{name}, {n} rows: median {np.median(seconds):.2f} s, slowest {max(seconds):.2f} s", end="")
        print(f"; certified {certified}" if certified else "", flush=True)


if __name__ == "__main__":
    main()
