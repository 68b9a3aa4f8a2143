"""The page that shows the tables.

``python -m unassemble_paper.page PAGE RESULTS`` writes the tables of a results.json into a page, each between
``<!-- table: NAME -->`` and ``<!-- end of table -->``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from pathlib import Path

from unassemble_paper.tables import Table, read

_PLACE = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def filled(page: str, tables: Iterable[Table]) -> str:
    """A page with its tables replaced.

    Raises
    ------
    KeyError
        If the page has a place for a table that does not exist.
    """
    texts = {t.name: t.markdown() for t in tables}
    return _PLACE.sub(lambda place: f"{place[1]}\n{texts[place[2]]}\n{place[3]}", page)


if __name__ == "__main__":
    page, results = map(Path, sys.argv[1:])
    page.write_text(filled(page.read_text(encoding="utf-8"), read(results)), encoding="utf-8")
