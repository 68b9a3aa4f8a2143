"""Figures 7 and 8: the convergence histories, and the direct method on the same matrices."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

from unassemble.paper import distance, least_squares_layout

from .cases import Case, Direct, Run
from .tables import Table, table


@dataclass(frozen=True, eq=False)
class Histories:
    """The runs of one mesh, all from pi/3 and c = 1, to a residual of 1e-6.

    Attributes
    ----------
    case : Case
    newton : Run
        (7), every system solved accurately.
    paper : Run
        Forcing 1.1^-i, c unknown.
    dembo : Run
        Forcing 2^-i, c unknown.
    known, dembo_known : Run
        The same with c known.
    sines : Run
        Forcing 1.1^-i, c unknown, with the products of sines.
    newton_sines : Run
        (7) with the products of sines.
    today : Run
        Eisenstat and Walker's forcing with the products of sines.
    """

    case: Case
    newton: Run
    paper: Run
    dembo: Run
    known: Run
    dembo_known: Run
    sines: Run
    newton_sines: Run
    today: Run


def histories(case: Case) -> Histories:
    """Run them all."""
    return Histories(
        case=case,
        newton=case.run("newton", max_products=40_000),
        paper=case.run("1.1^-i"),
        dembo=case.run("2^-i"),
        known=case.run("1.1^-i", scale_free=False),
        dembo_known=case.run("2^-i", scale_free=False),
        sines=case.run("1.1^-i", sines=True),
        newton_sines=case.run("newton", sines=True),
        today=case.run("eisenstat-walker", sines=True),
    )


@dataclass(frozen=True)
class Comparison:
    """The angle method and the direct method on one matrix; both find c, and both try c = 1 first.

    Attributes
    ----------
    mesh, method : str
        Which angle method.
    seconds, products, error : float
        Of the angle method with the least-squares layout: processor time, products with J and its transpose, distance
        from the true mesh relative to its diameter.
    direct_seconds, direct_solves, direct_error : float
        Of the direct method; its solves take the place of products.
    """

    mesh: str
    method: str
    seconds: float
    products: int
    error: float
    direct_seconds: float
    direct_solves: int
    direct_error: float


def compare(case: Case, direct: Direct) -> list[Comparison]:
    """The paper's iteration, and the same with the products of sines, beside the direct method."""
    direct(case.piece, case.weights)  # the first call pays for loading the solver
    begin = time.process_time()
    answer = direct(case.piece, case.weights)
    direct_seconds = time.process_time() - begin
    rows = []
    for method, sines in (("1.1^-i", False), ("1.1^-i with sines", True)):
        begin = time.process_time()
        run = case.run("1.1^-i", sines=sines)
        z = least_squares_layout(case.piece, run.angles)
        seconds = time.process_time() - begin
        rows.append(
            Comparison(
                case.name,
                method,
                seconds,
                run.result.products,
                distance(z, case.truth),
                direct_seconds,
                answer.solves,
                distance(answer.z, case.truth),
            )
        )
    return rows


def forcing_table(runs: Iterable[Histories]) -> Table:
    """The paper's forcing beside that of Dembo, Eisenstat and Steihaug."""
    rows = [
        [
            f"Figure {r.case.figure}", known, rule, run.result.history.steps_to(1e-3), run.outer, run.inner,
            run.residual, run.angle_error,
        ]
        for r in runs
        for known, rule, run in (
            ("known", "1.1^-i", r.known), ("known", "2^-i", r.dembo_known),
            ("unknown", "1.1^-i", r.paper), ("unknown", "2^-i", r.dembo),
        )
    ]  # fmt: skip
    columns = ("mesh", "c", "forcing", "inner steps to three orders", "outer steps to 1e-6", "inner steps to 1e-6",
               "residual", "angle error")  # fmt: skip
    return table("forcing", columns, rows)


def comparison_table(rows: Iterable[Comparison]) -> Table:
    """Beside the direct method; ratios are angle method to direct method."""
    return table(
        "comparison",
        ("mesh", "angle method", "time", "products", "error", "direct: time", "solves", "error", "time ratio",
         "error ratio"),
        [
            (
                r.mesh, r.method, f"{1e3 * r.seconds:.0f} ms", r.products, r.error, f"{1e3 * r.direct_seconds:.1f} ms",
                r.direct_solves, r.direct_error, f"{r.seconds / r.direct_seconds:.0f}", r.error / r.direct_error,
            )
            for r in rows
        ],
    )  # fmt: skip
