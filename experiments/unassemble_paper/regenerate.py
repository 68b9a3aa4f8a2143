"""All figures and tables into one folder."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path

from unassemble.files import made_folder

from .cases import Case, Direct, Run, cases
from .claims import Claim, claims
from .convergence import Comparison, Histories, compare, histories
from .embeddings import RESIDUALS, Embedded, embeddings, rough_angles

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Regenerated:
    """What was measured, and the files written."""

    claims: tuple[Claim, ...]
    comparisons: tuple[Comparison, ...]
    files: tuple[Path, ...]


@dataclass(frozen=True, eq=False)
class Measured:
    """Every number of the tables, and the runs behind the figures."""

    cases: tuple[Case, ...]
    histories: dict[str, Histories]
    rough: dict[str, Run]
    embedded: dict[str, dict[str, Embedded]]
    claims: tuple[Claim, ...]
    comparisons: tuple[Comparison, ...]


def measure(direct: Direct) -> Measured:
    """Run everything; nothing is drawn or written."""
    all_cases = cases()
    runs = {}
    for c in all_cases:
        _log.info("convergence on the mesh of Figure %d", c.figure)
        runs[c.name] = histories(c)
    rough = {c.name: rough_angles(c) for c in all_cases if c.name in RESIDUALS}
    found = {c.name: embeddings(c, rough[c.name].angles) for c in all_cases if c.name in RESIDUALS}
    table = claims(runs, {name: (rough[name].angle_error, found[name]) for name in found})
    comparisons = tuple(row for c in all_cases for row in compare(c, direct))
    return Measured(all_cases, runs, rough, found, tuple(table), comparisons)


def regenerate(directory: str | PathLike[str], direct: Direct) -> Regenerated:
    """Write figure03.png to figure12.png, claims.md, comparison.md and results.json.

    Parameters
    ----------
    directory : path
        Made where it does not exist; files of these names are replaced.
    direct : callable
        The direct method to compare with: piece and weights (e,) to an answer with positions `z`, `scale`, and its
        numbers of `factorisations` and `solves`.
    """
    from . import figures  # drawing is not needed to measure

    folder = made_folder(directory)
    measured = measure(direct)
    cases_of = {c.name: c for c in measured.cases}
    h = measured.histories
    files = [figures.figure_3(measured.cases, folder), *figures.figures_4_to_6(measured.cases, folder)]
    files += [figures.figure_7(h["square"], folder), figures.figure_8(h["ellipse"], h["rocket"], folder)]
    for name, numbers in (("rocket", (9, 11)), ("square", (10, 12))):
        shown = (cases_of[name], measured.rough[name], measured.embedded[name])
        files += figures.figures_9_to_12(*shown, numbers, folder)
    files += _write(folder, measured.claims, measured.comparisons)
    return Regenerated(measured.claims, measured.comparisons, tuple(sorted(files)))


def _write(folder: Path, table: Sequence[Claim], comparisons: Sequence[Comparison]) -> list[Path]:
    texts = {
        "claims.md": claims_table(table),
        "comparison.md": comparison_table(comparisons),
        "results.json": json.dumps(
            {"claims": [asdict(c) for c in table], "comparisons": [asdict(c) for c in comparisons]}, indent=1
        )
        + "\n",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in texts]


def claims_table(table: Sequence[Claim]) -> str:
    """The claims in Markdown."""
    lines = ["| section | the paper says | measured | verdict | why |", "|---|---|---|---|---|"]
    for c in table:
        cells = (c.section, c.says, c.measured, c.verdict, c.why)
        lines.append("| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def comparison_table(rows: Sequence[Comparison]) -> str:
    """The comparison with the direct method in Markdown; ratios are angle method to direct method."""
    lines = [
        "| mesh | angle method | time | products | error | direct: time | solves | error | time ratio | "
        "products per solve | error ratio |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        lines.append(
            f"| {r.mesh} | {r.method} | {1e3 * r.seconds:.0f} ms | {r.products} | {r.error:.0e} "
            f"| {1e3 * r.direct_seconds:.1f} ms | {r.direct_solves} | {r.direct_error:.0e} "
            f"| {r.seconds / r.direct_seconds:.0f} | {r.products / r.direct_solves:.0f} "
            f"| {r.error / r.direct_error:.0e} |"
        )
    return "\n".join(lines) + "\n"
