"""Matrices that other packages assemble, and that of a lattice mast, with the meshes that they come from."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from unassemble.errors import InputError


@dataclass(frozen=True, eq=False)
class Specimen:
    """A matrix with the mesh that it came from, kept aside for comparison."""

    name: str
    origin: str
    matrix: sp.coo_array
    points: NDArray[np.float64]  # (n, 2) or (n, 3), true positions of the matrix rows, or of the nodes of a structure
    anchors: tuple[tuple[float, ...], ...] = ()  # (row, x, y, z) of positions that are not kept aside


def unit_square() -> Specimen:
    """The Laplacian on an unstructured mesh of the unit square, as PyAMG's gallery has it."""
    data = _needed("pyamg.gallery", "pyamg").load_example("unit_square")
    matrix = sp.coo_array(data["A"])
    return Specimen("unit_square", "matrix and mesh from the gallery of PyAMG", matrix, data["vertices"][:, :2])


def lake(size: float = 0.055) -> Specimen:
    """A lake with islands: meshed by Netgen, assembled by scikit-fem, scaled, shifted and shuffled.

    The matrix is -2.5 L + D with random D, and its rows are in random order, so that neither scale, nor row sums,
    nor numbering helps. The lake is 4 wide, and `size` that of the mesh.
    """
    skfem = _needed("skfem", "scikit-fem")
    laplace = _needed("skfem.models", "scikit-fem").laplace
    points, triangles = _lake_mesh(size)
    mesh = skfem.MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))
    stiffness = laplace.coo_data(skfem.Basis(mesh, skfem.ElementTriP1()))  # its conversion to a matrix would drop zeros
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


def mast() -> Specimen:
    """A lattice mast, as those of classic test matrices: three rows for each node, in random order of the nodes.

    A bar along e, of stiffness k, adds k e e^T to the blocks of its ends and takes it off those between them. The feet
    are held, so that they and the bars that end there are not in the matrix. The mast is as wide below as two of its
    storeys are high.
    """
    levels = 9  # storeys
    height, side = np.divmod(np.arange(4 * (levels + 1)), 4)
    turn = np.pi / 2 * (side + 0.5) + 0.02 * height
    width = np.sqrt(2) * (1 - 0.6 * height / levels)
    points = np.column_stack([width * np.cos(turn), width * np.sin(turn), height])
    low, node = np.arange(4 * levels), np.arange(4, 4 * (levels + 1))
    beside = 4 * height + (side + 1) % 4
    legs, braces, rings, floors = (low, low + 4), (low, beside[low] + 4), (node, beside[node]), (node[::4], node[2::4])
    bars = np.hstack([legs, braces, rings, floors]).T
    rng = np.random.default_rng(1976)
    along = np.diff(points[bars], axis=1)[:, 0]
    length = np.linalg.norm(along, axis=1)
    ends = np.concatenate([along, -along], axis=1) * np.sqrt(rng.uniform(1, 3, len(bars)) / length**3)[:, None]
    strain = np.zeros((len(bars), len(points), 3))
    np.put_along_axis(strain, bars[:, :, None], ends.reshape(-1, 2, 3), axis=1)
    free = rng.permutation(np.arange(4, len(points)))
    felt = strain[:, free].reshape(len(bars), -1)
    points = points[free]
    return Specimen(
        "mast",
        "a lattice mast, held at its feet, nodes shuffled, of which two are known, so that it stands upright",
        sp.coo_array(felt.T @ felt),
        points,
        tuple((3 * k, *points[k]) for k in range(2)),
    )


def _needed(module: str, name: str) -> Any:
    """A module of a package that comes with the demonstration."""
    try:
        return import_module(module)
    except ImportError as error:
        raise InputError(f"the demonstration needs {name}: pip install 'unassemble[demo]'") from error


def _lake_mesh(size: float) -> tuple[NDArray, NDArray]:
    """Points (n, 2) and triangles (m, 3) of a shore and four islands, all closed splines."""
    geometry = _needed("netgen.geom2d", "netgen-mesher").SplineGeometry()
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


def _closed_curve(geometry: Any, x: NDArray, y: NDArray, *, inside: int, outside: int) -> None:
    """Quadratic splines through the midpoints of a control polygon, counter-clockwise."""
    corner = [geometry.AppendPoint(float(a), float(b)) for a, b in zip(x, y, strict=True)]
    halves = zip((x + np.roll(x, -1)) / 2, (y + np.roll(y, -1)) / 2, strict=True)
    middle = [geometry.AppendPoint(float(a), float(b)) for a, b in halves]
    for k in range(len(x)):
        geometry.Append(["spline3", middle[k - 1], corner[k], middle[k]], leftdomain=inside, rightdomain=outside)
