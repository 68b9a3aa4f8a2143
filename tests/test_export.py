"""Meshes on disk: what comes back is what was written, and nothing is written by halves."""

from __future__ import annotations

import importlib.util
import re
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

from handmade import lake, quadratic, solid, verdict, with_loose_row
from unassemble.elements import KINDS
from unassemble.errors import FormatError, OutputError
from unassemble.exchange import STATUS, UNIQUENESS, to_meshio
from unassemble.export import check_output, save
from unassemble.formats import FORMATS, MeshFormat, lacks_worth
from unassemble.recovery import Recovery

WORKING = [
    suffix for suffix, f in FORMATS.items() if "triangle" in f.cells and f.name and f.keeps_rows and not f.cannot
]
CANNOT = [suffix for suffix, f in FORMATS.items() if f.cannot]


def available(suffix: str) -> MeshFormat:
    mesh_format = FORMATS[suffix]
    if mesh_format.needs and not importlib.util.find_spec(mesh_format.needs):
        pytest.skip(f"{mesh_format.needs} is not installed")
    return mesh_format


def tolerance(mesh_format: MeshFormat) -> float:
    return 10.0 ** (1 - mesh_format.digits) if mesh_format.digits else 4e-16


def read(path: Path, mesh_format: MeshFormat) -> meshio.Mesh:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of meshio's readers
        return meshio.read(path, file_format=mesh_format.name)


