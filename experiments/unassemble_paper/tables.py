"""Tables as data, as Markdown, and in the page that shows them.

``python -m unassemble_paper.tables PAGE RESULTS`` writes the tables of a results.json into a page, each between
``<!-- table: NAME -->`` and ``<!-- end of table -->``.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

Cell = str | int | float | None

_PLACE = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


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


def filled(page: str, tables: Iterable[Table]) -> str:
    """A page with its tables replaced.

    Raises
    ------
    KeyError
        If the page has a place for a table that does not exist.
    """
    texts = {t.name: t.markdown() for t in tables}
    return _PLACE.sub(lambda place: f"{place[1]}\n{texts[place[2]]}\n{place[3]}", page)


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


if __name__ == "__main__":
    page, results = map(Path, sys.argv[1:])
    page.write_text(filled(page.read_text(encoding="utf-8"), read(results)), encoding="utf-8")
