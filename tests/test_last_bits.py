"""The same answer whatever the last bits of the entries are, and in whatever order the rows come."""

import numpy as np
import pytest
import scipy.sparse as sp
from arithmetic import perturbed

from families import FAMILIES, member
from meshes import random_mesh, specimen
from unassemble import RecoveryError, recover

LONGER = {"glued", "integer", "lattice", "stairs"}  # seconds: not again under every arithmetic
SLOW = {"gnawed", "kites", "perforated", "pierced", "riddled"}  # long searches
#: Searches that end at another best guess where the rows come in another order, certified or not: never wrong.
ORDER_DECIDES = {("integer", 0), ("glued", 1)}


def said(matrix):
    """Status and uniqueness; of what is certified also the operator, the number of cells and of unplaced points."""
    try:
        found = recover(matrix)
    except RecoveryError as refusal:
        return ("refused", type(refusal).__name__)
    if not found.certified:
        return (found.status, found.uniqueness)
    return (found.status, found.uniqueness, found.operator, found.n_cells, np.count_nonzero(found.node_status))


def in_another_order(matrix, seed):
    order = np.random.default_rng(seed).permutation(matrix.shape[0])
    return sp.csr_array(matrix[order][:, order])


def conditions(rng):
    """A mesh without the rows of its boundary on one side."""
    known = specimen(*random_mesh(200, int(rng.integers(1000))))
    kept = np.flatnonzero(known.points[:, 0] > known.points[:, 0].min() + 0.05)
    return sp.csr_array(known.matrix[kept][:, kept])


def specimens():
    for family in [*FAMILIES, "one side taken out"]:
        for seed in range(2):
            again = seed == 0 and family not in LONGER
            marks = [pytest.mark.slow] if family in SLOW else [pytest.mark.arithmetic] if again else []
            yield pytest.param(family, seed, marks=marks, id=f"{family}-{seed}")


def matrix_of(family, seed):
    if family in FAMILIES:
        return sp.csr_array(member(family, seed)[0].matrix)
    return conditions(np.random.default_rng(seed))


@pytest.mark.parametrize(("family", "seed"), list(specimens()))
def test_what_is_said_does_not_hang_on_the_last_bits(family, seed):
    matrix = matrix_of(family, seed)
    assert said(perturbed(matrix, seed)) == said(matrix)


@pytest.mark.parametrize(("family", "seed"), list(specimens()))
def test_what_is_said_does_not_hang_on_the_order_of_the_rows(family, seed, request):
    if (family, seed) in ORDER_DECIDES:
        request.applymarker(pytest.mark.xfail(reason="the search ends at another best guess", strict=False))
    matrix = matrix_of(family, seed)
    assert said(in_another_order(matrix, seed)) == said(matrix)


def test_entries_are_moved_by_a_unit_in_the_last_place_and_stay_symmetric():
    matrix = specimen(*random_mesh(100)).matrix
    moved = perturbed(matrix)
    assert abs(moved - moved.T).max() == 0
    off = (moved - matrix).tocoo()
    assert np.abs(off.data).max() > 0
    assert (np.abs(moved.data - matrix.data) <= np.spacing(np.abs(matrix.data))).all()
