"""Make ``notebook.ipynb`` of ``notebook.md``: code blocks become cells to run, the text between them becomes text.

python docs/make_notebook.py
"""

from __future__ import annotations

import json
import re
from pathlib import Path

FOLDER = Path(__file__).parent
BLOCK = re.compile(r"^```(pycon|python)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def cells(page: str) -> list[dict]:
    """Cells of a notebook."""
    page = re.sub(r"^The same as a notebook.*\n\n", "", page, flags=re.MULTILINE)
    result, end = [], 0
    for match in BLOCK.finditer(page):
        result += _text(page[end : match.start()])
        result.append(_code(match[2], interactive=match[1] == "pycon"))
        end = match.end()
    return result + _text(page[end:])


def _text(text: str) -> list[dict]:
    return [_cell("markdown", text.strip())] if text.strip() else []


def _code(text: str, *, interactive: bool) -> dict:
    if interactive:  # without what is printed
        text = "\n".join(line[4:] for line in text.splitlines() if line.startswith((">>> ", "... ")))
    return _cell("code", text.strip()) | {"execution_count": None, "outputs": []}


def _cell(kind: str, text: str) -> dict:
    return {"cell_type": kind, "metadata": {}, "source": text.splitlines(keepends=True)}


def notebook(page: str) -> str:
    """The notebook of a page, as JSON."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {"cells": cells(page), "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    (FOLDER / "notebook.ipynb").write_text(notebook((FOLDER / "notebook.md").read_text(encoding="utf-8")), "utf-8")
