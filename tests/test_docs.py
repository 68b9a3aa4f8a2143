"""The notebook is made of its page, and runs."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import matplotlib as mpl
import pytest

DOCS = Path(__file__).parents[1] / "docs"


def test_the_notebook_is_that_of_its_page():
    make = runpy.run_path(str(DOCS / "make_notebook.py"))
    page = (DOCS / "notebook.md").read_text(encoding="utf-8")
    assert (DOCS / "notebook.ipynb").read_text(encoding="utf-8") == make["notebook"](page)


def test_the_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    content = json.loads((DOCS / "notebook.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    for cell in content["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert names["found"].certified
    assert {path.name for path in tmp_path.iterdir()} == {"report.json", "mesh.vtu"}


@pytest.mark.parametrize("example", sorted((DOCS.parent / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_examples_run(example):
    counts = runpy.run_path(str(example))["main"](vertices=(13, 4, 4))
    assert counts["recovered modes"] < counts["block size"]


def test_the_index_has_user_pages_before_proofs():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    order = [index.index(f"\n{page}\n") for page in ("sources", "notebook", "formats", "theory", "design")]
    assert order == sorted(order)
