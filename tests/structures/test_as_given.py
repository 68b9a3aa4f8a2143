"""Structures as people have them: few digits, supports of all kinds, condensed rotations. Right if certified."""

import numpy as np
import pytest
from as_given import lowest, supported, written
from built import (
    add_members,
    assembled,
    error,
    frame,
    grid,
    grillage,
    model_on,
    plane_frame,
    plate,
    rows_per_node,
    shell,
    sound,
    vault,
)

from unassemble import recover

MAKE = [frame, plane_frame, grillage, shell, plate, vault]
NAMED = {"ids": lambda make: make.__name__}


@pytest.mark.parametrize("digits", [7, 8, 10, 12, 16])
@pytest.mark.parametrize("how", ["none", "removed", "identity", "penalty", "condensed"])
@pytest.mark.parametrize("make", MAKE, **NAMED)
def test_certified_and_as_close_as_it_says(make, how, digits):
    given = make().permuted(1)
    matrix, true = supported(given, how)
    assert sound(written(matrix, digits), true)


@pytest.mark.parametrize("make", [frame, plane_frame, grillage], **NAMED)
def test_members_at_supports_are_told_by_their_blocks(make):
    """Hardly a row of a small structure on supports is whole; where members end is known all the same."""
    given = make(off=0.4).permuted(1)
    _, every = lowest(given)
    kept = np.setdiff1d(np.arange(given.matrix.shape[0]), every)
    found = recover(given.matrix[kept][:, kept])
    assert found.certified
    assert "of straight members" in found.reason
    assert "100% of the rows" in found.reason
    assert error(found.points, given.points[np.unique(kept // given.block)]) < 1e-12


def test_zeros_are_dropped_and_supports_take_unknowns():
    """Nodes of six unknowns and of three, entries that vanish not stored."""
    given = shell(counts=(12, 9))
    moves, _ = lowest(given)
    kept = np.setdiff1d(np.arange(given.matrix.shape[0]), moves)
    matrix = given.matrix[kept][:, kept]
    matrix.data[np.abs(matrix.data) < 1e-12 * np.abs(matrix.data).max()] = 0
    matrix.eliminate_zeros()
    assert sound(matrix, rows_per_node(given)[kept])


def straight_beam(counts: int = 9):
    """A chain of members of different lengths along x, which bends in two planes."""
    points, ends = grid((counts, 1, 1))
    points[:, 0] = np.cumsum(np.random.default_rng(0).uniform(0.5, 2, counts))
    model = model_on(points)
    add_members(model, ends, 0, turned=False)
    return assembled(model, points, ends).only((1, 2, 4, 5), 3)


@pytest.mark.parametrize("clamped", [False, True])
def test_a_beam_that_bends_in_two_planes(clamped):
    given = straight_beam()
    if clamped:
        given = given.clamped(np.arange(9) == 0)
    found = recover(given.matrix)
    assert found.certified, found.reason
    assert found.operator == "beam"
    assert error(found.points, given.points) < 1e-12
    assert len(found.lines) == len(given.members)
    springs = given.with_springs(np.array([8, 9, 16, 17]))
    assert sound(springs.matrix, rows_per_node(given))
