"""Semidefinite matrices most of whose unknowns are in no equation."""

import numpy as np
import scipy.sparse as sp

from unassemble.linalg import UpperTriangle, nearly_singular


def test_unknowns_in_no_equation_do_not_set_the_shift():
    path = sp.diags_array([-np.ones(4), 2 * np.ones(5), -np.ones(4)], offsets=[-1, 0, 1])
    nothing = np.finfo(float).tiny * sp.eye_array(20)
    matrix = UpperTriangle.of(sp.csr_array(sp.block_diag([path, nothing])))
    with nearly_singular(matrix) as solver:
        solution = solver.solve(np.ones((25, 1)))
    assert np.isfinite(solution).all()
    assert np.abs(solution).max() < 1e15
