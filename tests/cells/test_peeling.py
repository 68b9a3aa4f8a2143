"""Triangles told from triangular holes one after the other, from the boundary inwards."""

import numpy as np
import pytest

from families import FAMILIES
from meshes import specimen
from unassemble import recover
from unassemble.cells.propagate import ContradictionError, lone_scales, told
from unassemble.topology import three_cycles
from vanishing import forgotten


def cycles_of(known):
    """Its 3-cycles, their edges, the weights, and which are triangles of the mesh."""
    upper = known.matrix.tocoo()
    chosen = upper.row < upper.col
    order = np.lexsort((upper.col[chosen], upper.row[chosen]))
    edges = np.column_stack([upper.row[chosen], upper.col[chosen]])[order].astype(np.int64)
    cycles, opposite = three_cycles(len(known.points), edges)
    true = {tuple(sorted(t)) for t in known.triangles.tolist()}
    return opposite, -upper.data[chosen][order], np.array([tuple(sorted(t)) in true for t in cycles.tolist()])


def lattice(seed, c=1.0):
    """One without right angles, of those that the benchmark draws after a scale."""
    rng = np.random.default_rng(seed)
    rng.choice(3)
    return forgotten(specimen(*FAMILIES["lattice"](rng), c=c, seed=seed))


@pytest.mark.parametrize("c", [1.0, -2.5])
@pytest.mark.parametrize("seed", [1, 9, 13, 15])
def test_what_is_peeled_is_right(seed, c):
    sides, weights, true = cycles_of(lattice(seed, c))
    assert list(lone_scales(sides, weights)) == [pytest.approx(c, rel=1e-9)]
    state = told(sides, 2 * weights / c)
    assert true[state == 1].all()
    assert not true[state == -1].any()
    assert (state == 1).sum() > 0.6 * true.sum()


def test_a_wrong_scale_is_contradicted():
    sides, weights, _ = cycles_of(lattice(13))
    for wrong in (0.7, 1.3, 2.0):
        with pytest.raises(ContradictionError):
            told(sides, 2 * weights / wrong)


def test_random_weights_agree_in_no_scale():
    sides, weights, _ = cycles_of(lattice(13))
    assert list(lone_scales(sides, np.random.default_rng(0).uniform(0.2, 2, len(weights)))) == []


def test_a_right_angle_across_an_inner_edge():
    """Taken for a cell because of its other sides, a triangle may have no part in the weight of the third."""
    cotangents = np.array([1.0, 1.0, 2.0, 0.5, 0.0])
    state = told(np.array([[0, 1, 4], [2, 3, 4]]), cotangents)
    assert state.tolist() == [1, 1]


@pytest.mark.parametrize("seed", [5, 13])
def test_lattices_with_many_holes(seed):
    """Of equilateral and arbitrary triangles, many of them on hinges only."""
    known = lattice(seed, c=-2.5)
    assert recover(known.matrix).status == "certified"
