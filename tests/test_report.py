from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from handmade import lake, quadratic, solid, two_pieces, verdict, with_loose_row
from unassemble.errors import NotPlanarError, OutputError
from unassemble.report import build_report, check_report, failure_report, write_report
from unassemble.summary import summary, three_lines

STABLE = {
    "status",
    "uniqueness",
    "reason",
    "operator",
    "element",
    "reaction",
    "n_points",
    "n_cells",
    "n_components",
    "n_holes",
    "scale",
    "backward_error",
    "timings",
    "warnings",
}


def uncertified():
    return lake(
        verdict=verdict("uncertified", "the re-assembled matrix differs"),
        backward_error=np.inf,
        worst_entries=np.array([[3, 7], [1, 2]]),
        worst_misfits=np.array([0.5, np.nan]),
        warnings=("look here",),
        chi_square={"statistic": np.float64(12.0), "degrees_of_freedom": 3, "p_value": 0.25, "sigma": 1e-5},
        standard_deviations=np.abs(lake().points),
    )


def test_every_stable_key_with_its_value():
    recovery = with_loose_row(lake(warnings=("a", "b")))
    report = build_report(recovery)
    assert set(report) >= STABLE
    assert report["status"] == "certified"
    assert (report["uniqueness"], report["element"], report["reaction"]) == ("searched", "P1", 0.0)
    assert report["n_points"] == recovery.n_points
    assert report["n_cells"] == len(recovery.triangles)
    assert report["n_holes"] == 2
    assert report["n_undetermined"] == 1
    assert report["n_boundary_edges"] == len(recovery.boundary)
    assert report["scale"] == [2.5]
    assert report["backward_error"] == 1e-15
    assert report["timings"] == {"topology": 0.25, "polish": 1.0}
    assert report["warnings"] == ["a", "b"]
    assert recovery.report() == report


def test_json_knows_every_value_and_infinities_are_null():
    report = json.loads(json.dumps(build_report(uncertified()), allow_nan=False))
    assert report["backward_error"] is None
    assert report["worst_entries"] == [
        {"row": 3, "column": 7, "misfit": 0.5},
        {"row": 1, "column": 2, "misfit": None},
    ]
    assert report["chi_square"] == {"statistic": 12.0, "degrees_of_freedom": 3, "p_value": 0.25, "sigma": 1e-5}
    assert report["largest_standard_deviation"] == np.abs(lake().points).max()


def test_a_failure_has_the_same_keys():
    report = failure_report(NotPlanarError("the graph is not planar"))
    assert set(report) >= STABLE
    assert report["status"] == "failed"
    assert report["reason"] == "the graph is not planar"
    assert report["n_points"] is None


def test_written_report_reads_back(tmp_path):
    path = tmp_path / "REPORT.JSON"
    path.write_text("old")
    write_report(lake(verdict=verdict(reason="größer")), path)
    assert json.loads(path.read_text(encoding="utf-8")) == build_report(lake(verdict=verdict(reason="größer")))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "why"), [("r.html", r"\.json"), ("r.txt", r"\.json"), ("report", r"\.json"), ("no/r.json", "no folder")]
)
def test_what_is_no_report_file(name, why, tmp_path):
    for attempt in (check_report, lambda path: write_report(lake(), path)):
        with pytest.raises(OutputError, match=why):
            attempt(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_summary_of_a_good_result_is_short_and_aligned():
    lines = summary(two_pieces(apart=5)).splitlines()
    assert lines[0].startswith("certified: ")
    rows = {line[2:17].strip(): line[18:] for line in lines[1:]}
    assert rows["pieces"] == "2"
    assert rows["holes"] == "4"
    assert rows["scale c"] == "-1 to 2.5"
    assert rows["backward error"] == "1.0e-15 (relative)"
    assert rows["time"] == "1.25 s (topology 0.25, polish 1)"
    assert len(lines) < 12


def test_summary_says_what_does_not_fit():
    text = summary(uncertified())
    assert text.startswith("uncertified: the re-assembled matrix differs")
    assert "rows 3 and 7, off by 5.0e-01" in text
    assert "look here" in text
    assert "std deviation" in text


def test_summary_tells_of_rows_without_position_and_hinges():
    text = summary(with_loose_row(lake(hinges=np.array([4]))))
    assert "of which 1 not determined" in text
    assert "meeting in 1 hinge\n" in text


@pytest.mark.parametrize(
    ("kind", "element"),
    [("triangle", "P1"), ("tetra10", "P2"), ("quad", "Q1"), ("hexahedron27", "Q2"), ("hexahedron20", "S2")],
)
def test_elements_of_bodies(kind, element):
    body = solid(kind) if kind in ("triangle", "quad") else quadratic(kind)
    assert build_report(body)["element"] == element
    assert build_report(body)["n_holes"] is None


def test_bodies_of_several_elements_or_none():
    body = solid("quad")
    assert replace(body, triangles=np.array([[4, 6, 7]])).element == "mixed"
    assert replace(body, quads=body.quads[:0]).element is None


def test_points_without_cells_do_not_give_a_matrix_back():
    """What is held against the matrix then are equations of the rows away from supports."""
    known = replace(solid("tetra"), verdict=verdict("uncertified", "why"), backward_error=2e-6)
    assert "give the matrix back to 2.0e-06 of each row's largest entry" in three_lines(known)
    bare = three_lines(replace(known, tetrahedra=np.empty((0, 4), np.int64)))
    assert bare.startswith("uncertified: 8 points agree with all rows away from supports to 2.0e-06 (relative)")
    assert "0 cells" not in bare
