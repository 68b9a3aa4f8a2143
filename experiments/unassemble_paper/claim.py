"""One claim of the paper, beside what is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .tables import Table, table

Verdict = Literal["holds", "holds in part", "fails"]


@dataclass(frozen=True)
class Claim:
    """One row of the table.

    Attributes
    ----------
    key : str
    section : str
    says, measured, why : str
    verdict : {"holds", "holds in part", "fails"}
    numbers : tuple of float
        The measured numbers, for tests.
    """

    key: str
    section: str
    says: str
    measured: str
    verdict: Verdict
    why: str
    numbers: tuple[float, ...]


def claims_table(claims: Sequence[Claim]) -> Table:
    """All claims."""
    rows = [(c.section, c.says, c.measured, c.verdict, c.why) for c in claims]
    return table("claims", ("section", "the paper says", "measured", "verdict", "why"), rows)


def each(values: Sequence[object], form: str = "{}") -> str:
    """Values with commas between them."""
    return ", ".join(form.format(v) for v in values)
