"""The main job on two matrices that this library did not assemble."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp
from numpy.typing import NDArray

from .errors import InputError
from .files import made_folder, whole_file
from .pipeline import recover
from .plot import plot_comparison
from .recovery import Recovery
from .report import write_report
from .summary import summary

_MISSING = "the demonstration needs {name}: pip install 'unassemble[demo]'"


@dataclass(frozen=True, eq=False)
class Specimen:
    """A matrix with the mesh that it came from, kept aside for comparison.

    Attributes
    ----------
    name, origin : str
    matrix : (n, n) sparse
    points : (n, 2) float64
        True positions of the matrix rows.
    """

    name: str
    origin: str
    matrix: sp.coo_array
    points: NDArray[np.float64]


def run(folder: str | Path = "demo-output", *, echo: Callable[[str], None] = lambda line: None) -> list[Recovery]:
    """Write, read and recover both matrices; meshes, reports and pictures go to `folder`.

    Parameters
    ----------
    folder : path
        Made where it does not exist.
    echo : callable
        Receives the text for the user, line by line or in blocks.

    Raises
    ------
    InputError
        If a package that meshes or assembles is not installed, or the folder cannot be written into.
    """
    folder = made_folder(folder)
    recoveries = []
    for specimen in (unit_square(), lake()):
        file = folder / f"{specimen.name}.mtx"
        with whole_file(file, ".mtx") as draft, draft.open("wb") as stream:  # given a name, scipy misses a full disk
            scipy.io.mmwrite(stream, specimen.matrix, symmetry="symmetric", precision=17)
        echo(f"{specimen.name}: {specimen.origin}\n")
        recovery = recover(file)
        recovery.save(folder / f"{specimen.name}.vtu")
        write_report(recovery, folder / f"{specimen.name}.json")
        plot_comparison(specimen.points, recovery, folder / f"{specimen.name}.png")
        echo(summary(recovery))
        echo(f"\nin {folder}: {specimen.name}.mtx, .vtu, .json and .png (true and recovered mesh)\n")
        recoveries.append(recovery)
    return recoveries


def unit_square() -> Specimen:
    """The Laplacian on an unstructured mesh of the unit square, as PyAMG's gallery has it."""
    try:
        from pyamg.gallery import load_example
    except ImportError as error:
        raise InputError(_MISSING.format(name="pyamg")) from error
    data = load_example("unit_square")
    matrix = sp.coo_array(data["A"])
    return Specimen("unit_square", "matrix and mesh from the gallery of PyAMG", matrix, data["vertices"][:, :2])


def lake(size: float = 0.055) -> Specimen:
    """A lake with islands: meshed by Netgen, assembled by scikit-fem, scaled, shifted and shuffled.

    The matrix is -2.5 L + D with random D, and its rows are in random order, so that neither scale, nor row sums,
    nor numbering helps.

    Parameters
    ----------
    size : float
        Mesh size; the lake is 4 wide.
    """
    try:
        from skfem import Basis, ElementTriP1, MeshTri
        from skfem.models import laplace
    except ImportError as error:
        raise InputError(_MISSING.format(name="scikit-fem")) from error
    points, triangles = _lake_mesh(size)
    mesh = MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))
    stiffness = laplace.coo_data(Basis(mesh, ElementTriP1()))  # its conversion to a matrix would drop zeros
    rng = np.random.default_rng(2002)
    place = rng.permutation(len(points))
    # Index by index: adding sparse matrices would drop zeros as well.
    row = np.append(place[stiffness.indices[0]], np.arange(len(points)))
    column = np.append(place[stiffness.indices[1]], np.arange(len(points)))
    value = np.append(-2.5 * stiffness.data, rng.standard_normal(len(points)))
    matrix = sp.coo_array((value, (row, column)), shape=(len(points), len(points)))
    matrix.sum_duplicates()
    return Specimen(
        "lake",
        "a lake with islands, meshed by Netgen, assembled by scikit-fem, turned into -2.5 L + D, rows shuffled",
        matrix,
        points[np.argsort(place)],
    )


def _lake_mesh(size: float) -> tuple[NDArray, NDArray]:
    """Points (n, 2) and triangles (m, 3) of a shore and four islands, all closed splines."""
    try:
        from netgen.geom2d import SplineGeometry
    except ImportError as error:
        raise InputError(_MISSING.format(name="netgen-mesher")) from error
    geometry = SplineGeometry()
    angle = 2 * np.pi * np.arange(14) / 14
    radius = 1 + 0.16 * np.cos(2 * angle + 0.4) + 0.13 * np.sin(3 * angle) + 0.07 * np.cos(5 * angle + 1)
    _closed_curve(geometry, 2 * radius * np.cos(angle), 1.25 * radius * np.sin(angle), inside=1, outside=0)
    for x, y, a, b, turn in (
        (-0.9, 0.25, 0.34, 0.20, 0.5),
        (0.15, -0.45, 0.22, 0.16, 0.0),
        (0.75, 0.35, 0.30, 0.14, -0.6),
        (-0.2, 0.55, 0.12, 0.10, 0.0),
    ):
        ring = 2 * np.pi * np.arange(8) / 8
        bump = 1 + 0.12 * np.cos(3 * ring + x)
        u, v = a * bump * np.cos(ring), b * bump * np.sin(ring)
        across, along = np.cos(turn) * u - np.sin(turn) * v, np.sin(turn) * u + np.cos(turn) * v
        _closed_curve(geometry, x + across, y + along, inside=0, outside=1)
    mesh = geometry.GenerateMesh(maxh=size)
    return np.array(mesh.Coordinates()), mesh.Elements2D().NumPy()["nodes"][:, :3].astype(np.int64) - 1


def _closed_curve(geometry: object, x: NDArray, y: NDArray, *, inside: int, outside: int) -> None:
    """Quadratic splines through the midpoints of a control polygon, counter-clockwise."""
    n = len(x)
    corner = [geometry.AppendPoint(float(a), float(b)) for a, b in zip(x, y, strict=True)]  # type: ignore[attr-defined]
    middle = [
        geometry.AppendPoint(float(a), float(b))  # type: ignore[attr-defined]
        for a, b in zip((x + np.roll(x, -1)) / 2, (y + np.roll(y, -1)) / 2, strict=True)
    ]
    for k in range(n):
        geometry.Append(  # type: ignore[attr-defined]
            ["spline3", middle[k - 1], corner[k], middle[k]], leftdomain=inside, rightdomain=outside
        )
