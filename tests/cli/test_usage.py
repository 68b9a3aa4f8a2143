"""Values and combinations that are refused at the door, with status 2 and one sentence."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
import scipy.sparse as sp
from click.testing import CliRunner

from unassemble import InputError, recover
from unassemble.cli import main, spelled_out

BAD = [
    (["--scale", "0"], "finite nonzero number"),
    (["--scale", "nan"], "finite nonzero number"),
    (["--scale", "two"], "'two' is not a valid float"),
    (["--noise", "0"], "positive standard deviation"),
    (["--noise", "-1e-3"], "positive standard deviation"),
    (["--noise", "inf"], "positive standard deviation"),
    (["--drop-zeros", "-1"], "at least 0 and below 1"),
    (["--drop-zeros", "nan"], "at least 0 and below 1"),
    (["--drop-zeros=few"], "'few' is not a valid float"),
    (["--anchor", "3,1"], "not of the form ROW,X,Y"),
    (["--anchor", "3,1,2,3,4"], "not of the form ROW,X,Y"),
    (["--anchor", "3,1,2,3"], "three coordinates"),
    (["--operator", "laplacian", "--block-size", "2"], "vector-valued"),
    (["--block-size", "5"], "'5'"),
    (["--numbering", "random"], "'random'"),
    (["--operator", "elasticity", "--method", "angles"], "--method is for scalar matrices"),
    (["--operator", "elasticity", "--scale", "2"], "--scale is for scalar matrices"),
    (["--operator", "elasticity", "--noise", "1e-3"], "--noise is for scalar matrices"),
    (["--operator", "elasticity", "--standard-deviations"], "--standard-deviations is for scalar"),
    (["--anchor", "-3,1,2"], "rows count from 0"),
    (["--anchor", "3.5,1,2"], "not of the form ROW,X,Y"),
    (["--anchor", "3,1,inf"], "not a finite number"),
    (["--anchor", "3,1,x"], "not of the form ROW,X,Y"),
    (["--anchor", "3,1,2", "--anchor", "3,4,5"], "row 3 is anchored twice"),
    (["--anchor", "99999,1,2"], "row 99999"),
    (["--tensor", "1,2,1", "--direction", "0,1,0", "--handed", "left"], "not positive definite"),
    (["--tensor", "-1,0,-1", "--direction", "0,1,0", "--handed", "left"], "not positive definite"),
    (["--tensor", "1,0", "--direction", "0,1,0", "--handed", "left"], "KXX,KXY,KYY"),
    (["--tensor", "2,0,1"], "three --anchor that are not in line, or --direction and --handed"),
    (["--tensor", "2,0,1", "--direction", "0,1,30"], "--handed"),
    (["--tensor", "2,0,1", "--anchor", "0,0,0", "--anchor", "1,1,1"], "--handed"),
    (
        ["--tensor", "2,0,1", "--anchor", "0,0,0", "--anchor", "1,1,1", "--anchor", "2,3,3"],
        "the mirror image is open",
    ),
    (["--handed", "left"], "needs a line"),
    (["--handed", "up", "--direction", "0,1,30"], "'up'"),
    (["--direction", "0,1"], "ROW,ROW,DEGREES"),
    (["--direction", "0,0,30"], "rows that differ"),
    (["--direction", "0,1,30", "--anchor", "0,0,0", "--anchor", "1,1,1"], "fix the same freedom"),
    (["--operator", "heat"], "'heat'"),
    (["--method", "metric"], "'metric'"),
    (["--threads", "0"], "x>=1"),
    (["--report", "r.html"], "a report is a .json file"),
    (["--report", "r.txt"], ".json"),
    (["--report", "no/r.json"], "no folder"),
    (["--plot", "p.jpg"], ".png"),
    (["--plot", "no/p.png"], "no folder"),
    (["--plot", "mesh.svg", "--report", "mesh.json", "--bogus"], "--bogus"),
    (["extra"], "extra"),
]


@pytest.mark.parametrize(("words", "why"), BAD, ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_refused(work, one_sentence, words, why):
    result = work.recover(*words)
    assert result.exit_code == 2, (result.stdout, result.stderr)
    assert why in one_sentence(result)
    assert result.stdout == ""
    assert work.files() == {"A.mtx"}


@pytest.mark.parametrize(
    ("out", "why"),
    [
        ("mesh", "extension"),
        ("mesh.xyz", "extension"),
        ("no/mesh.vtu", "no folder"),
        (".", "it is a folder, so name a file in it"),
        ("-", "extension"),
    ],
)
def test_no_such_output(work, one_sentence, out, why):
    result = work.recover(out=out)
    assert result.exit_code == 2
    assert why in one_sentence(result)


def test_a_folder_in_place_of_a_matrix(work, one_sentence):
    (work.folder / "in").mkdir()
    result = work.run("in")
    assert result.exit_code == 2
    assert "cannot be opened: is a directory" in one_sentence(result)


@pytest.mark.parametrize("words", [["A.mtx"], ["recover", "A.mtx"], ["recover", "./A.mtx"]])
def test_the_mesh_goes_beside_the_matrix_where_nothing_is_said(work, one_sentence, words):
    result = work.run(*words)
    assert result.exit_code == 0, result.stderr
    assert "A.vtu" in result.stdout
    assert work.files() == {"A.mtx", "A.vtu"}
    written = (work.folder / "A.vtu").read_bytes()
    result = work.run(*words)
    assert result.exit_code == 2
    assert "'A.vtu' is there already" in one_sentence(result)
    assert (work.folder / "A.vtu").read_bytes() == written
    assert work.run(*words, "-o", "A.vtu").exit_code == 0


@pytest.mark.parametrize(
    ("words", "out"),
    [
        (["recover", "A.mtx", "mesh.npz"], "mesh.npz"),
        (["A.mtx", "mesh.npz"], "mesh.npz"),
        (["A.mtx", "-o", "mesh.npz", "--quiet"], "mesh.npz"),
        (["in/B.mtx.gz"], "in/B.vtu"),
    ],
)
def test_the_words_recover_and_o_may_be_left_out(work, words, out):
    (work.folder / "in").mkdir()
    (work.folder / "in" / "B.mtx.gz").write_bytes(gzip.compress((work.folder / "A.mtx").read_bytes()))
    result = work.run(*words)
    assert result.exit_code == 0, result.stderr
    assert (work.folder / out).is_file()


def test_areas_go_beside_the_matrix_where_nothing_is_said(work):
    """No mesh format holds them, but .npz; the matrix may have that name."""
    i, j, k = work.true.triangles.T
    every = np.concatenate([[a, b] for a in (i, j, k) for b in (i, j, k)], axis=1)
    masses = sp.coo_array((np.where(every[0] == every[1], 2.0, 1.0), every)).tocsr()
    sp.save_npz(work.folder / "M.npz", masses)
    result = work.run("M.npz")
    assert result.exit_code == 0, result.stderr
    assert "M.mesh.npz" in result.stdout
    np.testing.assert_allclose(work.mesh("M.mesh.npz")["areas"], 12)


def test_standard_input_without_a_name_for_the_mesh(work):
    result = work.run("-", stdin=(work.folder / "A.mtx").read_bytes())
    assert result.exit_code == 0, result.stderr
    assert work.files() == {"A.mtx", "mesh.vtu"}


@pytest.mark.parametrize("name", ["mesh.vtu", "mesh.msh", "mesh.npz", "mesh.off", "mesh.inp", "mesh.obj", "mesh.bdf"])
def test_a_mesh_given_as_a_matrix(work, one_sentence, name):
    assert work.recover(out=name).exit_code == 0
    result = work.run("recover", name, "-o", "again.vtu")
    assert result.exit_code == 2
    sentence = one_sentence(result)
    assert f"{name} is a mesh (" in sentence
    assert "a matrix is asked for" in sentence


def test_a_folder_as_the_mesh(work, one_sentence):
    (work.folder / "out.vtu").mkdir()
    for folder in ("out.vtu", "."):
        result = work.run("A.mtx", folder)
        assert result.exit_code == 2
        assert "it is a folder" in one_sentence(result)


def test_matrix_is_missing(work, one_sentence):
    result = work.run("recover", "-o", "mesh.npz")
    assert result.exit_code == 2
    assert "MATRIX" in one_sentence(result)


@pytest.mark.parametrize(
    "words",
    [
        ["recover", "A.npz", "-o", "A.npz"],
        ["recover", "A.npz", "-o", "./A.npz"],
        ["recover", "A.mtx", "-o", "mesh.svg", "--plot", "mesh.svg"],
    ],
)
def test_one_file_in_two_roles(work, one_sentence, words):
    (work.folder / "A.npz").write_bytes(b"old")
    result = work.run(*words)
    assert result.exit_code == 2
    assert "the same file" in one_sentence(result)
    assert (work.folder / "A.npz").read_bytes() == b"old"


def test_refusals_come_before_the_work(work, monkeypatch):
    def recover(*args, **kwargs):
        raise AssertionError("the work has begun")

    monkeypatch.setattr("unassemble.recover", recover)
    for words in (["--plot", "p.jpg"], ["--report", "no/r.json"]):
        assert work.recover(*words).exit_code == 2
    assert work.recover(out="no/mesh.npz").exit_code == 2
    assert work.recover(out="mesh.node").exit_code == 4


def test_bare_drop_zeros_gets_its_value():
    for words, expected in [
        ("--drop-zeros A.mtx", "--drop-zeros=1e-12 A.mtx"),
        ("A.mtx --drop-zeros", "A.mtx --drop-zeros=1e-12"),
        ("--drop-zeros -o out", "--drop-zeros=1e-12 -o out"),
        ("--drop-zeros 1e-3 A.mtx", "--drop-zeros 1e-3 A.mtx"),
        ("--drop-zeros -1 A.mtx", "--drop-zeros -1 A.mtx"),
        ("--drop-zeros=0 A.mtx", "--drop-zeros=0 A.mtx"),
        ("--drop-zeros -- 5", "--drop-zeros=1e-12 -- 5"),
        ("-- --drop-zeros", "-- --drop-zeros"),
    ]:
        assert spelled_out(words.split()) == expected.split()


@pytest.mark.parametrize(
    "options", [{"tensor": (1, 2, 1)}, {"noise": 0.0}, {"method": ""}, {"handed": "left"}, {"direction": (0, 0, 1.0)}]
)
def test_options_are_checked_before_the_file_is_read(options):
    with pytest.raises(InputError, match=f"`{next(iter(options))}"):
        recover("no such file.mtx", **options)


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["recover", "--help"], ["inspect", "-h"], ["demo", "--help"]])
def test_help(words):
    result = CliRunner().invoke(main, words, prog_name="unassemble")
    assert result.exit_code == 0
    assert result.stdout.startswith("Usage: unassemble")


def test_version():
    from unassemble import __version__

    result = CliRunner().invoke(main, ["--version"])
    assert result.exit_code == 0
    assert __version__ in result.stdout


def test_no_command_shows_help():
    result = CliRunner().invoke(main, [], prog_name="unassemble")
    assert "Commands:" in result.output
    assert "Traceback" not in result.output


def test_unknown_command(one_sentence):
    result = CliRunner().invoke(main, ["unravel"])
    assert result.exit_code == 2
    assert "unravel" in one_sentence(result)
