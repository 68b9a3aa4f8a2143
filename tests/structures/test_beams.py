"""Straight beams, assembled by scikit-fem's Hermite elements."""

import gzip
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
import skfem
from skfem.helpers import dd

from unassemble import recover

CLASSICS = Path(__file__).parents[2].parent / "shared" / "classics"


def beam(x, stiffness):
    """Bending matrix of a beam with nodes at sorted x and a stiffness EI for each member: w and dw/dx node by node."""
    mesh = skfem.MeshLine(x)
    basis = skfem.Basis(mesh, skfem.ElementLineHermite())
    form = skfem.BilinearForm(lambda u, v, w: w.stiffness * dd(u)[0][0] * dd(v)[0][0])
    matrix = form.assemble(basis, stiffness=np.repeat(stiffness[:, None], basis.X.shape[1], axis=1)).tocsr()
    return sp.csr_array(matrix[np.ravel(basis.nodal_dofs, "F")][:, np.ravel(basis.nodal_dofs, "F")])


def springs(k):
    """Path of springs."""
    ends = np.append(k, 0) + np.append(0, k)
    return sp.diags_array([-k, ends, -k], offsets=[-1, 0, 1], format="csr")


@pytest.mark.parametrize("held", [(), (0, 1), (0, -2), (0, 1, -2, -1)])
def test_a_beam_with_uneven_members_comes_back_in_true_size(held):
    rng = np.random.default_rng(len(held))
    x = np.cumsum(rng.uniform(0.5, 3, 30))
    whole = beam(x, rng.uniform(1, 9, 29))
    kept = np.delete(np.arange(60), held)
    order = rng.permutation(kept)
    found = recover(whole[order][:, order])
    assert (found.operator, found.status) == ("plane frame", "certified")
    node = order // 2
    row = np.unique(found.node_of_row, return_index=True)[1]
    placed = np.bincount(node, minlength=30)[node[row]] == 2
    assert np.array_equal(np.isfinite(found.points).all(axis=1), placed)
    expected = x[node[row[placed]]] - x[node[row[placed]]].mean()
    assert min(np.abs(found.points[placed, 0] - s * expected).max() for s in (-1, 1)) < 1e-9
    told = placed[found.node_of_row]
    assert np.array_equal(np.where(told, 1 + order % 2, -1), found.direction_of_row)
    assert len(found.lines) == placed.sum() - 1


def test_stretching_beside_bending_belongs_to_the_nodes_that_it_is_numbered_with():
    x = np.cumsum(np.random.default_rng(1).uniform(1, 2, 12))
    both = sp.block_diag([springs(3 / np.diff(x)), beam(x, np.full(11, 2.0))], format="csr")
    order = np.ravel(np.column_stack([np.arange(12), 12 + 2 * np.arange(12), 13 + 2 * np.arange(12)]))[3:-3]
    found = recover(sp.csr_array(both)[order][:, order])
    assert found.certified
    assert np.array_equal(found.node_of_row, np.repeat(np.arange(10), 3))
    assert np.array_equal(found.direction_of_row, np.tile([0, 1, 2], 10))


def test_an_entry_changed_ties_no_nodes():
    whole = beam(np.arange(10.0), np.ones(9)).tolil()
    whole[4, 6] = whole[6, 4] = whole[4, 6] * (1 + 1e-7)
    found = recover(sp.csr_array(whole))
    assert found.component.tolist() == [0] * 3 + [1] * 7
    assert "100% of the rows" not in found.reason
    for piece in range(2):
        x = found.points[found.component == piece, 0]
        assert np.abs(np.diff(x) - 1).max() < 1e-9


@pytest.mark.skipif(not CLASSICS.exists(), reason="third-party matrices are not here")
@pytest.mark.parametrize(
    ("name", "placed", "length"),
    [("nos1", 79, 9.75), ("nos2", 319, 9.9375), ("LF10", 8, 0.7 / 9), ("LFAT5", 3, 0.05)],
)
def test_classic_beams(name, placed, length):
    with gzip.open(CLASSICS / f"{name}.mtx.gz") as file:
        found = recover(sp.csr_array(scipy.io.mmread(file)))
    x = found.points[np.isfinite(found.points).all(axis=1), 0]
    assert (found.status, len(x)) == ("certified", placed)
    assert np.ptp(x) == pytest.approx(length)
