"""Tables as data and as Markdown."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

Cell = str | int | float | None


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers.

    Attributes
    ----------
    name : str
    columns : tuple of str
    rows : tuple of tuple
        As many cells as columns in each; floats are shown with two digits, None as a dash.
    """

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def markdown(self) -> str:
        """The table in Markdown."""
        head, rule = map(_shown, self.columns), ("---" for _ in self.columns)
        lines = [tuple(head), tuple(rule), *(tuple(map(_shown, row)) for row in self.rows)]
        return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def table(name: str, columns: Iterable[str], rows: Iterable[Sequence[Cell]]) -> Table:
    """A table of any sequences."""
    return Table(name, tuple(columns), tuple(tuple(row) for row in rows))


def read(results: Path) -> list[Table]:
    """The tables of a results.json."""
    return [table(**item) for item in json.loads(results.read_text(encoding="utf-8"))["tables"]]


def _shown(cell: Cell) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, int):
        return f"{cell:,}"
    if isinstance(cell, float):
        return f"{cell:.2g}" if 1e-3 <= abs(cell) < 100 or cell == 0 else _scientific(cell)
    return cell.replace("|", r"\|")


def _scientific(number: float) -> str:
    if 100 <= abs(number) < 1e4:
        return f"{number:.0f}"
    digits, power = f"{number:.0e}".split("e")
    return f"{digits}e{int(power)}"
