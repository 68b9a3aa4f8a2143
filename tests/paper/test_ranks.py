"""Section 3.2: what is linearly independent, where, and what is lost at the solution (docs/paper.md)."""

import numpy as np
import pytest

from unassemble.paper import AngleSystem, deficiency, null_vector, spiral_matrix, square_rows
from unassemble_paper import meshes
from unassemble_paper.examples import perforated, wheel
from unassemble_paper.meshes import square
from unassemble_paper.ranks import Ranks


def system_of(case, **options):
    return AngleSystem(case.corners, case.weights, **options)


def longest(case):
    return int(np.argmax(case.corners.loop_lengths))


@pytest.fixture(scope="module", params=[(5, 0), (6, 0), (7, 0), (9, 1), (10, 1), (11, 2), (13, 3)])
def generic(request, assemble):
    side, holes = request.param
    return assemble(perforated(side, holes))


def test_edge_rows_and_linear_rows_are_independent_everywhere(generic):
    """The paper says that (3)-(4) become dependent at an exact embedding. They do not."""
    c = generic.corners.counts
    rng = np.random.default_rng(0)
    for angles in (generic.angles, np.full_like(generic.angles, np.pi / 3), rng.uniform(0.3, 2.5, generic.angles.size)):
        system = system_of(generic)
        found = Ranks(system, system.pack(angles))
        assert found.edges == c.e
        assert found.linear == c.m + c.w


def test_deficiency_at_the_solution_is_that_of_the_antisymmetric_matrix(generic):
    c = generic.corners.counts
    plain, loops = system_of(generic), system_of(generic, outer=longest(generic))
    predicted = deficiency(generic.piece, generic.corners, generic.truth)
    assert Ranks(plain, plain.pack(generic.angles)).deficiency == predicted
    assert predicted == (c.h if c.h else c.w % 2)  # generic meshes
    with_loops = deficiency(generic.piece, generic.corners, generic.truth, loops=True)
    assert Ranks(loops, loops.pack(generic.angles)).deficiency == with_loops
    assert with_loops == (c.w + c.h) % 2


def test_loop_equations_restore_rank_where_parity_allows(assemble):
    mended = {}
    for seed in range(3):
        for side in (9, 10):
            case = assemble(perforated(side, 1, seed=seed))
            c = case.corners.counts
            mended[(c.w + c.h) % 2] = deficiency(case.piece, case.corners, case.truth, loops=True)
            assert deficiency(case.piece, case.corners, case.truth) == 1
    case = assemble(perforated(13, 3))
    assert (case.corners.counts.w + 3) % 2 == deficiency(case.piece, case.corners, case.truth, loops=True)
    assert mended.get(0, 0) == 0
    assert mended.get(1, 1) == 1


@pytest.fixture(params=["square", "ellipse"])
def small_case(request, assemble):
    """Without the rocket: its singular values take long, and the table of experiments has its ranks as well."""
    return assemble(getattr(meshes, request.param)(), request.param)


def test_deficiency_on_the_papers_meshes(small_case):
    expected = {"square": 64, "ellipse": 37}[small_case.name]
    system = system_of(small_case)
    assert Ranks(system, system.pack(small_case.angles)).deficiency == expected
    assert deficiency(small_case.piece, small_case.corners, small_case.truth) == expected
    # Loop equations do not help here, and c as an unknown changes nothing.
    assert deficiency(small_case.piece, small_case.corners, small_case.truth, loops=True) == expected
    free = system_of(small_case, scale_free=True)
    assert Ranks(free, free.pack(small_case.angles)).deficiency == expected


def test_the_products_of_sines_restore_full_rank_on_the_papers_meshes(small_case):
    system = system_of(small_case, sines=True)
    found = Ranks(system, system.pack(small_case.angles))
    assert found.deficiency == 0
    assert found.least > 0.02


def test_the_products_of_sines_restore_full_rank(generic):
    system = system_of(generic, sines=True)
    found = Ranks(system, system.pack(generic.angles))
    assert found.deficiency == 0
    assert found.least > 0.01


