"""Triangles beside quadrilaterals."""

import meshio
import numpy as np
import pytest
from assembled import Assembled, eliminated, error, on_plane, recover_elasticity
from mixed import mixed
from supported import given, judged

from unassemble import recover
from unassemble.elements import outer_facets, outer_nodes

COUNTS = (9, 8)


def sets(found):
    return {kind: {frozenset(cell) for cell in cells.tolist()} for kind, cells in found.cells.items()}


@pytest.mark.parametrize("perturb", [0.0, 0.2])
@pytest.mark.parametrize("vary", [False, True])
@pytest.mark.parametrize("layered", [False, True])
def test_every_cell_is_found(perturb, vary, layered):
    case = mixed(COUNTS, perturb=perturb, seed=2, layered=layered, vary=vary)
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert len(found.lame)
    assert found.backward_error < 1e-11
    assert error(found.points, case.points) < 1e-10
    assert sets(found) == case.cells
    assert found.n_cells == len(found.lame) == sum(map(len, case.cells.values()))
    if not vary:
        assert found.lame[:, 0] / found.lame[:, 1] == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("vary", [False, True])
def test_clamped(vary):
    case = mixed(COUNTS, perturb=0.2, seed=4, vary=vary)
    body = Assembled(case.matrix, case.points, np.empty((0, 3)))
    matrix, nodes = eliminated(body, np.repeat(on_plane(body, 0)[:, None], 2, axis=1))
    found = recover_elasticity(matrix)
    assert len(found.lame)
    assert error(found.points, case.points[nodes]) < 1e-10
    for kind, cells in sets(found).items():
        assert {frozenset(nodes[list(cell)].tolist()) for cell in cells} <= case.cells[kind]


@pytest.mark.parametrize("vary", [False, True])
@pytest.mark.parametrize("support", ["roller", "penalty clamp", "penalty rollers", "symmetry"])
def test_next_to_rollers_and_penalties(vary, support):
    """Cells of one kind that hide are not taken for all of that kind: those that can be seen are found."""
    case = mixed(COUNTS, perturb=0.2, seed=4, vary=vary)
    held = given(Assembled(case.matrix, case.points, np.empty((0, 3))), support, "interleaved", "stored")
    found = recover_elasticity(held.matrix)
    truth = judged(found, held)
    assert len(found.lame)
    assert truth.error < 1e-10
    assert truth.missing == 0
    nodes = held.node[np.unique(found.node_of_row, return_index=True)[1]]
    hidden = {"symmetry": 0.05}.get(support, 0.0)
    for kind, cells in case.cells.items():
        seen = {frozenset(nodes[list(cell)].tolist()) for cell in sets(found)[kind]}
        assert seen <= cells
        assert len(seen) >= (1 - hidden) * len(cells)


def test_files_and_pictures(tmp_path):
    case = mixed(COUNTS, perturb=0.2, seed=5, layered=True)
    found = recover(case.matrix)
    assert {kind: len(cells) for kind, cells in found.cells.items()} == {k: len(c) for k, c in case.cells.items()}
    assert len(found.lame) == found.n_cells
    found.save(tmp_path / "body.vtu")
    read = meshio.read(tmp_path / "body.vtu")
    assert {block.type: len(block.data) for block in read.cells} == {k: len(c) for k, c in case.cells.items()}
    found.plot(tmp_path / "body.png")
    on_side = (np.abs(case.points) < 1e-9) | (np.abs(case.points - 1) < 1e-9)
    assert np.array_equal(np.flatnonzero(on_side.any(axis=1)), outer_nodes(found.cells))
    size = {len(facets[0]): len(facets) for facets in outer_facets(found.cells)}
    assert size == {2: len(found.boundary)} == {2: 2 * (8 + 7)}
