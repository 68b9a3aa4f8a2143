"""The method from end to end."""

import numpy as np
import pytest

from meshes import random_mesh
from unassemble.errors import GeometryError, InputError
from unassemble.paper import AngleOptions, NewtonOptions, distance, recover_angles
from unassemble_paper.examples import perforated
from unassemble_paper.meshes import Mesh


@pytest.mark.parametrize("scale", [1.0, 3.7, 1e-6, -2.5, 1e8])
def test_any_scale(paper_case, scale):
    found = recover_angles(paper_case.piece, scale * paper_case.weights)
    assert found.converged
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert distance(found.z, paper_case.truth) < 1e-9
    np.testing.assert_allclose(found.angles.ravel(), paper_case.angles, atol=1e-8)
    known = recover_angles(paper_case.piece, scale * paper_case.weights, scale=scale)
    assert known.scale == scale
    assert distance(known.z, paper_case.truth) < 1e-9


@pytest.mark.parametrize("embedding", ["layout", "bfs", "modified-bfs", "smoothing"])
@pytest.mark.parametrize("unknowns", ["cotangents", "angles"])
def test_embeddings(paper_case, embedding, unknowns):
    found = recover_angles(
        paper_case.piece, paper_case.weights, options=AngleOptions(embedding=embedding, unknowns=unknowns)
    )
    assert found.converged
    assert distance(found.z, paper_case.truth) < 1e-7
    p = found.z[paper_case.piece.triangles]
    assert (((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag > 0).all()


def test_the_papers_own_choices(paper_case):
    """Without the sine products: a residual of 1e-6, and a mesh to three or four digits."""
    options = AngleOptions(sines=False, embedding="smoothing", newton=NewtonOptions(tolerance=1e-6))
    found = recover_angles(paper_case.piece, paper_case.weights, options=options)
    assert found.converged
    assert distance(found.z, paper_case.truth) < 2e-3


@pytest.mark.parametrize("holes", [0, 1, 2, 3, 4])
def test_holes(assemble, holes):
    example = assemble(perforated(16, holes), scale=0.2)
    found = recover_angles(example.piece, example.weights)
    assert found.converged
    assert found.scale == pytest.approx(0.2)
    assert distance(found.z, example.truth) < 1e-8
    assert found.products < 2_500


def test_loop_equations_from_the_options(paper_case):
    found = recover_angles(paper_case.piece, paper_case.weights, options=AngleOptions(outer="auto"))
    assert found.converged
    assert distance(found.z, paper_case.truth) < 1e-8


def test_products_hardly_grow_with_the_mesh(assemble):
    products = [recover_angles(c.piece, c.weights).products for c in (assemble(perforated(k, 0)) for k in (10, 20, 40))]
    assert max(products) < 2.5 * min(products)


def test_thin_triangles_need_damping(assemble):
    """Shaken lattices with ragged boundaries: the paper's whole steps are not globally convergent."""
    converged = {True: 0, False: 0}
    for seed in range(8, 13):
        example = assemble(Mesh(*random_mesh(60, seed=seed)), scale=-3.0)
        for damped in converged:
            options = AngleOptions(newton=NewtonOptions(tolerance=1e-10, damped=damped, max_products=6_000))
            found = recover_angles(example.piece, example.weights, options=options)
            converged[damped] += found.converged
            if found.converged:
                assert distance(found.z, example.truth) < 1e-5
    assert converged[True] == 5
    assert converged[False] <= 3


@pytest.mark.slow
def test_ten_thousand_vertices(assemble):
    large = assemble(perforated(100, 4))
    found = recover_angles(large.piece, large.weights)
    assert found.converged
    assert found.products < 3_000
    assert distance(found.z, large.truth) < 1e-7


def test_no_convergence_is_reported(paper_case):
    options = AngleOptions(newton=NewtonOptions(max_outer=1))
    found = recover_angles(paper_case.piece, paper_case.weights, options=options)
    assert not found.converged
    assert found.status.startswith("stopped")
    assert np.isfinite(found.z).all()


def test_input_errors(paper_case):
    with pytest.raises(GeometryError, match="scale"):
        recover_angles(paper_case.piece, np.zeros_like(paper_case.weights))
    for scale in (0.0, np.nan):
        with pytest.raises(InputError, match="scale"):
            recover_angles(paper_case.piece, paper_case.weights, scale=scale)
    with pytest.raises(InputError, match="tutte"):
        AngleOptions(embedding="tutte")
    with pytest.raises(InputError, match="sides"):
        AngleOptions(unknowns="sides")
    with pytest.raises(InputError, match="random"):
        recover_angles(paper_case.piece, paper_case.weights, options=AngleOptions(start="random"))
