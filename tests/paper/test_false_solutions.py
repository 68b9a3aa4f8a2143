"""With c unknown the equations (1)-(4) have exact solutions that are no meshes, even without holes (docs/paper.md)."""

import numpy as np
import pytest

from unassemble.paper import AngleOptions, NewtonOptions, recover_angles, signed_angles, violations
from unassemble_paper.examples import perforated, wheel_of
from unassemble_paper.false_solutions import WHEEL, exact_root, least_singular_value, rate_table, wheel_roots


@pytest.fixture(scope="module")
def wheel(assemble):
    return assemble(wheel_of(np.array(WHEEL, dtype=float)))


def by_corner(wheel, angles):
    """(3m,) angles (k, 3) at hub, rim vertex and next rim vertex, in the order of the piece's corners."""
    hub = int(wheel.corners.interior[0])
    found = np.empty((len(WHEEL), 3))
    true = wheel.angles.reshape(-1, 3)
    for row, triangle in enumerate(wheel.piece.triangles):
        turn = int(np.flatnonzero(triangle == hub)[0])
        own = np.roll(true[row], -turn)
        # The piece may run around the hub the other way: which triangle it is, and which way, its angles say.
        for k, expected in enumerate(wheel_roots(np.array(WHEEL))[0][1]):
            for way in ([0, 1, 2], [0, 2, 1]):
                if np.allclose(own, expected[way]):
                    found[row] = np.roll(angles[k][way], turn)
    return found.ravel()


def test_a_wheel_of_five_triangles_has_two_other_solutions(wheel):
    system = wheel.system(unknowns="angles")
    roots = wheel_roots(np.array(WHEEL))
    assert [round(c, 6) for c, _ in roots] == [1, 1.103355, 1.103355]
    for k, (c, angles) in enumerate(roots):
        x = system.pack(by_corner(wheel, angles), c)
        assert x[:-1].min() > 0.2
        assert np.linalg.norm(system.residual(x)) < 1e-12
        closes = violations(wheel.piece, wheel.corners, x[:-1]).embedding
        assert (closes < 1e-12) == (k == 0)
        sines = np.abs(wheel.system(unknowns="angles", sines=True).residual(x)[-1])
        assert (sines < 1e-12) == (k == 0)
        # One interior vertex: the mesh is a double root, and the others are isolated.
        assert (least_singular_value(system, x) < 1e-12) == (k == 0)
        assert (least_singular_value(system, x) > 1e-3) == (k > 0)


def test_a_wheel_of_four_triangles_has_none():
    """The arcs of (4) pair off to a linear equation for c squared."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        around = np.sort(rng.uniform(0, 2 * np.pi, 4))
        if np.diff(around, append=around[0] + 2 * np.pi).max() < 3:
            rim = rng.uniform(0.3, 3, 4) * np.exp(1j * around)
            assert len(wheel_roots(np.column_stack([rim.real, rim.imag]))) == 1


@pytest.mark.slow
def test_rates():
    rows = rate_table(seeds=40, hexagons=6, starts=10).rows
    hexagons, unknown, known, sines, holed = rows
    for row in (hexagons, unknown, holed):
        assert 0 < row[4] < row[3] <= row[2]
        assert row[7] > 1e-6  # J has full row rank there: isolated roots, or with a hole a family of one dimension
    assert known[3:5] == (10, 0)
    assert sines[3:5] == (10, 0)


def test_the_papers_own_method_ends_there_and_a_warning_says_so(assemble):
    """From pi/3, on meshes without a hole; from where it stops Newton's method goes on to a residual of rounding."""
    paper, astray = AngleOptions(sines=False, newton=NewtonOptions(tolerance=1e-6)), 0
    for seed in (12, 25, 61, 68):
        example = assemble(perforated(8, 0, seed=seed))
        found = recover_angles(example.piece, example.weights, options=paper)
        assert found.converged
        apart = np.abs(signed_angles(found.z, example.piece.triangles) - found.angles).max()
        assert "no meshes" in found.warnings[0]
        assert f"{apart:.1e}" in found.warnings[0]
        system = example.system(unknowns="angles")
        root = exact_root(system, system.pack(found.angles, 1 / found.scale))
        astray += np.abs(root[:-1] - example.angles).max() > 1e-2
        assert not recover_angles(example.piece, example.weights).warnings
        assert not recover_angles(example.piece, example.weights, scale=1.0, options=paper).warnings
    assert astray >= 2


def test_loop_equations_find_the_outer_loop(assemble):
    """Around a hole with more edges than the outer boundary has."""
    ring = _long_hole()
    example = assemble(ring)
    assert sorted(example.corners.loop_lengths) == [4, 16]
    for sines in (True, False):
        tolerance = 1e-10 if sines else 1e-6
        options = AngleOptions(sines=sines, newton=NewtonOptions(tolerance=tolerance, damped=sines))
        found = recover_angles(example.piece, example.weights, scale=None if sines else 1.0, options=options)
        assert found.converged
        assert np.abs(found.angles.ravel() - example.angles).max() < (1e-8 if sines else 5e-3)


def _long_hole():
    """A square of four corners around a regular polygon of sixteen."""
    from scipy.spatial import Delaunay

    from unassemble_paper.meshes import Mesh, counter_clockwise

    rim = np.exp(2j * np.pi * (np.arange(16) + 0.3) / 16)
    middle = 1.6 * np.exp(2j * np.pi * np.arange(11) / 11)
    z = np.r_[rim, middle, 3 * np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])]
    points = np.column_stack([z.real, z.imag])
    triangles = counter_clockwise(points, Delaunay(points).simplices)
    return Mesh(points, triangles[~(triangles < 16).all(axis=1)])
