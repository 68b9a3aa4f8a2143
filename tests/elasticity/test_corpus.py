"""Elastic bodies on third-party meshes: every shape, grading and angle that mesh generators leave."""

from zlib import crc32

import numpy as np
import pytest
import skfem
from assembled import Assembled, eliminated, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given

from meshes import SHARED, needs_shared

FOLDERS = {"planar": ("triangles", "tri-p1", "tri-p2"), "quad": ("quads", "quad-q1"), "tet": ("tets", "tet-p1")}
MATERIALS = {"one": {"lam": 1.5}, "varying": {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}}
TYPES = {"triangles": skfem.MeshTri, "quads": skfem.MeshQuad, "tets": skfem.MeshTet}
MOST = {"tri-p1": 2000, "quad-q1": 1000, "tet-p1": 2000, "tri-p2": 500}  # vertices
FEWEST = 60  # fewer of them, with one side held, leave next to nothing


def specimens() -> list:
    """Mesh, cells and kind of element, for meshes of one kind of cell."""
    found = []
    for folder, (cells, *kinds) in FOLDERS.items():
        for path in sorted((SHARED / "corpus" / folder).glob("*.npz")):
            arrays = np.load(path)
            if folder != "planar" and "triangles" in arrays.files:
                continue
            for kind in kinds:
                if FEWEST < len(arrays["points"]) < MOST[kind]:
                    found.append(pytest.param(path, cells, kind, id=f"{path.stem}-{kind}"))
    return found


def body(path, cells, kind, material) -> Assembled:
    """Assembled on a mesh that was moved and scaled to begin in 0 and be 1 long, nodes numbered at random."""
    found = np.load(path)
    used, place = np.unique(found[cells], return_inverse=True)
    points = found["points"][used].astype(float)
    points = (points - points.min(axis=0)) / np.ptp(points)
    mesh = TYPES[cells](points.T.copy(), place.reshape(found[cells].shape).T.copy())
    return permuted_nodes(stiffness(kind, mesh, **MATERIALS[material]), seed=1)


def one_side_held(case: Assembled) -> Assembled:
    """Without the nodes of the leftmost tenth, which is anything but straight."""
    gone = case.points[:, 0] < 0.1 * case.points[:, 0].max()
    matrix, nodes = eliminated(case, np.repeat(gone[:, None], case.dim, axis=1))
    return Assembled(matrix, case.points[nodes], np.empty((0, case.cells.shape[1]), int))


@needs_shared
@pytest.mark.parametrize(("path", "cells", "kind"), specimens())
def test_bodies_on_third_party_meshes(path, cells, kind):
    turn = crc32(f"{path.stem} {kind}".encode())
    for k, (material, held) in enumerate([("one", True), ("varying", False)]):
        case = body(path, cells, kind, material)
        case = one_side_held(case) if held else case
        order = ("interleaved", "by component", "at random")[(turn + k) % 3]
        missing = held * (0.5 if kind == "tet-p1" else 0.1)
        if (kind, order) == ("tri-p2", "at random"):  # nodes of one triangle only couple to the same unknowns
            missing += 0.12
        assert_certified(given(case, "free", order, "stored"), 1e-8, missing)
