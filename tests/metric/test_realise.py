"""Coordinates in space, files and the command line."""

import json
from dataclasses import replace

import meshio
import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner
from scipy.spatial import ConvexHull
from surfaces import largest_error, moebius, sheet, surface

from meshes import random_mesh, specimen, triangle_set
from unassemble import FormatError, recover
from unassemble.cli import main
from unassemble.metric import VARYING, flattened


def lengths_of(found):
    return np.linalg.norm(found.points[found.edges[:, 0]] - found.points[found.edges[:, 1]], axis=1)


@pytest.mark.parametrize("mesh", [moebius(), sheet(12, holes=False)], ids=["moebius", "sheet"])
def test_coordinates_have_the_edge_lengths(mesh):
    found = recover(surface(*mesh).matrix, operator="surface", realise=True)
    misfit = lengths_of(found) - found.edge_lengths
    assert found.realisation["misfit"] == pytest.approx(np.sqrt(np.mean(misfit**2)), rel=1e-9, abs=1e-15)
    assert found.realisation["misfit"] < 1e-3
    assert min(found.realisation["misfits"]) <= found.realisation["misfit"] * (1 + 1e-9) + 1e-15
    assert len(found.realisation["misfits"]) == 4


@pytest.mark.parametrize("n", [12, 150])
def test_convex_surfaces(n):
    """Small ones come back as they were; larger ones have many dented shapes with the same lengths."""
    points = np.random.default_rng(0).standard_normal((n, 3))
    points = points / np.linalg.norm(points, axis=1)[:, None]
    known = surface(points * [1, 1.2, 0.9], ConvexHull(points).simplices.astype(np.int64))
    found = recover(known.matrix, operator="surface", realise=True)
    assert found.realisation["misfit"] < 1e-12
    np.testing.assert_allclose(lengths_of(found), found.edge_lengths, rtol=1e-11)
    if n == 12:  # distances between all points, not along edges only
        of_found, of_true = (np.linalg.norm(p[:, None] - p[None], axis=2) for p in (found.points, known.points))
        np.testing.assert_allclose(of_true.sum() / of_found.sum() * of_found, of_true, atol=1e-12)


def test_same_coordinates_on_every_run():
    matrix = surface(*moebius()).matrix
    one, two = (recover(matrix, operator="surface", realise=True).points for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_files(tmp_path):
    known = surface(*moebius())
    bare = recover(known.matrix, operator="surface")
    bare.save(tmp_path / "m.npz")
    with np.load(tmp_path / "m.npz") as content:
        assert "points" not in content
        assert content["edges"].shape == (len(bare.edges), 2)
        assert content["edge_lengths"].mean() == pytest.approx(1)
        assert set(content) >= {"triangles", "component", "hinges", "scale", "node_status", "curvature"}
        assert not content["node_status"].any()
    with pytest.raises(FormatError, match="edge lengths only"):
        bare.save(tmp_path / "m.vtu")
    assert not (tmp_path / "m.vtu").exists()
    found = recover(known.matrix, operator="surface", realise=True)
    found.save(tmp_path / "m.vtu")
    mesh = meshio.read(tmp_path / "m.vtu")
    np.testing.assert_allclose(mesh.points, found.points)
    np.testing.assert_allclose(mesh.point_data["curvature"], found.curvature)
    assert mesh.point_data["boundary"].sum() == len(found.boundary)
    found.save(tmp_path / "m.stl")
    found.save(tmp_path / "m.npz")
    with np.load(tmp_path / "m.npz") as content:
        assert content["points"].shape == (found.n_points, 3)


def test_flat_surfaces_have_points_in_the_plane(tmp_path):
    known = specimen(*random_mesh(200), c=3.0, diagonal=True)
    found = recover(known.matrix, operator="surface")
    assert found.certified, found.reason
    assert found.dim == 2
    a, b, c = found.points[found.triangles].transpose(1, 0, 2)
    assert (((b - a) * (c - a)[:, ::-1] * [1, -1]).sum(axis=1) > 0).all()
    found.save(tmp_path / "m.npz")
    with np.load(tmp_path / "m.npz") as content:
        assert set(content) >= {"points", "edges", "edge_lengths"}


def test_flat_surfaces_keep_what_was_said_of_their_lengths():
    known = specimen(*random_mesh(100), c=3.0)
    found, planar = (recover(known.matrix, operator=operator) for operator in ("surface", "laplacian"))
    lengths = replace(found, warnings=(*planar.warnings, "a stored zero was left out", VARYING))
    again = flattened(lengths, planar)
    assert again.warnings == (*planar.warnings, "a stored zero was left out")


@pytest.mark.parametrize("realise", [False, True])
def test_command_line(tmp_path, monkeypatch, realise):
    monkeypatch.chdir(tmp_path)
    known = surface(*moebius(12, 3), c=-2.0)
    scipy.io.mmwrite("A.mtx", known.matrix.tocoo(), symmetry="general", precision=17)
    words = ["recover", "A.mtx", "-o", "m.npz", "--operator", "surface", "--report", "r.json", "--plot", "p.png"]
    result = CliRunner().invoke(main, words + ["--realise"] * realise, prog_name="unassemble")
    assert result.exit_code == 0, result.stderr
    assert "one-sided" in result.stdout
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["status"] == "certified"
    assert report["operator"] == "surface laplacian"
    assert report["element"] == "P1"
    assert report["n_holes"] is None
    assert report["euler_characteristic"] == [0]
    assert report["orientable"] == [False]
    assert (report["realisation"] is not None) == realise
    with np.load("m.npz") as content:
        assert triangle_set(content["triangles"]) == triangle_set(known.triangles)
        assert ("points" in content) == realise


def test_no_surface_is_status_four(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = surface(*sheet(8, holes=False))
    scipy.io.mmwrite("A.mtx", known.matrix.tocoo(), symmetry="general", precision=17)
    result = CliRunner().invoke(
        main, ["recover", "A.mtx", "-o", "m.vtu", "--operator", "surface"], prog_name="unassemble"
    )
    assert result.exit_code == 4
    assert "--realise" in result.stderr
    assert not (tmp_path / "m.vtu").exists()


def test_uncertified_surface_is_status_three(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = sheet(8, holes=False)
    known = surface(*mesh, diagonal=np.arange(len(mesh[0]), dtype=float))
    scipy.io.mmwrite("A.mtx", known.matrix.tocoo(), symmetry="general", precision=17)
    result = CliRunner().invoke(
        main, ["recover", "A.mtx", "-o", "m.npz", "--operator", "surface"], prog_name="unassemble"
    )
    assert result.exit_code == 3
    found = recover(known.matrix, operator="surface")
    assert largest_error(found, known.points) <= 1e-11
