"""Analysis in a thread of its own: the same factorisation, whether or not the pattern was foreseen."""

import numpy as np
import pytest

from meshes import edge_list, random_mesh, specimen
from unassemble import linalg, recover
from unassemble.linalg import AnalysisAhead, factorisation, upper_from_edges


def hermitian(seed):
    """Diagonally dominant on a mesh's graph, complex."""
    points, triangles = random_mesh(400, seed)
    edges, n = edge_list(triangles), len(points)
    entries = np.random.default_rng(seed).standard_normal((len(edges), 2)) @ [1, 1j]
    return upper_from_edges(n, edges, entries, np.full(n, 20 + 0j))


@pytest.mark.fallback
@pytest.mark.parametrize("foreseen", [True, False])
def test_factorisation_is_that_of_the_matrix(foreseen):
    matrix = hermitian(0)
    analyse = AnalysisAhead(matrix.with_data(0 * matrix.data) if foreseen else hermitian(1), 1)
    factor, plain = analyse(matrix), factorisation(matrix)
    rhs = np.ones(matrix.n, complex)
    for f in (factor, plain):
        f.factorise(matrix)
    assert np.array_equal(factor.solve(rhs), plain.solve(rhs))
    assert np.abs(matrix.full() @ factor.solve(rhs) - rhs).max() < 1e-13


def test_recovery_does_not_depend_on_it(monkeypatch):
    known = specimen(*random_mesh(3000, seed=5), c=2.0)
    ahead = recover(known.matrix, refine=False)
    monkeypatch.setattr("unassemble.scalar.recover.AnalysisAhead", lambda pattern, threads: linalg.factorisation)
    assert np.array_equal(recover(known.matrix, refine=False).points, ahead.points)
