from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.image import imread

from handmade import lake, recovery_of, two_pieces, verdict, with_loose_row
from meshes import random_mesh
from unassemble.errors import OutputError
from unassemble.plot import (
    check_plot,
    laid_out,
    outer_loops,
    plot_recovery,
    style,
)


def words(figure) -> str:
    legend = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return " | ".join([text.get_text() for text in figure.texts] + legend)


def colours(ax) -> set[str]:
    from matplotlib.colors import to_hex

    return {to_hex(c) for lines in ax.collections if isinstance(lines, LineCollection) for c in lines.get_colors()}


def test_title_and_legend_tell_what_is_there():
    figure = plot_recovery(lake())
    text = words(figure)
    for part in ("certified", "points", "triangles", "c = 2.5", "backward error 1.0e-15", "outer boundary", "2 holes"):
        assert part in text
    assert "hinge" not in text
    assert colours(figure.axes[0]) == {style.EDGE, style.OUTER, style.HOLE}


def test_the_mesh_is_inside_and_round_things_stay_round():
    recovery = lake()
    (ax,) = plot_recovery(recovery).axes
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    assert left <= recovery.points[:, 0].min()
    assert recovery.points[:, 0].max() <= right
    assert bottom <= recovery.points[:, 1].min()
    assert recovery.points[:, 1].max() <= top
    assert ax.get_aspect() == 1


def test_misfits_and_hinges_are_marked():
    pairs = lake().triangles[:3, :2]
    recovery = lake(
        verdict=verdict("uncertified"), worst_entries=pairs, worst_misfits=np.ones(3), hinges=np.array([5, 9])
    )
    figure = plot_recovery(recovery)
    assert "uncertified" in words(figure)
    assert "entries that fit worst" in words(figure)
    assert "2 hinges" in words(figure)
    assert style.WORST in colours(figure.axes[0])
    assert style.WORST not in colours(plot_recovery(lake(worst_entries=pairs, worst_misfits=np.ones(3))).axes[0])


def test_points_without_coordinates_are_left_out(tmp_path):
    recovery = with_loose_row(lake(verdict=verdict("uncertified")))
    n = recovery.n_points
    worst = np.array([[0, n - 1], [n - 1, 1]])
    figure = plot_recovery(
        with_loose_row(lake(verdict=verdict("uncertified"), worst_entries=worst, worst_misfits=np.ones(2))),
        tmp_path / "a.png",
    )
    assert np.isfinite(figure.axes[0].get_xlim()).all()
    assert "1 not determined" in words(figure)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".PNG"])
def test_files_are_whole_and_the_same_each_time(suffix, tmp_path):
    for name in ("a", "b"):
        plot_recovery(lake(), tmp_path / f"{name}{suffix}")
    content = [(tmp_path / f"{name}{suffix}").read_bytes() for name in ("a", "b")]
    assert content[0] == content[1]
    assert {p.name for p in tmp_path.iterdir()} == {f"a{suffix}", f"b{suffix}"}
    if suffix == ".svg":
        assert ElementTree.fromstring(content[0]).tag.endswith("svg")
    elif suffix == ".pdf":
        assert content[0].startswith(b"%PDF")
    else:
        picture = imread(tmp_path / f"a{suffix}")
        assert min(picture.shape[:2]) > 500
        assert (picture[..., :3].min(axis=2) < 0.5).mean() > 0.002  # there is ink
        assert (picture[..., :3] == 1).all(axis=2).mean() > 0.1  # and paper


@pytest.mark.parametrize(("name", "why"), [("a.jpg", r"\.png"), ("a", r"\.png"), ("no/a.png", "no folder")])
def test_what_is_no_picture_file(name, why, tmp_path):
    for attempt in (check_plot, lambda path: plot_recovery(lake(), path)):
        with pytest.raises(OutputError, match=why):
            attempt(tmp_path / name)


