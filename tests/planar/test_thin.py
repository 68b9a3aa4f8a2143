"""Meshes one element wide and thousands long: they bend like beams, and normal equations lose the bending."""

import pytest

import unassemble.planar.piece as piece
from meshes import largest_error, specimen, strip
from unassemble import recover


@pytest.mark.parametrize(("height", "jitter", "error"), [(0.87, 0.1, 1e-10), (0.02, 0.1, 2e-9)])
def test_long_strips(height, jitter, error):
    """Normal equations leave errors of 1e-9 and 1e-6 here."""
    known = specimen(*strip(3000, height, jitter), c=-2.5, seed=1)
    found = recover(known.matrix, scale=-2.5)  # no vertex lies inside
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= error


def test_doubtful_positions_are_not_certified(monkeypatch):
    """Where a polish keeps moving points, a matrix given back does not say where they are."""
    monkeypatch.setattr(piece, "affordable", lambda edges, z: False)
    known = specimen(*strip(20000, 0.87, 0.2), c=-2.5, seed=1)
    found = recover(known.matrix)
    assert largest_error(found.points, known.points) > 1e-6
    assert not found.certified
    assert "of the size" in found.reason
