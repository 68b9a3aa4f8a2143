"""The experiments' tables as expected values: what the paper reports, and what is measured here."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from unassemble.planar import conformal_map
from unassemble_paper import regenerate
from unassemble_paper.cases import Case
from unassemble_paper.page import filled
from unassemble_paper.regenerate import LONGER
from unassemble_paper.tables import read, table

DOCS = Path(__file__).parents[2] / "docs"
RESULTS = DOCS / "_static" / "paper" / "results.json"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper") / "new" / "folder"
    result = regenerate(folder, conformal_map, longer=False)
    return SimpleNamespace(result=result, claims={c.key: c for c in result.claims}, folder=folder)


@pytest.mark.slow  # half a minute
def test_files(made):
    tables = ["claims", "comparison", "forcing", "roots"]
    names = {path.name for path in made.result.files}
    assert names == {f"figure{k:02d}.png" for k in range(2, 13)} | {f"{t}.md" for t in tables} | {"results.json"}
    for path in made.result.files:
        assert path.stat().st_size > 500
    for t in made.result.tables:
        assert (made.folder / f"{t.name}.md").read_text(encoding="utf-8") == t.markdown()
    assert [t.name for t in read(made.folder / "results.json")] == tables
    stored = json.loads((made.folder / "results.json").read_text(encoding="utf-8"))
    assert [c["key"] for c in stored["claims"]] == list(made.claims)


def test_the_page_shows_the_results():
    """`python -m unassemble_paper.page docs/paper.md docs/_static/paper/results.json` changes nothing."""
    page, tables = (DOCS / "paper.md").read_text(encoding="utf-8"), read(RESULTS)
    assert filled(page, tables) == page
    for t in tables:
        assert page.count(f"<!-- table: {t.name} -->") == 1
    assert {t.name for t in tables} == {"claims", "comparison", "forcing", "roots", *LONGER}


def test_tables_show_numbers_with_few_digits():
    shown = table("t", ["a|b", "c"], [[None, 1234], ["x|y", 1.26e-7], ["z", 250.4], ["w", 0.0125]])
    lines = shown.markdown().splitlines()
    assert lines[0] == r"| a\|b | c |"
    assert lines[2:] == ["| – | 1,234 |", r"| x\|y | 1e-7 |", "| z | 250 |", "| w | 0.013 |"]
    page = "before\n<!-- table: t -->\nold\n<!-- end of table -->\nafter"
    assert filled(page, [shown]) == f"before\n<!-- table: t -->\n\n{shown.markdown()}\n<!-- end of table -->\nafter"
    with pytest.raises(KeyError):
        filled(page, [])


VERDICTS = {
    "sizes": "holds",
    "newton-grid": "holds",
    "newton-fails": "holds in part",
    "three-orders": "holds in part",
    "reached": "holds",
    "rank-solution": "holds in part",
    "rank-start": "fails",
    "storage": "holds",
    "square": "fails",
    "starts": "fails",
    "factor": "holds in part",
    "forcing": "holds",
    "global": "fails",
    "theorem-1": "fails",
    "theorem-2": "holds",
    "boundary": "holds",
    "bfs": "holds",
    "smoothing": "holds in part",
    "multilevel": "holds",
    "diagonal": "holds",
    "false-roots": "fails",
    "anisotropy": "fails",
    "fixed-point": "fails",
    "substitution": "holds in part",
}

# Lower and upper ends for each measured number: a tenth or two for counts that follow the rounding, exact for ranks.
EXPECTED = {
    "sizes": [(487, 487), (487, 487), (457, 457), (457, 457), (1788, 1788), (1789, 1789)],
    "newton-grid": [(4, 4), (340, 410), (8, 11), (4_000, 9_000), (140, 180), (320, 380), (430, 510)],
    "newton-fails": [(1, 15), (1, 15), (4, 6), (4, 6)],
    "three-orders": [(40, 55), (95, 125), (90, 115), (12, 17), (52, 70), (60, 82)],
    "reached": [(600, 1_300), (7_000, 14_000), (14_000, 25_000), (130, 170), (175, 225), (280, 350)],
    "rank-solution": [(64, 64), (37, 37), (9, 9), (0, 0), (0, 0), (0, 0), (64, 64), (37, 37), (9, 9)],
    "rank-start": [(64, 64), (69, 69), (267, 267)],
    "storage": [(486, 486), (1_356, 1_356), (1_458, 1_458), (456, 456), (1_320, 1_320), (1_368, 1_368),
                (1_788, 1_788), (5_164, 5_164), (5_364, 5_364)],
    "square": [(5, 16), (5, 24), (5, 29)],
    "starts": [(1e-5, 0.1), (0.1, 50), (0.1, 50), (500, 1_000)],
    "forcing": [(4, 6), (4, 6)],
    "global": [(1, 6), (9, 10)],
    "theorem-1": [(1, 1), (0, 0), (-1, -1), (-2, -2), (-3, -3), (251, 251), (252, 252)],
    "theorem-2": [(0, 1e-9)],
    "boundary": [(1.7, 1.9)] * 3 + [(3.5, 3.7)] * 3,
    "factor": [(7, 14), (7, 15), (8, 16)],
    "bfs": [(0.95, 1), (0.01, 0.2)],
    "smoothing": [(0.5, 0.8), (0.98, 1), (5, 120), (0, 3), (500, 10_000), (3, 20)],
    "multilevel": [(0, 0), (0, 0), (4e-4, 5e-3), (5e-3, 6e-2)],
    "diagonal": [(0, 1e-8)] * 3,
    "false-roots": [(3, 3), (1.1033, 1.1034)],
    "anisotropy": [(0, 1e-12), (0.1, 10)],
    "fixed-point": [(2, 20), (1.5, 6)],
    "substitution": [(17_024, 17_024), (25_600, 25_600), (3, 7), (4, 9)],
}  # fmt: skip


@pytest.mark.slow
def test_the_table_is_complete(made):
    assert {key: claim.verdict for key, claim in made.claims.items()} == VERDICTS
    assert set(EXPECTED) == set(VERDICTS)
    for claim in made.claims.values():
        assert claim.says
        assert claim.measured
        assert claim.why


def within(key, numbers):
    return all(low <= number <= high for number, (low, high) in zip(numbers, EXPECTED[key], strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("key", EXPECTED)
def test_measured_numbers(made, key):
    assert within(key, made.claims[key].numbers)


def test_stored_numbers():
    """Those that the page shows are within the same bounds as those measured now."""
    stored = {c["key"]: c for c in json.loads(RESULTS.read_text(encoding="utf-8"))["claims"]}
    assert {key: c["verdict"] for key, c in stored.items()} == VERDICTS
    for key, claim in stored.items():
        assert within(key, claim["numbers"]), key


@pytest.mark.slow
def test_the_direct_method_beside(made):
    rows = made.result.comparisons
    assert [(r.mesh, r.method) for r in rows] == [
        (mesh, method) for mesh in ("square", "ellipse", "rocket") for method in ("1.1^-i", "1.1^-i with sines")
    ]
    for r in rows:
        assert r.direct_error < 1e-11
        assert r.error > 1e3 * r.direct_error
        assert r.products > 50 * r.direct_solves
        assert r.seconds > r.direct_seconds


def test_markdown_tables_have_as_many_cells_everywhere():
    for t in read(RESULTS):
        assert len({line.replace(r"\|", "").count("|") for line in t.markdown().splitlines()}) == 1


def test_cases_have_positive_triangles(own_cases):
    case: Case
    for case in own_cases.values():
        p = case.truth[case.piece.triangles]
        assert (((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag > 0).all()
        assert np.abs(case.angles.reshape(-1, 3).sum(axis=1) - np.pi).max() < 1e-12
