"""What an inspection says of matrices of other elements, before anything is solved."""

import numpy as np
import pytest
from skfem import MeshTri

from conforming.assembled import assembled, quadrilaterals, with_hole
from meshes import random_mesh
from unassemble import inspect_matrix


@pytest.mark.parametrize("element", ["P2", "P3", "Q1", "Q2", "S2"])
def test_the_element_is_named(element):
    points, cells = random_mesh(300)
    triangles = MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    mesh = triangles if element[0] == "P" else with_hole(quadrilaterals(14, 13))
    found = inspect_matrix(assembled(element, mesh).matrix)
    assert found.element == element
    assert found.n_triangles + found.n_quads == mesh.nelements
    assert found.n_holes == (2 if element[0] == "P" else 1)
    assert found.operator.startswith("laplacian, ")
    assert found.block_size == 1
    assert element in str(found)


def test_numbers_that_are_no_element_are_not_named():
    assert not inspect_matrix(np.full((6, 6), -1.0)).element
