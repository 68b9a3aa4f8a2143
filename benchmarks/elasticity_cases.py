"""What comes back from every kind of element, mesh, material, support, order of the unknowns and storage.

Run ``python benchmarks/elasticity_cases.py``; ``--kinds tet-p1 hex-q1``, ``--supports roller symmetry``, ``--orders
"boundary first"``, ``--zeros dropped``, ``--meshes structured``, ``--materials one`` choose among the cases, ``--list``
prints each of them as it ends, ``--jobs 8`` runs as many side by side. All of it takes hours of one processor, linear
kinds in one order some minutes: the meshes are small boxes that scikit-fem assembles.

A place of the table stands for four cases, structured and perturbed meshes of one material and of material that varies
within cells (lambda and mu of their own), and counts them:

    =    certified, every node, error below 1e-8 of the diameter
    =12  the same, but up to 12 % of the nodes have no coordinates (NaN, node_status 1)
    ~    right to 1e-8 but uncertified; ~12 with up to 12 % of the nodes without coordinates
    -    refused
    ?    uncertified, and some nodes wrong
    !    certified, and some nodes wrong: must not happen
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from itertools import product
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))
from assembled import ELEMENTS, Assembled, box, heterogeneous, permuted_nodes, recover_elasticity, stiffness
from supported import ORDERS, SUPPORTS, ZEROS, Given, given, judged

from unassemble.errors import RecoveryError

COUNTS = {"tri-p1": (8, 9), "tri-p2": (6, 7), "quad-q1": (8, 9), "quad-s2": (6, 7),
          "quad-q2": (6, 7), "tet-p1": (5, 6, 7), "hex-q1": (5, 6, 7)}  # fmt: skip
MESHES = {"structured": 0.0, "perturbed": 0.2}
TOLERANCE = 1e-8


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


MATERIALS = {"one": {"lam": 1.5, "mu": 1.0}, "varying": {"lam": heterogeneous, "mu": varying_shear, "within": True}}


@cache
def assembled(kind: str, mesh: str, material: str) -> Assembled:
    shape = box(kind, COUNTS.get(kind, (4, 5, 4)), perturb=MESHES[mesh])
    return permuted_nodes(stiffness(kind, shape, **MATERIALS[material]), seed=1)


def outcome(case: Given) -> tuple[str, float, str]:
    """Sign, share of nodes without coordinates, and what was said."""
    try:
        found = recover_elasticity(case.matrix)
    except RecoveryError as error:
        return "-", 1.0, f"{type(error).__name__}: {error}"
    truth = judged(found, case)
    right = truth.error <= TOLERANCE
    sign = {(True, True): "=", (True, False): "~", (False, False): "?", (False, True): "!"}[right, found.certified]
    return sign, truth.missing, f"error {truth.error:.0e}, {truth.split} split; {found.reason}"


def timed_outcome(kind: str, mesh: str, material: str, support: str, order: str, zeros: str):
    """What comes back from one matrix, and the seconds that it took."""
    start = perf_counter()
    return outcome(given(assembled(kind, mesh, material), support, order, zeros)), perf_counter() - start


def shown(outcomes: list[tuple[str, float, str]]) -> str:
    """Counts of signs, and the largest share of nodes missing under each."""
    count = Counter(sign for sign, *_ in outcomes)
    parts = []
    for sign in "=~-?!":
        if count[sign]:
            worst = max(round(100 * share) for one, share, _ in outcomes if one == sign)
            often = "" if len(count) == 1 else str(count[sign])
            parts.append(f"{often}{sign}{worst if worst and sign not in '-' else ''}")
    return " ".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser()
    choices = {"kinds": ELEMENTS, "meshes": MESHES, "materials": MATERIALS, "supports": SUPPORTS, "orders": ORDERS,
               "zeros": ZEROS}  # fmt: skip
    for name, values in choices.items():
        parser.add_argument(f"--{name}", nargs="+", choices=list(values), default=list(values))
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    chosen = parser.parse_args()
    start = perf_counter()
    # Quadratic solids take longest: they come first, so that no process is left alone with them at the end.
    cases = list(product(reversed(chosen.kinds), chosen.meshes, chosen.materials, chosen.supports, chosen.orders,
                         chosen.zeros))  # fmt: skip
    outcomes = {}
    with ProcessPoolExecutor(chosen.jobs) as pool:
        runs = {pool.submit(timed_outcome, *case): case for case in cases}
        for run in as_completed(runs):
            (sign, share, words), seconds = run.result()
            outcomes[runs[run]] = sign, share, words
            if chosen.list:
                kind, mesh, material, support, order, zeros = runs[run]
                print(f"{sign} {100 * share:3.0f} % missing, {seconds:4.1f} s: {kind}, {mesh}, {material}, {support}, "
                      f"{order}, zeros {zeros}: {words}", flush=True)  # fmt: skip
    print(f"{'':46}" + "".join(f"{kind:>12}" for kind in chosen.kinds))
    for given_as in product(chosen.supports, chosen.orders, chosen.zeros):
        line = "{}, {}, zeros {}".format(*given_as)
        print(f"{line:46}" + "".join(
            f"{shown([outcomes[kind, *body, *given_as] for body in product(chosen.meshes, chosen.materials)]):>12}"
            for kind in chosen.kinds))  # fmt: skip
    total = Counter(sign for sign, *_ in outcomes.values())
    print(f"{len(outcomes)} cases in {perf_counter() - start:.0f} s: {dict(total)}")


if __name__ == "__main__":
    main()
