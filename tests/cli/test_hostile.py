"""Files, names and options that are wrong in ways that got past the door once: one sentence, nothing lost."""

from __future__ import annotations

import os

import numpy as np
import pytest

from unassemble import InputError, inspect_matrix, recover

posix = pytest.mark.skipif(os.name != "posix", reason="links and devices of POSIX")


@posix
def test_a_loop_of_links(work, one_sentence):
    (work.folder / "loop").symlink_to("loop")
    (work.folder / "loop.npz").symlink_to("loop.npz")
    for result in (work.recover(matrix="loop"), work.recover(out="loop.npz")):
        assert result.exit_code == 2
        assert "loop" in one_sentence(result)


def test_names_that_are_empty(work, one_sentence):
    result = work.recover(matrix="")
    assert result.exit_code == 2
    assert "cannot be opened" in one_sentence(result)
    assert work.recover(out="").exit_code == 2


def test_a_tensor_that_is_all_but_degenerate(work, one_sentence):
    words = ["--direction", "0,1,0", "--handed", "left"]
    for tensor in ("1e300,0,1e-300", "1,0,1e-17"):
        result = work.recover("--tensor", tensor, *words)
        assert result.exit_code == 2
        assert "degenerate" in one_sentence(result)
    assert work.recover("--tensor", "1,0,1e-6", *words).exit_code in (0, 3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"scale": "2"}, {"scale": 1j}, {"scale": [1.0]}, {"noise": "1"}, {"noise": True}, {"drop_zeros": "x"},
        {"threads": "2"}, {"threads": 0.5}, {"block_size": 2.0}, {"anchors": 5}, {"anchors": [None]},
        {"anchors": [(0.5, 0, 0)]}, {"anchors": np.ones((2, 2))}, {"direction": (0, 1)}, {"tensor": (1, 0)},
        {"tensor": "abc"}, {"tensor": 5}, {"numbering": ([], [])},
    ],
    ids=str,
)  # fmt: skip
def test_values_of_a_wrong_type(work, wrong):
    name = next(iter(wrong))
    with pytest.raises(InputError) as caught:
        recover(work.true.matrix, **wrong)
    assert f"`{name}`" in str(caught.value) or name == "numbering"


@pytest.mark.parametrize("out", ["mesh.npz", "mesh.vtu"])
def test_a_disk_that_is_full(work, one_sentence, out):
    """Files may not grow beyond a few kilobytes, which the system reports as it reports a full disk."""
    resource = pytest.importorskip("resource")
    (work.folder / out).write_bytes(b"old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        result = work.recover(out=out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert result.exit_code == 2
    assert "cannot write" in one_sentence(result)
    assert "requested" not in result.stderr
    assert (work.folder / out).read_bytes() == b"old"
    assert work.files() == {"A.mtx", out}


def test_inspection_of_a_wrong_tolerance(work):
    with pytest.raises(InputError, match="drop_zeros"):
        inspect_matrix(work.true.matrix, drop_zeros="x")


def test_anchors_may_be_an_array(work):
    true = work.true
    rows = np.array([3, 50, 90])
    found = recover(true.matrix, anchors=np.column_stack([rows, true.points[rows]]))
    assert np.abs(found.points - true.points).max() < 1e-12
