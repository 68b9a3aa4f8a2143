"""A few of the inputs of ``benchmarks/hostile.py``, always the same."""

import numpy as np
import pytest
import scipy.sparse as sp
from hostile import KINDS, tried

from unassemble import SolverError
from unassemble.linalg import UpperTriangle, factorisation


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("damaged", "glued", "hopeless")])
def test_no_traceback_and_no_wrong_certificate(kind):
    for k in range(7):
        _, _, outcome, _, said = tried(0, k, (kind,))
        assert outcome not in ("WRONG", "CRASH", "SLOW"), f"--kinds {kind} --first {k}\n{said}"


@pytest.mark.parametrize("kind", ["damaged", "glued", "hopeless"])
def test_the_same_of_what_takes_longer(kind):
    _, _, outcome, _, said = tried(0, 0, (kind,))
    assert outcome not in ("WRONG", "CRASH", "SLOW"), f"--kinds {kind} --first 0\n{said}"


def test_rows_that_vanish_beside_others_are_refused():
    """PARDISO ends in a segmentation fault on many of them."""
    upper = UpperTriangle.of(sp.csr_array(np.array([[1.0, 1, 0], [1, 2, 0], [0, 0, 1e-203]])))
    with pytest.raises(SolverError, match=r"vanishes|zero|singular"):
        factorisation(upper).factorise(upper)
