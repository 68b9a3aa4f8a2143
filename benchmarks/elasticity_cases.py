"""What comes back from every kind of element, mesh, material, support, order of the unknowns and storage.

Run ``python benchmarks/elasticity_cases.py``; ``--kinds tet-p1 hex-q1``, ``--supports roller symmetry``, ``--orders
"by component"``, ``--zeros dropped``, ``--meshes structured``, ``--materials one`` choose among the cases, ``--list``
prints each of them. All of it takes more than an hour, linear kinds in one order some minutes: the meshes are small
boxes that scikit-fem assembles.

A place of the table stands for four cases, structured and perturbed meshes of one and of varying material (lambda and
mu of their own), and counts them:

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
from itertools import product
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "elasticity"))
from assembled import ELEMENTS, Assembled, box, heterogeneous, permuted_nodes, stiffness
from supported import ORDERS, SUPPORTS, ZEROS, Given, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.errors import RecoveryError

COUNTS = {"tri-p1": (8, 9), "tri-p2": (6, 7), "quad-q1": (8, 9), "quad-s2": (6, 7),
          "quad-q2": (6, 7), "tet-p1": (5, 6, 7), "hex-q1": (5, 6, 7)}  # fmt: skip
MESHES = {"structured": 0.0, "perturbed": 0.2}
TOLERANCE = 1e-8


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


MATERIALS = {"one": {"lam": 1.5, "mu": 1.0}, "varying": {"lam": heterogeneous, "mu": varying_shear}}


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
    chosen = parser.parse_args()
    start = perf_counter()
    bodies = {one: assembled(*one) for one in product(chosen.kinds, chosen.meshes, chosen.materials)}
    total: Counter = Counter()
    print(f"{'':46}" + "".join(f"{kind:>12}" for kind in chosen.kinds))
    for support, order, zeros in product(chosen.supports, chosen.orders, chosen.zeros):
        line = f"{support + ', ' + order + ', zeros ' + zeros:46}"
        for kind in chosen.kinds:
            found = []
            for mesh, material in product(chosen.meshes, chosen.materials):
                before = perf_counter()
                found.append(outcome(given(bodies[kind, mesh, material], support, order, zeros)))
                if chosen.list:
                    sign, share, words = found[-1]
                    print(f"{sign} {100 * share:3.0f} % missing, {perf_counter() - before:4.1f} s: {kind}, {mesh}, "
                          f"{material}, {support}, {order}, zeros {zeros}: {words}", flush=True)  # fmt: skip
            total.update(sign for sign, *_ in found)
            line += f"{shown(found):>12}"
        print(line, flush=True)
    print(f"{sum(total.values())} cases in {perf_counter() - start:.0f} s: {dict(total)}")


if __name__ == "__main__":
    main()
