"""What each option of ``recover`` does to the mesh that is written."""

from __future__ import annotations

import io
import json

import meshio
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from meshes import largest_error, random_mesh, specimen, triangle_set


def test_certified_result(work):
    result = work.recover()
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("certified: ")
    assert "written         mesh.npz" in result.stdout
    assert result.stderr == ""
    mesh = work.mesh()
    assert triangle_set(mesh["triangles"]) == triangle_set(work.true.triangles)
    assert largest_error(mesh["points"], work.true.points) < 1e-12
    np.testing.assert_allclose(mesh["scale"], [-3], rtol=1e-12)
    assert work.files() == {"A.mtx", "mesh.npz"}


def test_mesh_report_and_picture(work):
    result = work.recover("--report", "r.json", "--plot", "p.png", out="mesh.vtu")
    assert result.exit_code == 0, result.stderr
    assert work.files() == {"A.mtx", "mesh.vtu", "r.json", "p.png"}
    report = json.loads((work.folder / "r.json").read_text())
    assert report["status"] == "certified"
    assert report["n_cells"] == len(work.true.triangles)
    assert report["backward_error"] < 1e-12
    mesh = meshio.read("mesh.vtu")
    assert largest_error(mesh.points[:, :2], work.true.points) < 1e-12
    assert (work.folder / "p.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("out", ["mesh.obj", "mesh.msh", "mesh.stl", "mesh.vtu", "mesh.npz"])
def test_files_that_cannot_hold_the_status_are_said_so(work, out):
    said = work.recover(out=out).stdout
    assert ("has no place for status" in said) == out.endswith((".obj", ".stl"))


def test_from_standard_input(work):
    result = work.recover(matrix="-")  # nothing there
    assert result.exit_code == 2
    result = work.run("recover", "-", "-o", "mesh.npz", stdin=(work.folder / "A.mtx").read_bytes())
    assert result.exit_code == 0, result.stderr
    assert largest_error(work.mesh()["points"], work.true.points) < 1e-12


def test_variable_of_a_mat_file(work):
    scipy.io.savemat("A.mat", {"K": work.true.matrix.tocsc(), "other": sp.eye(3, format="csc")})
    assert work.recover("--variable", "K", matrix="A.mat").exit_code == 0
    assert len(work.mesh()["points"]) == len(work.true.points)
    assert work.recover("--variable", "missing", matrix="A.mat").exit_code == 2


def test_known_negative_scale(work):
    result = work.recover("--scale", "-3")
    assert result.exit_code == 0, result.stderr
    assert work.mesh()["scale"].tolist() == [-3]
    assert work.recover("--scale", "-3.1").exit_code == 3


@pytest.mark.parametrize("words", [["--anchor", "3,{3}", "--anchor", "40,{40}", "--anchor", "77,{77}"]])
def test_anchors_put_the_mesh_where_it_was(work, words):
    filled = [w if "{" not in w else w.split(",")[0] + "," + _xy(work, int(w.split(",")[0])) for w in words]
    result = work.recover(*filled)
    assert result.exit_code == 0, result.stderr
    np.testing.assert_allclose(work.mesh()["points"], work.true.points, atol=1e-11)


def _xy(work, row: int) -> str:
    return ",".join(repr(float(x)) for x in work.true.points[row])


@pytest.mark.parametrize("orientation", ["anchors", "direction"])
def test_tensor(work, orientation):
    true = specimen(*random_mesh(220, seed=12), tensor=(4.0, -0.5, 1.0), c=2.0)
    work.write("K.mtx", true.matrix)
    work.true = true
    if orientation == "anchors":
        words = [word for row in (0, 50, 100) for word in ("--anchor", f"{row},{_xy(work, row)}")]
    else:
        line = true.points[50] - true.points[0]
        side = np.cross(np.append(line, 0), np.append(true.points.mean(axis=0) - true.points[0], 0))[2]
        words = ["--direction", f"0,50,{np.degrees(np.arctan2(line[1], line[0]))}"]
        words += ["--handed", "left" if side > 0 else "right"]
    result = work.recover("--tensor", "4,-0.5,1", *words, matrix="K.mtx")
    assert result.exit_code == 0, result.stderr
    assert largest_error(work.mesh()["points"], true.points) < 1e-11


def test_noise_and_standard_deviations(work):
    rng = np.random.default_rng(7)
    noise = sp.triu(work.true.matrix, k=1).tocoo()
    noise.data = 1e-6 * rng.standard_normal(len(noise.data))
    work.write("N.mtx", work.true.matrix + noise + noise.T)
    result = work.recover("--noise", "1e-6", "--standard-deviations", "--report", "r.json", matrix="N.mtx")
    assert result.exit_code == 0, result.stderr
    report = json.loads((work.folder / "r.json").read_text())
    assert report["chi_square"]["sigma"] == 1e-6
    assert 1e-8 < report["largest_standard_deviation"] < 1e-3
    assert "std deviation" in result.stdout
    assert work.recover("--noise", "1e-9", matrix="N.mtx").exit_code in (3, 4)


def test_without_the_polish(work):
    for words, stages in ([], {"polish", "conformal"}), (["--no-refine"], {"conformal"}):
        assert work.recover("--report", "r.json", *words).exit_code == 0
        timings = json.loads((work.folder / "r.json").read_text())["timings"]
        assert {"polish", "conformal"} & set(timings) == stages


def test_options_that_name_the_only_choice(work):
    assert work.recover("--operator", "laplacian", "--method", "conformal", "--threads", "1").exit_code == 0
    assert work.recover("--operator", "auto").exit_code == 0


@pytest.mark.parametrize("place", ["before the file", "after", "with a value", "with an equals sign"])
def test_drop_zeros_does_not_swallow_a_file_name(work, place):
    crowded = work.true.matrix.tocoo()
    last = crowded.shape[0] - 1
    row = np.append(crowded.row, [0, last])  # an edge that is none
    column = np.append(crowded.col, [last, 0])
    data = np.append(crowded.data, [1e-14, 1e-14])
    work.write("Z.mtx", sp.coo_array((data, (row, column)), shape=crowded.shape))
    words = {
        "before the file": ["recover", "--drop-zeros", "Z.mtx", "-o", "mesh.npz"],
        "after": ["recover", "Z.mtx", "-o", "mesh.npz", "--drop-zeros"],
        "with a value": ["recover", "--drop-zeros", "1e-10", "Z.mtx", "-o", "mesh.npz"],
        "with an equals sign": ["recover", "--drop-zeros=1e-10", "Z.mtx", "-o", "mesh.npz"],
    }[place]
    result = work.run(*words)
    assert result.exit_code == 0, result.stderr
    assert "forgotten" in result.stdout
    assert triangle_set(work.mesh()["triangles"]) == triangle_set(work.true.triangles)


def test_quiet(work):
    result = work.recover("--quiet")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")


def test_settings_reach_the_library(work, monkeypatch):
    seen = {}

    def recover(matrix, **options):
        seen.update(options, matrix=matrix)
        raise MemoryError

    monkeypatch.setattr("unassemble.recover", recover)
    work.recover("--no-refine", "--anchor", "3,-1,2", "--anchor", "4,1e-3,0", "--handed", "left", "--threads", "2")
    seen.pop("progress")
    assert seen == {
        "matrix": "A.mtx",
        "operator": "auto",
        "method": None,
        "refine": False,
        "scale": None,
        "noise": None,
        "drop_zeros": None,
        "anchors": ((3, -1.0, 2.0), (4, 0.001, 0.0)),
        "tensor": None,
        "direction": None,
        "handed": "left",
        "standard_deviations": False,
        "triangulate": False,
        "block_size": None,
        "numbering": None,
        "realise": False,
        "mass": None,
        "variable": None,
        "threads": 2,
    }


def test_summary_goes_to_a_pipe_that_closes(work, monkeypatch):
    class Closed(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

        def fileno(self):
            return 99

    from unassemble.cli import status

    duplicated = []
    monkeypatch.setattr("os.dup2", lambda *pair: duplicated.append(pair))
    monkeypatch.setattr("sys.stdout", Closed())
    status.say("text")
    assert duplicated[0][1] == 99
