"""What the paper's iteration depends on: the inner tolerance, whole steps, the starting guess."""

from __future__ import annotations

from collections.abc import Iterable

from .cases import Case, case_of
from .examples import perforated, ragged
from .tables import Table, table


def inner_tolerance_table(square: Case) -> Table:
    """Newton on the uniform grid, from pi/3 and c = 1 to |F| = 1e-6, each system solved to a tolerance."""
    rows = []
    for power in range(1, 15):
        run = square.run(10.0**-power, max_products=4_000)
        rows.append([f"1e-{power}", run.outer if run.result.converged else None, run.inner, run.residual])
    columns = ("relative residual of each inner system", "Newton steps", "inner steps", "residual")
    return table("inner-tolerance", columns, rows)


def damping_table(seeds: int = 10, side: int = 8) -> Table:
    """Whole and halved steps on lattices with ragged boundaries, with sine products, to 1e-10 in 6,000 products."""
    rows = []
    for scale_free in (False, True):
        for damped in (False, True):
            runs = [
                case_of(ragged(side, seed=seed), "ragged").run(
                    "1.1^-i", tolerance=1e-10, max_products=6_000, scale_free=scale_free, sines=True, damped=damped
                )
                for seed in range(seeds)
            ]
            solved = [seed for seed, run in enumerate(runs) if run.result.converged]
            rows.append([
                "unknown" if scale_free else "known", "halved until the residual falls" if damped else "whole",
                f"{len(solved)} of {seeds}", ", ".join(map(str, solved)) or None,
            ])  # fmt: skip
    return table("damping", ("c", "steps", "converged", "seeds"), rows)


def large_table(sides: Iterable[int] = (39, 99), products: int = 6_000) -> Table:
    """Every start on shaken lattices (seed 0), without and with the sine products, c unknown, to |F| = 1e-6."""
    rows: list[list[str | int | float | None]] = []
    for side in sides:
        large = case_of(perforated(side, 0), "lattice")
        for sines in (False, True):
            for start in ("equal", "barycentric", "weighted"):
                run = large.run("1.1^-i", start=start, sines=sines, max_products=products)
                done = run.result.converged
                rows.append([
                    large.corners.counts.v, "with the products of sines" if sines else "the paper's", start,
                    run.result.products if done else None, run.result.history.residuals[0], run.residual,
                    run.angle_error,
                ])  # fmt: skip
    columns = ("vertices", "equations", "start", "products to 1e-6", "first residual", "least residual", "angle error")
    return table("large", columns, rows)
