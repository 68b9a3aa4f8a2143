"""The exit status of every way in which a run can end."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, ElementQuad1, ElementVector, MeshQuad, asm
from skfem.models.elasticity import linear_elasticity

from meshes import random_mesh, specimen
from unassemble.errors import (
    FormatError,
    GeometryError,
    MatrixError,
    MatrixFileError,
    NotPlanarError,
    OutputError,
    TopologyError,
    UnassembleError,
)
from vanishing import forgotten, squares


def spoilt(matrix: sp.csr_array) -> sp.coo_array:
    """One entry, with its transpose, half as large again."""
    entries = matrix.tocoo()
    k = np.flatnonzero((entries.row < entries.col) & (np.abs(entries.data) > 0.1))[0]
    i, j = entries.row[k], entries.col[k]
    entries.data[((entries.row == i) & (entries.col == j)) | ((entries.row == j) & (entries.col == i))] *= 1.5
    return entries


def five_point_stencil(rows: int, columns: int) -> sp.csr_array:
    """Of a grid of squares, with the boundary eliminated."""
    one, other = (sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n)) for n in (rows, columns))
    return sp.csr_array(sp.kron(one, sp.eye_array(columns)) + sp.kron(sp.eye_array(rows), other))


def test_0_of_a_grid_that_is_unique_among_grids(work):
    work.write("B.mtx", five_point_stencil(5, 6))
    result = work.recover("--report", "r.json", matrix="B.mtx")
    assert result.exit_code == 0, result.stderr
    report = json.loads((work.folder / "r.json").read_text())
    assert (report["status"], report["uniqueness"]) == ("certified", "conventional")
    assert "other meshes    no other grid of equal cells fits" in result.stdout
    assert "may fit as well" in result.stdout


def test_3_of_a_single_element(work):
    """Of a square, plane strain with both Lame coefficients 1: rows along y of opposite corners can change places."""
    basis = Basis(MeshQuad(), ElementVector(ElementQuad1()))
    work.write("B.mtx", asm(linear_elasticity(1.0, 1.0), basis))
    result = work.recover("--report", "r.json", matrix="B.mtx")
    assert result.exit_code == 3, result.stderr
    report = json.loads((work.folder / "r.json").read_text())
    assert (report["status"], report["uniqueness"]) == ("ambiguous", "ambiguous")
    assert "rows are of one node may be another choice" in report["reason"]
    given = work.recover("--numbering", "interleaved", "--block-size", "2", matrix="B.mtx")
    assert given.exit_code == 0, given.stdout


def test_3_written_but_not_certified(work):
    work.write("B.mtx", spoilt(work.true.matrix))
    result = work.recover("--report", "r.json", "--plot", "p.png", matrix="B.mtx")
    assert result.exit_code == 3, result.stderr
    assert result.stdout.startswith("uncertified: ")
    what, why, following = result.stdout.splitlines()
    assert " give the matrix back to " in what
    assert "(written: mesh.npz, r.json, p.png)" in what
    assert why.startswith("  why   the entry of rows")
    assert ";" not in why
    assert following.startswith("  next  check the entries that stand out")
    assert work.files() == {"A.mtx", "B.mtx", "mesh.npz", "r.json", "p.png"}
    report = json.loads((work.folder / "r.json").read_text())
    assert report["status"] == "uncertified"
    assert report["backward_error"] > 1e-9
    assert report["worst_entries"][0]["misfit"] > 1e-3


def test_3_with_all_details(work):
    work.write("B.mtx", spoilt(work.true.matrix))
    result = work.recover("--debug", matrix="B.mtx")
    assert result.exit_code == 3
    assert "\n  stands out" in result.stdout


def test_3_a_wrong_scale(work):
    result = work.recover("--scale", "-2.9")
    assert result.exit_code == 3
    assert "leave out --scale" in result.stdout


def test_3_is_not_silent_even_if_quiet(work, one_sentence):
    work.write("B.mtx", spoilt(work.true.matrix))
    result = work.recover("--quiet", matrix="B.mtx")
    assert result.exit_code == 3
    assert result.stdout == ""
    assert one_sentence(result).startswith("uncertified: ")


def test_3_of_several_meshes_that_fit(work):
    """Two grids of squares that touch in a vertex: their corners there may as well lie in the gaps between them."""
    mask = np.zeros((4, 4), dtype=bool)
    mask[:2, :2] = mask[2:, 2:] = True
    work.write("B.mtx", forgotten(specimen(*squares(mask))).matrix)
    result = work.recover("--report", "r.json", "--plot", "p.png", matrix="B.mtx")
    assert result.exit_code == 3, result.stderr
    assert result.stdout.startswith("ambiguous: ")
    assert len(result.stdout.splitlines()) == 3
    report = json.loads((work.folder / "r.json").read_text())
    assert (report["status"], report["uniqueness"]) == ("ambiguous", "ambiguous")
    assert report["alternatives"]
    assert report["backward_error"] < 1e-12


def of_low_digits(matrix):
    """As measured, with errors of one standard deviation."""
    entries = sp.triu(matrix, 1).tocoo()
    entries.data += 1e-4 * np.random.default_rng(0).standard_normal(entries.nnz)
    off = entries + entries.T
    return sp.coo_array(off + sp.diags_array(1e-4 * np.arange(off.shape[0]) - off.sum(axis=1)))


UNCERTIFIED = {
    "one entry": (spoilt, ()),
    "noise": (of_low_digits, ()),
    "too little noise": (of_low_digits, ("--noise", "1e-6")),
    "scale": (sp.coo_array, ("--scale", "-2.9")),
    "far away": (sp.coo_array, ("--anchor", "0,1e12,0", "--anchor", "1,1e12,1")),
}


@pytest.mark.slow
@pytest.mark.parametrize("debug", [False, True])
@pytest.mark.parametrize("name", UNCERTIFIED)
def test_3_each_error_is_named_as_absolute_or_relative(work, name, debug):
    spoil, options = UNCERTIFIED[name]
    work.write("B.mtx", spoil(work.true.matrix))
    result = work.recover(*options, *["--debug"] * debug, matrix="B.mtx")
    assert result.exit_code == 3, result.stderr
    assert debug or (";" not in result.stdout and len(result.stdout.splitlines()) == 3)
    named = r" \((absolute|relative)\)| of (each|the) row's largest entry| of it\b| is allowed"
    errors = list(re.finditer(r"[^ ]+e-\d\d+", result.stdout.replace("\n", " ")))
    assert errors
    for one in errors:
        assert re.match(named, one.string[one.end() :]), one.string[one.start() - 60 : one.end() + 60]


BROKEN = {
    "not square": sp.coo_array(np.ones((3, 4))),
    "not symmetric": sp.coo_array(np.array([[2.0, -1, -1], [-3, 2, -1], [-1, -1, 2]])),
    "nan": sp.coo_array(np.array([[2.0, np.nan, -1], [np.nan, 2, -1], [-1, -1, 2]])),
    "diagonal": sp.coo_array(np.eye(4)),
    "not planar": sp.coo_array(np.full((6, 6), -1.0)),
    # A star of nine: right angles at its centre, all that could explain it, have room for four, and thus eight rows.
    "none has its entries": sp.coo_array(-np.array([[0] + [1] * 9, *([[1] + [0] * 9] * 9)], dtype=float)),
}


@pytest.mark.parametrize("what", BROKEN)
def test_4_nothing_to_recover(work, one_sentence, what):
    work.write("B.mtx", BROKEN[what])
    (work.folder / "mesh.npz").write_bytes(b"old")
    result = work.recover("--plot", "p.png", matrix="B.mtx")
    assert result.exit_code == 4, result.stderr
    assert what in one_sentence(result)
    assert result.stdout == ""
    assert (work.folder / "mesh.npz").read_bytes() == b"old"
    assert work.files() == {"A.mtx", "B.mtx", "mesh.npz"}


def test_4_leaves_a_report_where_one_is_wanted(work):
    work.write("B.mtx", BROKEN["not planar"])
    assert work.recover("--report", "r.json", matrix="B.mtx").exit_code == 4
    report = json.loads((work.folder / "r.json").read_text())
    assert report["status"] == "failed"
    assert "not planar" in report["reason"]
    assert work.files() == {"A.mtx", "B.mtx", "r.json"}


def test_4_the_format_cannot_hold_any_mesh(work, one_sentence):
    result = work.recover(out="mesh.node")
    assert result.exit_code == 4
    assert "two files" in one_sentence(result)
    assert work.files() == {"A.mtx"}


def test_4_the_format_cannot_hold_this_mesh(work, one_sentence):
    true = specimen(*random_mesh(100, seed=4))
    n = len(true.points)
    loose = sp.block_diag([true.matrix, sp.coo_array([[1.0]])]).tocoo()
    work.write("L.mtx", loose)
    assert work.recover(matrix="L.mtx").exit_code == 0
    mesh = work.mesh()
    assert mesh["node_status"].tolist() == [0] * n + [1]
    assert np.isnan(mesh["points"][n]).all()
    result = work.recover("--plot", "p.png", "--report", "r.json", matrix="L.mtx", out="mesh.obj")
    assert result.exit_code == 4
    assert f"row {n}" in one_sentence(result)
    assert work.files() == {"A.mtx", "L.mtx", "mesh.npz"}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.mtx", None),
        ("empty.mtx", b""),
        ("cut.mtx", b"%%MatrixMarket matrix coordinate real general\n3 3 9\n1 1 1.0\n"),
        ("text.mtx", b"to be or not to be\n"),
        ("foreign.npz", b"PK\x03\x04 not a zip file"),
        ("image.png", b"\x89PNG\r\n\x1a\n"),
    ],
)
def test_2_not_a_matrix_file(work, one_sentence, name, content):
    if content is not None:
        (work.folder / name).write_bytes(content)
    result = work.recover(matrix=name)
    assert result.exit_code == 2, result.stderr
    assert name in one_sentence(result)
    assert "mesh.npz" not in work.files()


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (MatrixFileError("x is not a matrix"), 2, "x is not a matrix"),
        (OutputError("no such place"), 2, "no such place"),
        (MatrixError("not square"), 4, "not square"),
        (NotPlanarError("not planar"), 4, "not planar"),
        (TopologyError("no triangle"), 4, "no triangle"),
        (GeometryError("two\n  lines"), 4, "two lines"),
        (FormatError("too small"), 4, "too small"),
        (UnassembleError("odd"), 1, "odd"),
        (MemoryError(), 1, "not enough memory"),
        (PermissionError(13, "Permission denied", "A.mtx"), 2, "permission denied"),
        (ZeroDivisionError("by zero"), 1, "internal error, please report it (ZeroDivisionError: by zero)"),
        (EOFError("end"), 1, "internal error, please report it (EOFError: end)"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (SystemExit(7), 7, None),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
@pytest.mark.parametrize("debug", [False, True])
def test_every_exception_has_its_status(work, monkeypatch, capfd, error, status, words, debug):
    def recover(*args, **kwargs):
        raise error

    monkeypatch.setattr("unassemble.recover", recover)
    result = work.recover(*(["--debug"] if debug else []))
    assert result.exit_code == status
    assert ("Traceback" in result.stderr) == (debug and words is not None)
    if words:
        assert result.stderr.strip().splitlines()[-1] == f"unassemble: {words}" or words in result.stderr
    assert work.files() == {"A.mtx"}


def test_a_disk_that_fills_up(work, one_sentence, monkeypatch):
    def full(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("numpy.savez", full)
    result = work.recover()
    assert result.exit_code == 2
    assert "no space left on device" in one_sentence(result)
    assert work.files() == {"A.mtx"}


def test_standard_output_that_cannot_be_written(monkeypatch):
    import io

    from unassemble.cli import status

    class Full(io.StringIO):
        def flush(self):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("sys.stdout", Full())
    with pytest.raises(OutputError, match="standard output: no space left"):
        status.say("text")


def test_warnings_of_libraries_are_not_shown(work, monkeypatch):
    import warnings

    import unassemble

    genuine = unassemble.recover

    def recover(*args, **kwargs):
        warnings.warn("noise", RuntimeWarning, stacklevel=1)
        return genuine(*args, **kwargs)

    monkeypatch.setattr("unassemble.recover", recover)
    result = work.recover()
    assert result.exit_code == 0
    assert result.stderr == ""


def test_demo_runs_where_it_is_told(work, monkeypatch):
    from types import SimpleNamespace

    seen = {}

    def run(folder, *, echo):
        seen["folder"] = folder
        echo("some text")
        return [SimpleNamespace(certified=certified) for certified in seen["certified"]]

    monkeypatch.setattr("unassemble_demo.run", run)
    for certified, status in [([True, True], 0), ([True, False], 3)]:
        seen["certified"] = certified
        result = work.run("demo", "-o", "there")
        assert result.exit_code == status
        assert result.stdout == "some text\n"
        assert seen["folder"] == "there"