def test_an_accident_leaves_the_old_picture(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    def interrupted(self, path, **kwargs):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "savefig", interrupted)
    path = tmp_path / "a.png"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        plot_recovery(lake(), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_no_display_and_no_pyplot_are_needed():
    code = "import sys, unassemble; unassemble.recover, unassemble.Recovery; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from handmade import lake\n"
        "lake().plot()\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, str(__file__).rsplit("test_plot", 1)[0]], check=True)


def test_overlapping_pieces_are_drawn_side_by_side():
    recovery = two_pieces(apart=0.1)
    n = recovery.n_points // 2
    placed = laid_out(recovery)
    assert boxes_are_apart(placed[:n], placed[n:])
    for part in (slice(None, n), slice(n, None)):  # shifted, and nothing else
        shift = placed[part] - recovery.points[part]
        np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-12)


def boxes_are_apart(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((one.max(axis=0) < other.min(axis=0)).any() or (other.max(axis=0) < one.min(axis=0)).any())


def test_pieces_that_do_not_overlap_stay():
    recovery = two_pieces(apart=1.5)
    assert laid_out(recovery) is recovery.points


def test_loose_rows_beside_overlapping_pieces():
    recovery = with_loose_row(two_pieces())
    placed = laid_out(recovery)
    assert np.isnan(placed[-1]).all()
    assert np.isfinite(placed[:-1]).all()
    assert "not determined" in words(plot_recovery(recovery))


def hinged(angle: float):
    """Two triangles that share vertex 0, the second turned about it; and a third by itself, far away."""
    one = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    triangles = np.array([[0, 1, 2], [0, 3, 4], [5, 6, 7]])
    return lake(
        points=np.vstack([one, one[1:] @ turn, one + 10]),
        triangles=triangles,
        component=np.array([0, 0, 0, 1, 1, 2, 2, 2]),
        hinges=np.array([0]),
        scale=np.ones(3),
        boundary=np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2),
        boundary_offsets=np.array([0, 3, 6, 9]),
        node_status=np.zeros(8, np.int8),
        verdict=verdict("uncertified"),
        worst_entries=np.array([[0, 4], [6, 5], [1, 5]]),
        worst_misfits=np.ones(3),
    )


def test_pieces_at_a_hinge_stay_joined():
    for mesh in (hinged(np.pi), hinged(0.1)):  # the second pair overlaps
        assert laid_out(mesh) is mesh.points
    near = replace(hinged(np.pi), points=hinged(np.pi).points - np.repeat([[0, 0], [10, 10]], [5, 3], axis=0))
    placed = laid_out(near)
    assert boxes_are_apart(placed[:5], placed[5:])
    np.testing.assert_allclose(placed[:5] - placed[0], near.points[:5] - near.points[0], atol=1e-12)
    assert "1 hinge" in words(plot_recovery(near))


def test_very_many_pieces():
    one = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    k = 150
    triangles = np.arange(3 * k).reshape(-1, 3)
    recovery = lake(
        points=np.tile(one, (k, 1)),
        triangles=triangles,
        component=np.repeat(np.arange(k), 3),
        scale=np.ones(k),
        boundary=np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2),
        boundary_offsets=np.arange(0, 3 * k + 1, 3),
    )
    centres = laid_out(recovery).reshape(k, 3, 2).mean(axis=1)
    assert len(np.unique(np.round(centres, 6), axis=0)) == k


def test_outer_loop_is_the_one_around_everything():
    recovery = lake()
    outer = outer_loops(recovery)
    sizes = [
        np.ptp(recovery.points[recovery.boundary[a:b, 0]], axis=0).max()
        for a, b in zip(recovery.boundary_offsets, recovery.boundary_offsets[1:], strict=False)
    ]
    assert outer.tolist() == [size == max(sizes) for size in sizes]


def test_large_meshes_become_an_image(tmp_path):
    recovery = recovery_of(*random_mesh(30_000, seed=2))
    (ax,) = plot_recovery(recovery, tmp_path / "large.svg").axes
    assert (tmp_path / "large.svg").read_text().count("<image") == 1
    assert colours(ax) == {style.EDGE, style.OUTER, style.HOLE}
    assert (tmp_path / "large.svg").stat().st_size < 5e6
