"""Draw the gallery of elastic bodies: matrices assembled by scikit-fem, and what comes back from them.

python docs/make_gallery.py
"""

from pathlib import Path

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.models.elasticity import linear_elasticity

from unassemble import recover


def bracket() -> skfem.MeshHex:
    """A beam with a hole through it and a slanted end."""
    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 4, 33), np.linspace(0, 1, 7), np.linspace(0, 1.5, 13))
    centre = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.remove_elements(np.flatnonzero(np.hypot(centre[0] - 2, centre[2] - 0.75) < 0.45))
    p = mesh.p.copy()
    p[2] *= 1 - 0.12 * p[0]
    return skfem.MeshHex(p, mesh.t)


def tower() -> skfem.MeshTet:
    """A twisted column that grows thinner."""
    mesh = skfem.MeshTet.init_tensor(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), np.linspace(0, 5, 21))
    x, y, z = mesh.p
    angle, width = 0.3 * z, 1 - 0.1 * z
    turned = np.stack(
        [width * (np.cos(angle) * x - np.sin(angle) * y), width * (np.sin(angle) * x + np.cos(angle) * y), z]
    )
    return skfem.MeshTet(turned, mesh.t)


def arch() -> skfem.MeshQuad:
    """Half a ring, graded towards its inner side."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, np.pi, 61), np.linspace(0, 1, 13) ** 1.5)
    angle, depth = mesh.p
    radius = 1 + 0.6 * depth
    return skfem.MeshQuad(np.stack([-radius * np.cos(angle), radius * np.sin(angle)]), mesh.t)


def wing() -> skfem.MeshTri:
    """A cambered profile."""
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 1, 41), np.linspace(-1, 1, 9))
    x, y = mesh.p
    thickness = 0.12 * (1.1 - x) * np.sqrt(x + 0.02)
    return skfem.MeshTri(np.stack([x, 0.1 * np.sin(np.pi * x) + 1.6 * thickness * y]), mesh.t)


BODIES = {
    "bracket": (bracket, skfem.ElementHex1, lambda x: x[0] == 0, "node by node"),
    "tower": (tower, skfem.ElementTetP1, lambda x: x[2] == 0, "component by component"),
    "arch": (arch, skfem.ElementQuad1, lambda x: np.abs(x[1]) < 1e-12, "node by node"),
    "wing": (wing, skfem.ElementTriP1, None, "rows at random"),
}


def matrix_of(name: str) -> tuple[sp.csr_array, np.ndarray, np.ndarray]:
    """A matrix, and the true place and direction behind each of its rows."""
    mesh, element, held, order = BODIES[name]
    basis = skfem.Basis(mesh(), skfem.ElementVector(element()))
    # What eliminates nothing stores every entry of every element, zeros too.
    matrix = linear_elasticity(1.0, 1.0).assemble(basis).tocsr()
    rows = basis.nodal_dofs.T.ravel()
    where = basis.doflocs[:, rows].T
    if held is not None:
        rows, where = rows[~held(where.T)], where[~held(where.T)]
    d = where.shape[1]
    direction = np.tile(np.arange(d), len(rows) // d)
    if order == "component by component":
        turn = np.argsort(direction, kind="stable")
    elif order == "rows at random":
        turn = np.random.default_rng(0).permutation(len(rows))
    else:
        turn = np.arange(len(rows))
    rows, where, direction = rows[turn], where[turn], direction[turn]
    return sp.csr_array(matrix[rows][:, rows]), where, direction


def main() -> None:
    for name in BODIES:
        matrix, where, direction = matrix_of(name)
        found = recover(matrix)
        axes = [int(direction[found.direction_of_row == a][0]) for a in range(found.dim)]
        truth = np.empty_like(found.points)
        truth[found.node_of_row] = where[:, axes]
        a, b = found.points - np.nanmean(found.points, axis=0), truth - truth.mean(axis=0)
        scale = np.nansum(a * b) / np.nansum(a * a)
        error = np.nanmax(np.linalg.norm(scale * a - b, axis=1)) / np.linalg.norm(np.ptp(b, axis=0))
        kinds = ", ".join(f"{len(cells)} {kind}" for kind, cells in found.cells.items())
        print(f"{name}: {matrix.shape[0]} rows {found.numbering}, {kinds}, {found.status}, error {error:.0e}")
        found.plot(Path(__file__).parent / "_static" / f"elastic-{name}.png")


if __name__ == "__main__":
    main()
