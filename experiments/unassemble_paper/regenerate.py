"""All figures and tables into one folder."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path

from .cases import Case, Direct, cases
from .claim import Claim, claims_table
from .claims import iteration_claims
from .claims_geometry import geometry_claims
from .convergence import Comparison, Histories, compare, comparison_table, forcing_table, histories
from .embeddings import RESIDUALS, Embeddings, over_all_roots, roots_table
from .false_solutions import rate_table, wheel_table
from .growth import counts_table, growth_table
from .sensitivity import damping_table, inner_tolerance_table, large_table
from .square_systems import square_table
from .tables import Table

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Regenerated:
    """What was measured, and the files written."""

    claims: tuple[Claim, ...]
    comparisons: tuple[Comparison, ...]
    tables: tuple[Table, ...]
    files: tuple[Path, ...]


@dataclass(frozen=True, eq=False)
class Measured:
    """The runs behind claims and figures."""

    cases: tuple[Case, ...]
    histories: dict[str, Histories]
    embedded: dict[str, Embeddings]
    claims: tuple[Claim, ...]
    comparisons: tuple[Comparison, ...]

    @property
    def tables(self) -> tuple[Table, ...]:
        """Tables of these runs."""
        return (
            claims_table(self.claims),
            comparison_table(self.comparisons),
            forcing_table(self.histories.values()),
            roots_table(self.embedded),
        )


LONGER: dict[str, Callable[[tuple[Case, ...]], Table]] = {
    "counts": counts_table,
    "false-wheel": lambda _: wheel_table(),
    "false-rate": lambda _: rate_table(),
    "inner-tolerance": lambda all_cases: inner_tolerance_table(all_cases[0]),
    "damping": lambda _: damping_table(),
    "large": lambda _: large_table(),
    "square": square_table,
    "growth": lambda _: growth_table(),
}
"""Experiments of their own, some minutes together."""


def measure(direct: Direct) -> Measured:
    """Run what claims and figures need; nothing is drawn or written."""
    all_cases = cases()
    runs = {}
    for c in all_cases:
        _log.info("convergence on the mesh of Figure %d", c.figure)
        runs[c.name] = histories(c)
    embedded = {c.name: over_all_roots(c) for c in all_cases if c.name in RESIDUALS}
    claims = (*iteration_claims(runs), *geometry_claims(embedded))
    comparisons = tuple(row for c in all_cases for row in compare(c, direct))
    return Measured(all_cases, runs, embedded, claims, comparisons)


def regenerate(directory: str | PathLike[str], direct: Direct, *, longer: bool = True) -> Regenerated:
    """Write figure02.png to figure12.png, every table as Markdown, and results.json.

    Parameters
    ----------
    directory : path
        Made where it does not exist; files of these names are replaced.
    direct : callable
        The direct method to compare with: piece and weights (e,) to an answer with positions `z`, `scale`, and its
        numbers of `factorisations` and `solves`.
    longer : bool
        Run the experiments of :data:`LONGER` too.
    """
    from . import figures  # drawing is not needed to measure

    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    measured = measure(direct)
    tables = [*measured.tables]
    for name, experiment in LONGER.items() if longer else ():
        _log.info("experiment %s", name)
        tables.append(experiment(measured.cases))
    files = figures.all_figures(measured.cases, measured.histories, measured.embedded, folder)
    results = {"claims": [asdict(c) for c in measured.claims], "tables": [asdict(t) for t in tables]}
    texts = {f"{t.name}.md": t.markdown() for t in tables}
    texts["results.json"] = json.dumps(results, indent=1, ensure_ascii=False) + "\n"
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
        files.append(folder / name)
    return Regenerated(measured.claims, measured.comparisons, tuple(tables), tuple(sorted(files)))
