"""Nodes in space with displacements only, of any material and element: what turns rigidly says where they are."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from built import Built, add_members, assembled, cells_of, curved, error, model_on, sound
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, MeshHex

from unassemble import recover


def anisotropic(counts=(4, 4, 5), seed: int = 0) -> Built:
    """Trilinear hexahedra of a material without symmetry, inner nodes moved."""
    rng = np.random.default_rng(seed)
    axes = [np.linspace(0, 1, k) for k in counts]
    mesh = MeshHex.init_tensor(*axes)
    mesh = MeshHex(mesh.p + rng.uniform(-0.04, 0.04, mesh.p.shape), mesh.t)
    root = rng.standard_normal((6, 6))
    stiff = root @ root.T + np.eye(6)
    voigt = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))

    @BilinearForm
    def energy(u, v, _):
        strain, test = ([one.grad[a, b] + one.grad[b, a] for a, b in voigt] for one in (u, v))
        return sum(stiff[k, m] * strain[m] * test[k] for k in range(6) for m in range(6))

    basis = Basis(mesh, ElementVector(ElementHex1()))
    matrix = sp.csr_array(energy.assemble(basis))
    rows = basis.nodal_dofs.T.ravel()
    return Built(sp.csr_array(matrix[rows][:, rows]), mesh.p.T, np.zeros((0, 2), np.int64), (0, 1, 2))


def trough(counts=(7, 6)) -> Built:
    """Flat membranes along a curve, of all sizes, with bars along some of their sides."""
    rng = np.random.default_rng(3)
    axes = [np.sort(np.linspace(0, 2, k) + rng.uniform(-0.1, 0.1, k)) for k in counts]
    points = curved(*(part.ravel() for part in np.meshgrid(*axes, indexing="ij")))
    model = model_on(points)
    ends = np.array([(k, k + 1) for k in range(len(points) - 1) if (k + 1) % counts[1]][::2])
    add_members(model, ends, 0, pinned=True)
    given = assembled(model, points, ends)
    matrix = given.matrix
    for k, corners in enumerate(cells_of(counts)):
        model.add_quad(str(k), *map(str, corners), 0.05, "steel")
        quad = model.quads[str(k)]
        quad.ke()  # sets its axes
        part = quad.T().T @ quad.ke_m() @ quad.T()
        rows = (6 * corners[:, None] + np.arange(6)).ravel()
        place = np.repeat(rows, 24), np.tile(rows, 24)
        matrix = matrix + sp.csr_array((np.asarray(part).ravel(), place), shape=matrix.shape)
    return replace(given, matrix=sp.csr_array(matrix + matrix.T) / 2).only((0, 1, 2), 3)


MAKE = [anisotropic, trough]


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("make", MAKE)
def test_come_back_up_to_size(make, held):
    given = make().permuted(1)
    if held:
        given = given.clamped(given.points[:, 2] < given.points[:, 2].min() + 0.2 * np.ptp(given.points[:, 2]))
    found = recover(given.matrix)
    assert found.certified, found.reason
    assert found.operator == "structure"
    known = np.isfinite(found.points).all(axis=1)
    assert known.mean() > 0.7
    assert error(found.points, given.points, scaled=True) < 1e-9
    assert not len(found.triangles)
    if not held:
        assert len(found.quads) == (30 if make is trough else 0)
        modes = found.rigid_body_modes()
        assert modes.shape[1] == 6
        assert np.abs(given.matrix @ modes).max() < 1e-9 * np.abs(given.matrix).max()


@pytest.mark.parametrize("make", MAKE)
def test_springs_are_no_part_of_it(make):
    """Springs to the ground, or between neighbours across their line, that are few or the same everywhere."""
    given = make().permuted(2)
    rng = np.random.default_rng(0)
    n = len(given.points)
    entry = sp.triu(given.matrix, 1).tocoo()
    true = np.repeat(given.points, 3, axis=0)
    for some in (rng.choice(3 * n, 1), rng.choice(3 * n, 9), np.arange(3 * n), np.arange(2, 3 * n, 3)):
        sound(given.with_springs(some, share=0.05).matrix, true)
    same = np.flatnonzero(entry.row % 3 == entry.col % 3)
    for count in (1, 20, len(same)):
        pick = rng.choice(same, count, replace=False)
        sound(given.with_springs(entry.row[pick], entry.col[pick], share=0.05).matrix, true)
