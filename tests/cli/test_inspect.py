from __future__ import annotations

import json

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import edge_list


def test_text(work):
    result = work.run("inspect", "A.mtx")
    assert result.exit_code == 0, result.stderr
    lines = dict(line.split(maxsplit=1) for line in result.stdout.splitlines() if not line.startswith("row"))
    assert lines["matrix"].startswith(f"{len(work.true.points)} rows, {len(edge_list(work.true.triangles))} off-")
    assert lines["planar"] == "yes"
    assert lines["holes"] == "2"
    assert lines["operator"] == "laplacian, linear triangles, plus a diagonal, or with rows and columns scaled"
    assert "up to position, rotation, size and mirror image" in lines["recoverable"]
    assert work.files() == {"A.mtx"}


def test_json(work):
    result = work.run("inspect", "A.mtx", "--json")
    assert result.exit_code == 0
    facts = json.loads(result.stdout)
    assert facts["n_triangles"] == len(work.true.triangles)
    assert facts["planar"] is True


def test_nothing_to_recover_is_still_described(work):
    work.write("K.mtx", np.full((6, 6), -1.0))
    result = work.run("inspect", "K.mtx", "--json")
    assert result.exit_code == 0
    facts = json.loads(result.stdout)
    assert facts["planar"] is False
    assert facts["recoverable"].startswith("nothing")
    assert "planar        no" in work.run("inspect", "K.mtx").stdout


def test_standard_input_and_options(work):
    crowded = work.true.matrix.tocoo()
    last = crowded.shape[0] - 1
    matrix = sp.coo_array(
        (np.append(crowded.data, [1e-15] * 2), (np.append(crowded.row, [0, last]), np.append(crowded.col, [last, 0]))),
        shape=crowded.shape,
    )
    work.write("Z.mtx", matrix)
    text = (work.folder / "Z.mtx").read_bytes()
    plain = json.loads(work.run("inspect", "-", "--json", stdin=text).stdout)
    dropped = json.loads(work.run("inspect", "--drop-zeros", "-", "--json", stdin=text).stdout)
    assert plain["n_edges"] == dropped["n_edges"] + 1
    assert plain["n_vanished"] == 1
    assert dropped["n_vanished"] == 0
    assert "forgotten" in dropped["warnings"][0]


@pytest.mark.parametrize(("content", "status"), [(None, 2), (b"no matrix", 2)])
def test_unreadable(work, one_sentence, content, status):
    if content:
        (work.folder / "B.mtx").write_bytes(content)
    result = work.run("inspect", "B.mtx")
    assert result.exit_code == status
    assert "B.mtx" in one_sentence(result)


def test_fails_the_checks_at_the_door(work, one_sentence):
    work.write("B.mtx", np.ones((3, 4)))
    result = work.run("inspect", "B.mtx")
    assert result.exit_code == 4
    assert "not square" in one_sentence(result)
