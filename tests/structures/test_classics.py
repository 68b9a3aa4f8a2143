"""Famous matrices of structures, whose meshes no collection has: what is certified of them, and what they look like."""

import re
from pathlib import Path

import numpy as np
import pytest

from unassemble import RecoveryError, recover

CLASSICS = Path(__file__).resolve().parents[3] / "shared" / "classics"

# Operator, nodes with coordinates and all nodes, share of the rows that say so.
CERTIFIED = {
    "bcsstk01": ("frame or shell", 8, 8, 100),
    "bcsstk03": ("beam", 24, 28, 61),
    "bcsstk04": ("frame or shell", 22, 22, 82),
    "bcsstk05": ("truss", 51, 51, 92),
    "bcsstk06": ("frame or shell", 60, 104, 57),
    "bcsstk11": ("structure", 391, 491, 60),
    "bcsstk14": ("frame or shell", 257, 301, 64),
    "bcsstk19": ("plane frame", 271, 273, 98),
    "bcsstk20": ("plane frame", 159, 165, 96),
    "bcsstk26": ("frame or shell", 312, 341, 89),
    "nos1": ("plane frame", 79, 79, 100),
    "nos2": ("plane frame", 319, 319, 100),
    "nos4": ("truss", 50, 50, 93),
    "nos5": ("frame or shell", 78, 78, 100),
    "LF10": ("plane frame", 8, 10, 67),
    "LFAT5": ("plane frame", 3, 5, 29),
    "s1rmq4m1": ("frame or shell", 870, 959, 86),
    "s1rmt3m1": ("frame or shell", 869, 961, 86),
    "s3rmt3m3": ("frame or shell", 843, 940, 86),
}


def read(name):
    path = CLASSICS / f"{name}.mtx.gz"
    if not path.exists():
        pytest.skip("the classics are not here")
    return recover(path)


@pytest.mark.parametrize("name", CERTIFIED)
def test_what_is_certified(name):
    operator, placed, nodes, share = CERTIFIED[name]
    found = read(name)
    assert found.certified, found.reason
    assert found.operator == operator
    assert (int(np.count_nonzero(found.node_status == 0)), found.n_points) == (placed, nodes)
    assert f"{share}% of the rows say so" in found.reason


def test_a_plate_of_eight_digits():
    """Its entries are rounded, and its nodes form a grid of equal rectangles."""
    found = read("nos3")
    assert found.certified
    assert "rounded to 8 digits" in found.reason
    x, y = (np.unique(np.round(part / np.ptp(found.points), 6)) for part in found.points.T)
    assert (len(x), len(y)) == (24, 20)
    assert np.ptp(np.diff(x)) < 3e-6
    assert np.ptp(np.diff(y)) < 3e-6


@pytest.mark.parametrize(("name", "off"), [("s1rmq4m1", 1e-9), ("s1rmt3m1", 1e-9), ("s3rmt3m3", 1e-2)])
def test_the_shells_are_cylinders(name, off):
    """No equation knows it: all nodes have one distance from an axis, the one across which distances vary least."""
    points = read(name).points
    points = points[np.isfinite(points).all(axis=1)]
    spread = []
    for axis in range(3):
        across = np.delete(points, axis, axis=1)
        centre = np.linalg.lstsq(np.column_stack([2 * across, np.ones(len(across))]), (across**2).sum(axis=1))[0][:2]
        radius = np.linalg.norm(across - centre, axis=1)
        spread.append(np.ptp(radius) / radius.mean())
    assert min(spread) < off  # the nodes of the last lie between an arc and its chords


@pytest.mark.parametrize(
    ("stiffness", "mass", "rows"),
    [("rail_109_S", "rail_109_M", 109), ("rail_371_S", "rail_371_M", 371), ("rail_371_A", "rail_371_E", 280)],
)
def test_a_rail_and_its_masses(stiffness, mass, rows):
    """Both are of one mesh, though each is read alone elsewhere; the last has a Robin condition on its boundary."""
    masses = CLASSICS / f"{mass}.mtx.gz"
    if not masses.exists():
        pytest.skip("the classics are not here")
    found = recover(CLASSICS / f"{stiffness}.mtx.gz", mass=masses)
    assert found.certified
    assert found.density == 1.0
    assert float(re.search(r"is the one given to (\S+?)(,|$)", found.reason)[1]) < 1e-11
    share = re.search(r"in the (\d+)% of its rows", found.reason)
    assert (100 if share is None else int(share[1])) >= int(100 * rows / found.n_points)


def test_a_bridge_is_its_own_mirror_image():
    """Part of a suspension bridge, the collection says: pylons, a deck and stays, read from two phases of numbering."""
    found = read("bcsstk19")
    points = found.points[np.isfinite(found.points).all(axis=1)]
    other = points * [-1, 1] + [points[:, 0].min() + points[:, 0].max(), 0]
    distance = np.linalg.norm(points[:, None] - other[None], axis=2).min(axis=1)
    assert np.mean(distance < 1e-6 * np.ptp(points)) > 0.9


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("bcsstk08", "14 rows are coupled to 99 others and more", marks=pytest.mark.slow),
        ("bcsstk10", "cylindrical"),  # axes are polar: translations are none of the rows' null vectors
        ("bcsstm10", "eigenvalues of both signs"),
        pytest.param("nasa1824", "eigenvalues of both signs", marks=pytest.mark.slow),
    ],
)
def test_no_cloud_that_means_nothing(name, why):
    with pytest.raises(RecoveryError, match=why):
        read(name)


def test_a_reactor_floor_was_drawn_in_hundredths():
    """No equation knows that either. One node, whose rows contradict all others, used to hide it."""
    found = read("bcsstk26")
    points = found.points[np.isfinite(found.points).all(axis=1)]
    places = 100 * (points - points[0])
    assert len(places) == 312
    assert np.abs(places - np.round(places)).max() < 1e-6
    assert any("the rows of 1 node (249) contradict the others" in note for note in found.warnings)


def test_a_clamped_plate_is_not_certified():
    found = read("bcsstk09")
    assert found.status == "uncertified"
    assert found.operator == "plate"
