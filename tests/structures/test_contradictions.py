"""Structures some of whose elements strain where they move rigidly: these are named, and the rest is certified."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from built import add_members, assembled, error, frame, grillage, model_on, plane_frame, rows_per_node, shell, sound

from unassemble import recover


def wide():
    return grillage((6, 5))


def with_offsets(given, count, seed=0):
    """Further members, whose ends are off the nodes to which they are attached without moments; and their nodes."""
    rng = np.random.default_rng(seed)
    dim = given.points.shape[1]
    at = given.points + rng.uniform(0.2, 0.5, given.points.shape)
    ends = given.members[rng.choice(len(given.members), count, replace=False)]
    model = model_on(at)
    add_members(model, ends, seed)
    whole = assembled(model, at)
    more = whole if given.block == 6 else whole.only(given.unknowns, dim)
    return replace(given, matrix=sp.csr_array(given.matrix + more.matrix)), np.unique(ends)


@pytest.mark.parametrize("make", [frame, plane_frame, wide], ids=lambda make: make.__name__)
def test_members_with_offsets_are_named(make):
    given, spoiled = with_offsets(make().permuted(1), 2)
    found = recover(given.matrix)
    assert found.certified, found.reason
    assert error(found.points, given.points) < 1e-12
    (note,) = (one for one in found.warnings if "contradict the others" in one)
    listed = {int(word) for word in note.split(" (")[1].split(")")[0].split(", ")}
    assert set(spoiled.tolist()) <= listed  # and perhaps nodes beside them
    assert len(listed) < 2 * len(spoiled)
    assert "100% of the rows" not in found.reason


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("node", [3, 24, 51])
def test_springs_across_a_shell(node, direction):
    """Between neighbours, beside those that all rotations have against drilling."""
    given = shell()
    found = recover(given.with_springs(np.array([6 * node + direction]), np.array([6 * (node + 7) + direction])).matrix)
    assert found.certified
    assert error(found.points, given.points) < 1e-12
    assert any(f"the rows of 2 nodes ({node}, {node + 7}) contradict the others" in one for one in found.warnings)


@pytest.mark.parametrize("seed", range(24))
def test_never_certified_and_wrong(seed):
    """With more and more of them, nodes without supports and with."""
    make = (lambda: frame((3, 2, 2), seed), lambda: plane_frame((4, 3), seed), lambda: grillage((4, 3), seed))[seed % 3]
    given, _ = with_offsets(make().permuted(seed), 1 + seed // 4, seed)
    if seed % 2:
        given = given.clamped(given.points[:, -1] < given.points[:, -1].min() + 0.9)
    sound(given.matrix, rows_per_node(given))
