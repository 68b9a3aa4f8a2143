"""The shortest least-squares solution of a sparse system."""

import numpy as np
import pytest
import scipy.sparse as sp

from unassemble.linalg import least_norm


@pytest.mark.parametrize("seed", range(3))
def test_against_a_dense_decomposition(seed):
    rng = np.random.default_rng(seed)
    n = 60
    chain = sp.diags_array([np.ones(n), -np.ones(n)], offsets=[0, 1], shape=(n, n + 1)).toarray().astype(complex)
    free = np.zeros((n, 5), dtype=complex)
    rotated = chain * np.exp(2j * np.pi * rng.random((n, 1)))
    system = np.vstack([np.hstack([rotated, free]), np.hstack([rotated[:3], free[:3]])])
    right = system @ (rng.standard_normal(n + 6) + 1j * rng.standard_normal(n + 6))
    expected = np.linalg.lstsq(system, right, rcond=1e-12)[0]
    found = least_norm(sp.csr_array(system), right)
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_nothing_to_solve():
    assert not least_norm(sp.csr_array((3, 2), dtype=complex), np.ones(3, complex)).any()
