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


def bend() -> skfem.MeshHex2:
    """A gutter around a bend: all its sides are curved."""
    mesh = skfem.MeshHex.init_tensor(np.linspace(np.pi, 2 * np.pi, 9), np.linspace(0.6, 1, 3), np.linspace(0, 2, 13))
    curved = skfem.MeshHex2.from_mesh(mesh)
    around, radius, along = curved.doflocs
    out = 2 + radius * np.cos(around)
    place = np.stack([out * np.cos(along), out * np.sin(along), radius * np.sin(around)])
    return skfem.MeshHex2(place, curved.t)


def plate() -> skfem.MeshTri2:
    """A quarter of a plate around a hole, whose sides there are arcs."""
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 1, 9) ** 1.4, np.linspace(0, 1, 13))
    bent = skfem.MeshTri2.from_mesh(mesh)
    outward, along = bent.doflocs
    angle = 0.5 * np.pi * along
    arc = np.stack([np.cos(angle), np.sin(angle)])
    square = 2.5 * arc / np.abs(arc).max(axis=0)
    return skfem.MeshTri2((1 - outward) * arc + outward * square, bent.t)


BODIES = {
    "bracket": (bracket, skfem.ElementHex1, lambda x: x[0] == 0, "node by node"),
    "tower": (tower, skfem.ElementTetP1, lambda x: x[2] == 0, "component by component"),
    "arch": (arch, skfem.ElementQuad1, lambda x: np.abs(x[1]) < 1e-12, "node by node"),
    "wing": (wing, skfem.ElementTriP1, None, "rows at random"),
    "bend": (bend, skfem.ElementHex2, lambda x: np.abs(x[1]) < 1e-12, "node by node"),
    "plate": (plate, skfem.ElementTriP2, lambda x: np.abs(x[1]) < 1e-12, "node by node"),
}


def matrix_of(name: str) -> tuple[sp.csr_array, np.ndarray, np.ndarray]:
    """A matrix, and the true place and direction behind each of its rows."""
    mesh, element, held, order = BODIES[name]
    # Three quadrature points in each direction of quadratic hexahedra, as in most codes.
    basis = skfem.Basis(mesh(), skfem.ElementVector(element()), intorder=5 if element is skfem.ElementHex2 else None)
    # What eliminates nothing stores every entry of every element, zeros too.
    matrix = linear_elasticity(1.0, 1.0).assemble(basis).tocsr()
    unknowns = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
    rows = np.concatenate([some for some in unknowns if some is not None and some.size], axis=1).T.ravel()
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
        known = found.node_status == 0
        a, b = (x[known] - x[known].mean(axis=0) for x in (found.points, truth))
        scale = (a * b).sum() / (a * a).sum()
        error = np.linalg.norm(scale * a - b, axis=1).max() / np.linalg.norm(np.ptp(b, axis=0))
        kinds = ", ".join(f"{len(cells)} {kind}" for kind, cells in found.cells.items())
        print(f"{name}: {matrix.shape[0]} rows {found.numbering}, {kinds}, {found.status}, error {error:.0e}")
        found.plot(Path(__file__).parent / "_static" / f"elastic-{name}.png")


if __name__ == "__main__":
    main()
