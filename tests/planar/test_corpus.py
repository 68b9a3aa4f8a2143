"""Every planar mesh of the third-party collection: certified, and right to the last digits."""

import numpy as np
import pytest

from meshes import SHARED, largest_error, largest_error_of_pieces, needs_shared, specimen, triangle_set
from unassemble import recover

MESHES = sorted((SHARED / "corpus" / "planar").glob("*.npz")) if SHARED.is_dir() else []
SLIVERS = {"meshpart_Tapir"}  # angles down to 0.002 degrees


@needs_shared
@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.stem)
def test_corpus_mesh_is_recovered(path):
    mesh = np.load(path)
    rng = np.random.default_rng(len(path.stem))
    for seed in range(2):
        c = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-3, 3))
        known = specimen(mesh["points"], mesh["triangles"], c=c, diagonal=True, seed=seed)
        found = recover(known.matrix)
        assert found.status == "certified", found.reason
        assert triangle_set(found.triangles) == triangle_set(known.triangles)
        assert found.scale == pytest.approx(c, rel=1e-9 if path.stem in SLIVERS else 1e-12)
        assert largest_error_of_pieces(found, known.points) <= (1e-9 if path.stem in SLIVERS else 1e-12)


@needs_shared
@pytest.mark.parametrize("name", ["fig5_ellipse", "fig6_rocket"])
def test_meshes_of_the_2002_paper(name):
    mesh = np.load(SHARED / "paper-meshes" / f"{name}.npz")
    known = specimen(mesh["points"], mesh["triangles"].astype(np.int64), c=-0.3)
    found = recover(known.matrix)
    assert found.status == "certified"
    assert largest_error(found.points, known.points) <= 1e-12
