"""Both sparse solvers, one interface, the same answers."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp

from unassemble import InputError
from unassemble.linalg import UpperTriangle, backend, factorisation, pardiso, threads, upper_from_edges

SOLVERS = [
    pytest.param("pardiso", marks=pytest.mark.skipif(not pardiso.available(), reason="MKL is not installed")),
    "superlu",
]


@pytest.fixture(params=SOLVERS)
def solver(request, monkeypatch):
    monkeypatch.setenv("UNASSEMBLE_SOLVER", request.param)
    assert backend() == request.param
    return request.param


def random_hermitian(n, dtype, seed=0):
    rng = np.random.default_rng(seed)
    edges = np.unique(np.sort(rng.integers(0, n, (4 * n, 2)), axis=1), axis=0)
    edges = edges[edges[:, 0] < edges[:, 1]]
    values = rng.standard_normal(len(edges))
    if dtype is complex:
        values = values + 1j * rng.standard_normal(len(edges))
    diagonal = 0.1 + np.bincount(edges.ravel(), np.repeat(np.abs(values), 2), n)
    return upper_from_edges(n, edges, values, diagonal)


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("columns", [None, 3])
def test_solution_satisfies_the_system(solver, dtype, columns):
    matrix = random_hermitian(200, dtype)
    full = matrix.full()
    assert abs(full - full.conj().T).max() == 0
    rhs = np.random.default_rng(1).standard_normal((200,) if columns is None else (200, columns)).astype(dtype)
    factor = factorisation(matrix)
    for scale in (1.0, 3.0):  # the second uses the same analysis
        factor.factorise(matrix.with_data(scale * matrix.data))
        assert np.abs(scale * (full @ factor.solve(rhs)) - rhs).max() < 1e-12
    factor.release()


def test_indefinite_matrix(solver):
    matrix = random_hermitian(100, complex)
    shift = np.where(matrix.indices == np.repeat(np.arange(100), np.diff(matrix.indptr)), 5.0, 0.0)
    shifted = matrix.with_data(matrix.data - shift)
    rhs = np.ones(100, dtype=complex)
    factor = factorisation(shifted)
    factor.factorise(shifted)
    assert np.abs(shifted.full() @ factor.solve(rhs) - rhs).max() < 1e-10


def test_blocks(solver):
    scalar = random_hermitian(60, float)
    rng = np.random.default_rng(2)
    blocks = np.einsum("k,ij->kij", scalar.data, np.eye(2)) + 0.01 * rng.standard_normal((len(scalar.data), 2, 2))
    on_diagonal = scalar.indptr[:-1]
    blocks[on_diagonal] = (blocks[on_diagonal] + blocks[on_diagonal].transpose(0, 2, 1)) / 2
    matrix = UpperTriangle(blocks, scalar.indices, scalar.indptr)
    full = matrix.full()
    assert full.shape == (120, 120)
    assert abs(full - full.T).max() == 0
    assert full[0, 1] == blocks[0, 0, 1]
    rhs = rng.standard_normal(120)
    factor = factorisation(matrix)
    factor.factorise(matrix)
    assert np.abs(full @ factor.solve(rhs) - rhs).max() < 1e-12


def test_any_integers_serve_as_indices(solver):
    small = random_hermitian(50, float)
    matrix = UpperTriangle(small.data, small.indices.astype(np.int64), small.indptr.astype(np.int64))
    factor = factorisation(matrix)
    factor.factorise(matrix)
    assert np.abs(matrix.full() @ factor.solve(np.ones(50)) - 1).max() < 1e-12


@pytest.mark.parametrize("columns", [[0, 1, 1, 1], [0, 2, 1, 1], [1, 0, 1, 1], [0, 1, 2, 1]])
def test_columns_that_pardiso_would_leave_its_memory_with_are_refused(columns):
    with pytest.raises(ValueError, match="upper triangle"):
        UpperTriangle(np.ones(4), np.array(columns), np.array([0, 3, 4]))


def test_triangle_from_edges_matches_scipy():
    edges = np.array([[0, 1], [0, 3], [2, 3]])
    matrix = upper_from_edges(4, edges, np.array([1.0, 2.0, 3.0]), np.array([9.0, 8.0, 7.0, 6.0]))
    expected = sp.coo_array(([1, 2, 3, 9, 8, 7, 6], ([0, 0, 2, 0, 1, 2, 3], [1, 3, 3, 0, 1, 2, 3])), shape=(4, 4))
    upper = sp.csr_array((matrix.data, matrix.indices, matrix.indptr), shape=(4, 4))
    assert abs(upper - expected).max() == 0


def test_unknown_solver_is_refused(monkeypatch):
    monkeypatch.setenv("UNASSEMBLE_SOLVER", "mumps")
    with pytest.raises(InputError, match="pardiso"):
        backend()


WITHOUT_MKL = """
import ctypes

from unassemble.linalg import backend

def missing(*args, **options):
    raise OSError("no such file")

ctypes.CDLL = missing
print(backend())
"""


def test_fallback_where_mkl_is_missing(monkeypatch):
    def tried(solver):
        monkeypatch.setenv("UNASSEMBLE_SOLVER", solver)
        return subprocess.run([sys.executable, "-c", WITHOUT_MKL], capture_output=True, text=True)

    assert tried("").stdout.strip() == "superlu"
    assert "unassemble[fast]" in tried("pardiso").stderr


def test_thread_limit():
    from threadpoolctl import threadpool_info

    np.ones((2, 2)) @ np.ones((2, 2))
    with threads(1):
        assert {pool["num_threads"] for pool in threadpool_info()} == {1}
    with threads(None):
        pass
    with pytest.raises(InputError, match="at least 1"):
        threads(0)