def test_at_equal_angles_the_deficiency_is_w_plus_h(small_case):
    """The paper says that the Jacobian has full rank away from the solution; its own start is the worst point."""
    c = small_case.corners.counts
    system = system_of(small_case)
    found = Ranks(system, system.pack(np.full_like(small_case.angles, np.pi / 3)))
    assert found.deficiency == c.w + c.h


def test_at_a_random_point_near_the_solution_the_rank_is_full(small_case):
    system = system_of(small_case)
    noise = 1e-2 * np.random.default_rng(0).standard_normal(small_case.angles.size)
    assert Ranks(system, system.pack(small_case.angles + noise)).deficiency == 0


def test_spiral_matrix_is_antisymmetric_and_gives_the_null_vectors(generic):
    matrix = spiral_matrix(generic.piece, generic.corners, generic.truth)
    size = np.abs(matrix).max()
    assert np.abs(matrix + matrix.T).max() < 1e-12 * size
    assert np.abs(matrix.sum(axis=1)).max() < 1e-12 * size
    system = system_of(generic, unknowns="angles")
    jacobian = system.jacobian(generic.angles)
    # Any s at all is annihilated by (1)-(3), and (4) gives K s.
    s = np.random.default_rng(3).standard_normal(matrix.shape[0])
    image = jacobian.forward(null_vector(generic.piece, generic.corners, generic.truth, s))
    triangles, interior, edges, _, _ = system.split(image)
    scale = np.abs(null_vector(generic.piece, generic.corners, generic.truth, s)).max()
    assert np.abs(triangles).max() < 1e-10 * scale
    assert np.abs(edges).max() < 1e-9 * scale
    np.testing.assert_allclose(interior, (matrix @ s)[: generic.corners.w], atol=1e-9 * scale)
    # ... and the s for which K s = 0 are annihilated by all.
    _, values, vectors = np.linalg.svd(matrix[: generic.corners.w].toarray())
    for v in vectors[int((values > 1e-10 * values[0]).sum()) :]:
        assert np.abs(jacobian.forward(null_vector(generic.piece, generic.corners, generic.truth, v))).max() < 1e-9


def test_squared_lengths_combine_the_rows_1_to_3_to_zero(paper_case):
    """The left null vector: rows of edges by their squared length, rows of triangles by 4 R^2, rows (4) by 0."""
    z, piece = paper_case.truth, paper_case.piece
    squared = np.abs(z[piece.edges[:, 0]] - z[piece.edges[:, 1]]) ** 2
    system = system_of(paper_case, unknowns="angles")
    corner = 3 * np.arange(len(piece.triangles))
    four_r2 = squared[piece.opposite.ravel()[corner]] / np.sin(paper_case.angles[corner]) ** 2
    left = np.concatenate([four_r2, np.zeros(paper_case.corners.w), squared])
    assert np.abs(system.jacobian(paper_case.angles).adjoint(left)).max() < 1e-10 * four_r2.max()


def test_picked_interior_equations_leave_a_singular_square_system(assemble):
    """Section 3.3. Leaving out an edge equation instead gives a regular one (where w is even)."""
    case = assemble(perforated(6, 0))
    assert case.corners.w % 2 == 0
    system = system_of(case)
    matrix = system.jacobian(system.pack(case.angles)).sparse().toarray()
    for drop in range(case.corners.w):
        rows = np.delete(np.arange(system.n_equations), system.row_of_interior + drop)
        assert np.linalg.svd(matrix[rows], compute_uv=False)[-1] < 1e-12
    rows = square_rows(matrix.shape, system.row_of_edges, system.row_of_loops)
    assert np.linalg.svd(matrix[rows], compute_uv=False)[-1] > 1e-4


def test_a_wheel_and_a_lattice_are_the_extremes(assemble):
    hub = assemble(wheel(np.array([1.0, 1.3, 0.8, 1.1, 0.9])))
    assert deficiency(hub.piece, hub.corners, hub.truth) == 1 == hub.corners.w
    lattice = assemble(square(6))
    assert deficiency(lattice.piece, lattice.corners, lattice.truth) == 16 == lattice.corners.w