@pytest.mark.parametrize("suffix", WORKING)
def test_every_format_gives_back_the_same_points_and_triangles(suffix, tmp_path, capfd):
    mesh_format = available(suffix)
    recovery = lake()
    path = tmp_path / f"mesh{suffix}"
    save(recovery, path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert capfd.readouterr() == ("", "")
    mesh = read(path, mesh_format)
    assert mesh.points.shape[0] == recovery.n_points
    np.testing.assert_allclose(mesh.points[:, :2], recovery.points, rtol=tolerance(mesh_format), atol=0)
    assert not mesh.points[:, 2:].any()
    (cells,) = mesh.cells
    assert cells.type == "triangle"
    np.testing.assert_array_equal(cells.data, recovery.triangles)


@pytest.mark.parametrize("suffix", [s for s in WORKING if FORMATS[s].data == "all"])
def test_point_data_come_back(suffix, tmp_path):
    mesh_format = available(suffix)
    recovery = lake(standard_deviations=np.abs(lake().points))
    save(recovery, tmp_path / f"mesh{suffix}")
    data = read(tmp_path / f"mesh{suffix}", mesh_format).point_data
    np.testing.assert_array_equal(np.ravel(data["row"]), np.arange(recovery.n_points))
    np.testing.assert_array_equal(np.ravel(data["component"]), recovery.component)
    on_boundary = np.flatnonzero(np.ravel(data["boundary"]))
    np.testing.assert_array_equal(on_boundary, np.unique(recovery.boundary))
    np.testing.assert_allclose(np.ravel(data["standard_deviation_y"]), recovery.standard_deviations[:, 1], rtol=1e-14)


@pytest.mark.parametrize("suffix", WORKING)
def test_points_without_coordinates_survive_or_are_refused(suffix, tmp_path):
    mesh_format = available(suffix)
    recovery = with_loose_row(lake())
    path = tmp_path / f"mesh{suffix}"
    if not mesh_format.undetermined:
        with pytest.raises(FormatError, match=f"row {recovery.n_points - 1}"):
            save(recovery, path)
        assert not list(tmp_path.iterdir())
        return
    save(recovery, path)
    points = read(path, mesh_format).points
    np.testing.assert_array_equal(np.isnan(points[:, :2]), np.isnan(recovery.points))


def test_stl_has_each_triangle(tmp_path):
    recovery = with_loose_row(lake())
    save(recovery, tmp_path / "mesh.stl")
    text = (tmp_path / "mesh.stl").read_text()
    corners = np.array([line.split()[1:] for line in text.splitlines() if "vertex" in line], dtype=float)
    np.testing.assert_array_equal(corners.reshape(-1, 3, 3)[..., :2], recovery.points[recovery.triangles])


def test_wkt_has_each_triangle(tmp_path):
    recovery = with_loose_row(lake())
    save(recovery, tmp_path / "mesh.wkt")
    text = (tmp_path / "mesh.wkt").read_text()
    assert text.startswith("TIN (((")
    corners = np.array(re.findall(r"[-+.e\d]+", text.removeprefix("TIN")), dtype=float).reshape(-1, 4, 3)
    np.testing.assert_array_equal(corners[:, 0], corners[:, 3])
    np.testing.assert_array_equal(corners[:, :3, :2], recovery.points[recovery.triangles])


def test_svg_has_each_triangle(tmp_path):
    recovery = with_loose_row(lake())
    save(recovery, tmp_path / "mesh.svg")
    paths = ElementTree.parse(tmp_path / "mesh.svg").findall("{http://www.w3.org/2000/svg}path")
    corners = np.array([re.findall(r"[-+.e\d]+", path.get("d", "")) for path in paths], dtype=float)
    flipped = corners.reshape(-1, 3, 2) * [1, -1]  # y runs downwards there, and is shifted into the picture
    true = recovery.points[recovery.triangles]
    np.testing.assert_allclose(np.diff(flipped, axis=1), np.diff(true, axis=1), rtol=0, atol=1e-11)


def test_every_extension_of_meshio_is_known():
    assert set(meshio.extension_to_filetypes) <= set(FORMATS)
    for suffix, mesh_format in FORMATS.items():
        base = "." + suffix.split(".")[-1] if suffix.endswith(".ugrid") else suffix
        assert not mesh_format.name or mesh_format.name in meshio.extension_to_filetypes[base]


@pytest.mark.parametrize("suffix", CANNOT)
def test_formats_of_two_files_or_none_are_refused_at_the_door(suffix, tmp_path):
    path = tmp_path / f"mesh{suffix}"
    for attempt in (lambda: check_output(path), lambda: save(lake(), path)):
        with pytest.raises(FormatError, match=re.escape(suffix)):
            attempt()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", [suffix for suffix, f in FORMATS.items() if f.name and not f.cannot])
def test_every_format_holds_the_cells_of_vector_valued_matrices_or_refuses(suffix, kind, tmp_path, capfd):
    mesh_format = available(suffix)
    recovery = quadratic(kind) if KINDS[kind].quadratic else solid(kind)
    path = tmp_path / f"mesh{suffix}"
    if kind not in mesh_format.cells:
        with pytest.raises(FormatError, match=f"cells of kind {kind}"):
            save(recovery, path)
        assert not list(tmp_path.iterdir())
        return
    save(recovery, path)
    assert capfd.readouterr() == ("", "")
    if not mesh_format.keeps_rows:
        return
    mesh = read(path, mesh_format)
    points = mesh.points[:, : recovery.dim]
    np.testing.assert_allclose(points, recovery.points, rtol=tolerance(mesh_format), atol=0)
    (cells,) = mesh.cells
    assert cells.type == kind
    np.testing.assert_array_equal(cells.data, recovery.cells[kind])
    if mesh_format.data == "all":
        rows = 1 + recovery.dim * np.arange(recovery.n_points)
        np.testing.assert_array_equal(np.ravel(mesh.point_data["row_y"]), rows)


def test_nodes_without_cells_are_points(tmp_path):
    recovery = replace(solid("tetra"), tetrahedra=np.empty((0, 4), np.int64))
    save(recovery, tmp_path / "mesh.vtu")
    (cells,) = meshio.read(tmp_path / "mesh.vtu").cells
    assert cells.type == "vertex"
    assert len(cells.data) == 8
    with pytest.raises(FormatError, match="nodes without cells"):
        save(recovery, tmp_path / "mesh.stl")


WORTH = {"status", "uniqueness", "backward_error"}


def test_npz_of_vector_valued_matrices(tmp_path):
    recovery = solid("hexahedron")
    save(recovery, tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz") as content:
        shared = {"points", "component", "hinges", "scale", "node_status"}
        assert set(content) == shared | WORTH | {"hexahedra", "node_of_row", "direction_of_row"}
        for name in set(content) - WORTH:
            assert content[name].dtype == getattr(recovery, name).dtype
        assert content["node_status"].dtype == np.int8


def test_a_missing_package_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(OutputError, match="pip install h5py"):
        check_output(tmp_path / "mesh.h5m")


def test_npz_of_quadratic_cells(tmp_path):
    recovery = quadratic("tetra10")
    save(recovery, tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz") as content:
        assert content["tetrahedra"].tolist() == [[0, 1, 2, 3]]
        assert content["mid_nodes"].tolist() == [[4, 5, 6, 7, 8, 9]]
        assert content["mid_nodes"].dtype == np.int64


def test_the_outside_of_quadratic_cells_is_marked_to_the_last_node():
    for kind in ("tetra10", "hexahedron20"):
        assert to_meshio(quadratic(kind)).point_data["boundary"].all()
    assert to_meshio(quadratic("hexahedron27")).point_data["boundary"].tolist() == [1] * 26 + [0]


@pytest.mark.parametrize("exponent", [-300, -100, -99, -10, -9, 0, 9, 10, 99, 100, 300])
def test_nastran_fields_hold_numbers_of_any_size(exponent, tmp_path):
    recovery = lake()
    size = 10.0**exponent
    scaled = lake(points=-size * recovery.points)
    save(scaled, tmp_path / "mesh.nas")
    points = read(tmp_path / "mesh.nas", FORMATS[".nas"]).points[:, :2]
    np.testing.assert_allclose(points, scaled.points, rtol=1e-8, atol=0)


def test_npz_has_exactly_the_keys_that_have_content(tmp_path):
    recovery = lake()
    save(recovery, tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz", allow_pickle=False) as content:
        assert set(content) == {"points", "triangles", "component", "hinges", "scale", "node_status"} | WORTH
        for name in set(content) - WORTH:
            expected = getattr(recovery, name)
            np.testing.assert_array_equal(content[name], expected)
            assert content[name].dtype == expected.dtype
    save(with_loose_row(recovery), tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz") as content:
        assert content["node_status"].dtype == np.int8
        assert np.flatnonzero(content["node_status"]).tolist() == [recovery.n_points]
        assert np.isnan(content["points"][-1]).all()


def test_without_triangles(tmp_path):
    empty = lake(triangles=np.empty((0, 3), np.int64))
    save(empty, tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz") as content:
        assert "triangles" not in content
    with pytest.raises(FormatError, match="there are none"):
        save(empty, tmp_path / "mesh.stl")


def test_to_meshio_is_ready_for_any_writer(tmp_path, capfd):
    mesh = to_meshio(lake())
    assert mesh.points.shape[1] == 3
    mesh.write(tmp_path / "mesh.vtu")
    assert capfd.readouterr() == ("", "")


def test_extensions_in_capitals(tmp_path):
    save(lake(), tmp_path / "MESH.VTU")
    assert read(tmp_path / "MESH.VTU", FORMATS[".vtu"]).cells[0].type == "triangle"
    save(lake(), tmp_path / "MESH.NPZ")
    assert {p.name for p in tmp_path.iterdir()} == {"MESH.VTU", "MESH.NPZ"}


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("mesh", "extension"),
        ("mesh.xyz", "extension"),
        (".npz", "extension"),
        ("nowhere/mesh.vtu", "no folder"),
        ("folder.vtu", "it is a folder"),
        ("file.txt/mesh.vtu", "folder"),
        ("m" * 300 + ".vtu", "cannot write"),
        ("null\0.vtu", "cannot write"),
        ("loop.vtu", "cannot write"),
        ("pipe.vtu", "not a regular file"),
    ],
)
def test_what_cannot_be_written_is_found_out_early(name, why, tmp_path):
    import os

    (tmp_path / "folder.vtu").mkdir()
    (tmp_path / "file.txt").write_text("")
    if why in ("cannot write", "not a regular file") and not hasattr(os, "mkfifo"):
        pytest.skip("no such names here")
    if hasattr(os, "mkfifo"):
        (tmp_path / "loop.vtu").symlink_to(tmp_path / "loop.vtu")
        os.mkfifo(tmp_path / "pipe.vtu")
    before = sorted(p.name for p in tmp_path.iterdir())
    with pytest.raises(OutputError, match=why):
        check_output(tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_no_permission(monkeypatch, tmp_path):
    path = tmp_path / "mesh.vtu"
    path.write_text("old")
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(OutputError, match="write-protected"):
        check_output(path)
    path.unlink()

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkdtemp", refuse)
    with pytest.raises(OutputError, match="permission denied"):
        check_output(path)
    with pytest.raises(OutputError, match="permission denied"):
        save(lake(), path)


@pytest.mark.parametrize("suffix", [".npz", ".vtu"])
@pytest.mark.parametrize("accident", [OSError(28, "No space left on device"), KeyboardInterrupt(), MemoryError()])
def test_accidents_leave_the_old_file_and_nothing_else(suffix, accident, monkeypatch, tmp_path):
    def half(path, *args, **kwargs):
        Path(path).write_bytes(b"half")
        Path(path).with_suffix(".side").write_bytes(b"half")
        raise accident

    monkeypatch.setattr("meshio.write", half)
    monkeypatch.setattr("numpy.savez", half)
    path = tmp_path / f"mesh{suffix}"
    path.write_text("old")
    expected = OutputError if isinstance(accident, OSError) else type(accident)
    with pytest.raises(expected):
        save(lake(), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_whatever_meshio_raises_is_one_sentence(monkeypatch, tmp_path, capfd):
    def write(*args, **kwargs):
        sys.stdout.write("noise")
        raise AssertionError

    monkeypatch.setattr("meshio.write", write)
    with pytest.raises(FormatError, match="AssertionError"):
        save(lake(), tmp_path / "mesh.vtu")
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_links_are_followed(tmp_path):
    (tmp_path / "data").mkdir()
    target = tmp_path / "data" / "mesh.npz"
    target.write_text("old")
    link = tmp_path / "link.npz"
    link.symlink_to(target)
    save(lake(), link)
    assert link.is_symlink()
    with np.load(target) as content:
        assert "points" in content


def test_the_same_npz_on_every_run(tmp_path):
    recovery: Recovery = lake()
    for name in ("a", "b"):
        save(recovery, tmp_path / f"{name}.npz")
    with np.load(tmp_path / "a.npz") as a, np.load(tmp_path / "b.npz") as b:
        assert all((a[key] == b[key]).all() for key in a)


@pytest.mark.parametrize("status", ["certified", "uncertified"])
def test_what_a_mesh_is_worth_stands_in_its_file(tmp_path, status):
    known = lake(verdict=verdict(status), backward_error=3e-16)
    known.save(tmp_path / "mesh.npz")
    with np.load(tmp_path / "mesh.npz") as content:
        assert str(content["status"]) == status
        assert str(content["uniqueness"]) == (known.uniqueness or "")
        assert float(content["backward_error"]) == 3e-16


@pytest.mark.parametrize("status", ["certified", "uncertified"])
@pytest.mark.parametrize("suffix", WORKING)
def test_every_format_tells_what_its_mesh_is_worth_or_is_said_not_to(suffix, status, tmp_path):
    mesh_format = available(suffix)
    known = lake(verdict=verdict(status), backward_error=3e-16)
    known.save(tmp_path / f"mesh{suffix}")
    data = read(tmp_path / f"mesh{suffix}", mesh_format).point_data
    if said := lacks_worth(f"mesh{suffix}"):
        assert f"{suffix} has no place for status" in said
        assert not {"status", "scale"} & set(data)
        return
    told = {name: set(np.ravel(data[name]).tolist()) for name in ("status", "uniqueness", "backward_error", "scale")}
    assert told["status"] == {STATUS.index(status)}
    assert told["uniqueness"] == {UNIQUENESS.index(known.uniqueness)}
    np.testing.assert_allclose(list(told["backward_error"]), 3e-16, rtol=1e-10)
    assert told["scale"] == {2.5}
