"""Unknowns that were taken out leave sums that do not vanish; those that only stand elsewhere do not."""

from dataclasses import replace

import numpy as np
import pytest
from assembled import box, permuted_nodes, stiffness
from supported import given

from unassemble.elasticity.doubts import unconfirmed
from unassemble.elasticity.materials.cells import recognise_cells
from unassemble.elasticity.nodal import nodal_matrix
from unassemble.elasticity.rows.grouping import by_first_row
from unassemble.elasticity.rows.traces import unaccounted
from unassemble.elasticity.scattered.leftover import leftover_joined
from unassemble.elasticity.unknowns import given_numbering


def test_what_a_roller_takes_is_accounted_for_and_what_came_apart_is_not():
    whole = permuted_nodes(stiffness("tri-p1", box("tri-p1", (8, 9), perturb=0.2), lam=1.5, mu=1.0), seed=1)
    case = given(whole, "roller", "at random", "stored")
    live = np.ones(len(case.node), dtype=bool)
    node = by_first_row(case.node)
    assert not unaccounted(case.matrix, live, node, case.direction, 2).any()
    far = np.flatnonzero(case.points[case.node, 0] > 0.7)
    torn = far[case.direction[far] == 1][:3]
    apart = node.copy()
    apart[torn] = node.max() + 1 + np.arange(3)
    lost = unaccounted(case.matrix, live, apart, case.direction, 2)
    assert lost.sum() == 6
    assert lost[node[torn], 1].all()
    assert lost[apart[torn], 0].all()


def test_a_penalty_is_no_trace():
    whole = permuted_nodes(stiffness("quad-q1", box("quad-q1", (6, 7)), lam=1.5, mu=1.0), seed=1)
    case = given(whole, "penalty clamp", "interleaved", "stored")
    some = int(case.node[np.argmin(case.points[case.node].sum(axis=1))])
    rows = np.flatnonzero(case.node == some)
    node = case.node.copy()
    node[rows[1]] = node.max() + 1
    lost = unaccounted(case.matrix, np.ones(len(node), dtype=bool), node, case.direction, 2)
    assert lost[some, 1]
    assert lost[-1, 0]
    assert lost.sum() == 2


@pytest.mark.parametrize(("kind", "counts"), [("tri-p1", (8, 9)), ("tet-p1", (7, 4, 4))])
@pytest.mark.parametrize("support", ["free", "roller"])
def test_rows_that_are_left_are_joined_and_nodes_on_a_roller_are_not(kind, counts, support):
    """Zeros dropped, at random; nodes on the roller lack a row as well, but not without a trace."""
    whole = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), lam=1.5, mu=1.0), seed=1)
    case = given(whole, support, "at random", "dropped", seed=4)
    d = whole.dim
    node = by_first_row(case.node)
    far = np.unique(node[case.points[case.node, 0] > 0.6])
    torn = np.isin(node, far[::3]) & (case.direction > 0)
    apart = np.where(torn, node.max() + 1 + np.arange(len(node)), node)
    live = np.ones(len(node), dtype=bool)
    found = leftover_joined(case.matrix, live, by_first_row(apart), case.direction, d)
    assert found.max() < by_first_row(apart).max()
    pairs = np.unique(np.column_stack([found, node]), axis=0)
    assert np.bincount(pairs[:, 0]).max() == 1  # nothing joined that does not belong together
    assert len(pairs) - len(np.unique(node)) < 0.2 * torn.sum()


def test_only_rows_that_entries_show_are_believed_next_to_doubtful_ones():
    """That cells re-assemble says nothing of a row none of whose entries was compared."""
    whole = permuted_nodes(stiffness("tri-p1", box("tri-p1", (6, 6), perturb=0.2), lam=1.5, mu=1.0), seed=1)
    case = given(whole, "roller", "interleaved", "stored")
    numbering = given_numbering(case.matrix, by_first_row(case.node), case.direction)
    nodal = replace(nodal_matrix(case.matrix, numbering), doubtful=np.ones(numbering.n_nodes, dtype=bool))
    points = np.zeros((nodal.n, 2))
    points[numbering.node_of_row] = case.points[case.node]
    shown = recognise_cells(nodal, points).shown
    assert not unconfirmed(nodal, numbering, points, shown).any()
    shown[5, 1] = False
    assert np.flatnonzero(unconfirmed(nodal, numbering, points, shown)).tolist() == [5]
    assert unconfirmed(nodal, numbering, points, None).all()


def test_cells_with_nodes_that_have_no_coordinates_are_left_out():
    whole = stiffness("quad-q1", box("quad-q1", (5, 5)), lam=1.5, mu=1.0)
    rows = np.arange(whole.matrix.shape[0])
    numbering = given_numbering(whole.matrix, rows // 2, rows % 2)
    cells = recognise_cells(nodal_matrix(whole.matrix, numbering), whole.points)
    some = np.ones(len(whole.points), dtype=bool)
    some[cells.cells[0, 0]] = False
    left = cells.among(some)
    assert 0 < left.n_cells < cells.n_cells
    assert some[left.cells].all()
    assert len(left.lame) == left.n_cells
    assert not cells.among(~np.ones_like(some)).recognised
