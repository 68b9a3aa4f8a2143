"""Directions that are not coupled, some of whose unknowns are gone: cells have the numbers of the nodes."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from skfem.models.poisson import laplace

from unassemble import recover


def squares(nx: int, ny: int) -> tuple[sp.csr_array, np.ndarray]:
    """The Laplacian of squares cut in two without its zeros, rows permuted, and the points."""
    mesh = skfem.MeshTri.init_tensor(np.arange(nx, dtype=float), 1.1 * np.arange(ny))
    matrix = sp.csr_array(laplace.assemble(skfem.Basis(mesh, skfem.ElementTriP1())))
    turn = np.random.default_rng(nx).permutation(matrix.shape[0])
    matrix = sp.csr_array(matrix[turn][:, turn])
    matrix.data[np.abs(matrix.data) < 1e-14] = 0
    matrix.eliminate_zeros()
    return matrix, mesh.p.T[turn]


def path(n: int) -> sp.csr_array:
    """A strip of right triangles, which fold to either side."""
    ends = np.ones(n - 1)
    degree = np.convolve(ends, [1, 1])
    return sp.csr_array(sp.diags_array([-ends, degree, -ends], offsets=[-1, 0, 1]))


def test_cells_are_those_of_the_nodes():
    """Of each body one direction is gone: the one with most nodes has no rows of the others."""
    small, _ = squares(3, 4)
    large, points = squares(6, 5)
    strip = path(7)
    matrix = sp.csr_array(sp.block_diag([small, large, strip]))
    a, b, c = (part.shape[0] for part in (small, large, strip))
    direction = np.repeat([1, 0, 0], [a, b, c])
    turn = np.random.default_rng(0).permutation(a + b + c)
    matrix, direction = sp.csr_array(matrix[turn][:, turn]), direction[turn]
    found = recover(matrix, numbering=(np.arange(a + b + c), direction))
    assert found.operator == "vector laplacian"
    place = np.full((a + b + c, 2), np.nan)
    place[a : a + b] = points
    place = place[turn]
    cells = np.split(found.polygons_data, found.polygons_offsets[1:-1])
    corners = [place[cell] for cell in cells if np.isfinite(place[cell]).all()]
    assert len(corners) == 5 * 4
    for x in corners:
        assert np.ptp(x, axis=0) == pytest.approx([1, 1.1])
