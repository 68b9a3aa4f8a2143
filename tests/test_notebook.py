"""What a user of a notebook sees and types."""

from __future__ import annotations

import base64
import io
import json
import re
import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from scipy.sparse import csgraph

from handmade import lake, solid, verdict, with_loose_row
from meshes import random_mesh, specimen
from unassemble import InputError, recover

TRUE = specimen(*random_mesh(150, seed=5), c=2.0)


BODY = solid("hexahedron")
UNCERTIFIED = lake(verdict=verdict("uncertified", "a < b", "look there"))


@pytest.mark.parametrize("result", [lake(), BODY, with_loose_row(lake()), UNCERTIFIED])
def test_a_result_stands_on_one_screen(result):
    assert len(repr(result)) < 240
    assert "\n" not in repr(result)
    assert repr(result).startswith(f"<{type(result).__name__}: {result.status}, ")
    assert f", {result.n_points:,} points, " in repr(result)  # of which some may have no position
    assert "array(" not in repr(result) + str(result)
    assert len(str(result).splitlines()) < 25
    assert str(result).startswith(f"{result.status}: {result.reason}")


@pytest.mark.parametrize("result", [lake(), BODY, UNCERTIFIED])
def test_a_result_has_a_picture(result):
    html = result._repr_html_()
    assert result.status in html
    if not result.certified:
        assert "a &lt; b" in html
        assert "look there" in html
    (picture,) = re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", html)
    image = Image.open(io.BytesIO(base64.b64decode(picture)))
    assert image.size[0] > 200
    assert len(image.convert("RGB").getcolors(1 << 24)) > 20


def test_masses_have_no_picture():
    html = lake(areas=np.ones(2))._repr_html_()
    assert "certified" in html
    assert "<img" not in html


@pytest.mark.parametrize("result", [lake(), BODY])
def test_drawn_into_axes_of_the_caller(result):
    figure, (left, right) = plt.subplots(1, 2)
    assert result.plot(ax=right) is figure
    assert len(right.get_children()) > len(left.get_children())
    assert not figure.texts
    plt.close(figure)


def test_report_to_a_file(tmp_path):
    result = lake()
    assert result.report(tmp_path / "r.json") == result.report()
    assert json.loads((tmp_path / "r.json").read_text()) == result.report()


def test_anchors_as_a_mapping():
    rows = [3, 40, 77]
    found = recover(TRUE.matrix, anchors={row: TRUE.points[row] for row in rows})
    np.testing.assert_allclose(found.points, TRUE.points, atol=1e-11)
    with pytest.raises(InputError, match="mapping"):
        recover(TRUE.matrix, anchors={"a": (0, 1)})


def test_progress_is_shown_where_it_is_asked_for(monkeypatch, capsys):
    from unassemble import pipeline, progress

    monkeypatch.setattr(
        pipeline, "StageDisplay", lambda **options: progress.StageDisplay(**options, delay=0.0, interval=0.001)
    )
    assert recover(TRUE.matrix, progress=True).certified
    assert capsys.readouterr().err.strip()
    for silent in (False, None):
        recover(TRUE.matrix, progress=silent)
        assert capsys.readouterr() == ("", "")
    stages = []
    recover(TRUE.matrix, progress=stages.append)
    assert "polish" in stages


def test_warnings_of_other_libraries_do_not_leak(monkeypatch):
    def noisy(*args, **kwargs):
        warnings.warn_explicit("old", DeprecationWarning, "scipy.py", 1, module="scipy.sparse")
        called.append(args)
        return quiet(*args, **kwargs)

    called, quiet = [], csgraph.connected_components
    monkeypatch.setattr("scipy.sparse.csgraph.connected_components", noisy)
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        assert recover(TRUE.matrix).certified
    assert called
    assert not seen


@pytest.mark.parametrize("operator", ["heat", "", 3])
def test_an_operator_that_is_unknown_is_said_to_be(operator):
    with pytest.raises(InputError, match=r"is unknown: use 'auto' or 'laplacian' or 'elasticity'"):
        recover(TRUE.matrix, operator=operator)
