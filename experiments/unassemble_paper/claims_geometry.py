"""What the paper says of theorems, embeddings, boundaries and operators, and what is measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from unassemble.paper import (
    FixedPointOptions,
    bfs_embedding,
    boundary_fixed_point,
    distance,
    recover_angles,
    substitution,
)

from . import meshes
from .cases import Case, case, case_of
from .claim import Claim, each
from .embeddings import BFS, LAYOUT, MULTILEVEL, SMOOTHED, Embeddings
from .examples import perforated, two_hexagonal_holes
from .false_solutions import WHEEL, wheel_roots
from .meshes import Mesh


def geometry_claims(embedded: dict[str, Embeddings]) -> list[Claim]:
    """The rest: sections 2.3, 2.4 and 5 to 8."""
    return [
        *(_theorem_1(), _theorem_2(), _boundary(), _bfs(embedded), _smoothed(embedded), _multilevel(embedded)),
        *(_fixed_point(), _substitution(), _any_diagonal(), _unknown_factor(), _anisotropy()),
    ]


def _theorem_1() -> Claim:
    surplus = [case_of(perforated(13, holes), "lattice").corners.counts.surplus for holes in range(5)]
    counts = case_of(two_hexagonal_holes(), "hexagon").corners.counts
    return Claim(
        "theorem-1", "2.3", "Theorem 1: e + m + w >= 3m for any planar mesh",
        f"0 to 4 holes: the surplus is {each(surplus)}; a tri-connected mesh with two holes of six edges has "
        f"{counts.equations} equations for {counts.unknowns} angles", "fails",
        "e + m + w - 3m = 1 - h. The base case of the proof fills a hole of four edges without counting it.",
        (*map(float, surplus), float(counts.equations), float(counts.unknowns)),
    )  # fmt: skip


def _theorem_2() -> Claim:
    worst = 0.0
    for c in (case("square"), case("ellipse"), case("rocket")):
        for root in range(len(c.piece.triangles)):
            worst = max(worst, distance(bfs_embedding(c.piece, c.angles, root=root), c.truth))
    return Claim(
        "theorem-2", "5", "Theorem 2: from a valid angle sequence BFS-Embedding finds the correct embedding",
        f"exact angles of the three meshes, from every first triangle: errors up to {worst:.0e}", "holds",
        "By induction over the queue; tri-connectivity is not needed, that triangles hang together along edges is.",
        (worst,),
    )  # fmt: skip


def _boundary() -> Claim:
    ratios = []
    for mesh in (meshes.ellipse(), meshes.rocket()):
        for _ in range(3):
            c = case_of(mesh, "refined").corners.counts
            ratios.append((c.v - c.w) / np.sqrt(c.v))
            mesh = meshes.refined(mesh)
    return Claim(
        "boundary", "2.4", "The number of boundary vertices is expected to be of the order of the root of v",
        f"n_B over the root of v: {each(ratios, '{:.1f}')} (Figure 5, refined once and twice, Figure 6 likewise)",
        "holds", "Under refinement; in the worst case all vertices lie on the boundary, as the paper says.",
        tuple(ratios),
    )  # fmt: skip


def _bfs(embedded: dict[str, Embeddings]) -> Claim:
    rocket, square = (embedded[name] for name in ("rocket", "square"))
    shares = [float((f.turned[BFS] > 0).mean()) for f in (rocket, square)]
    return Claim(
        "bfs", "5.1", "BFS-Embedding is not planar: rocket with angle errors of 1e-3, grid with 1e-2 (Figures 9, 10)",
        f"not planar from {each(shares, '{:.0%}')} of the first triangles, at angle errors of up to "
        f"{rocket.run.angle_error:.0e} and {square.run.angle_error:.0e}", "holds",
        "Errors add up along the paths of the search; on the grid it depends on where the search begins.",
        tuple(shares),
    )  # fmt: skip


def _smoothed(embedded: dict[str, Embeddings]) -> Claim:
    found = [embedded[name] for name in ("rocket", "square")]
    planar = [float((f.turned[SMOOTHED] == 0).mean()) for f in found]
    worst = [int(f.turned[SMOOTHED].max()) for f in found]
    ratios = [float(np.median(f.errors[BFS]) / np.median(f.errors[SMOOTHED])) for f in found]
    return Claim(
        "smoothing", "5.1", "Averaging and Coordinate-Smoothing show significant improvements (Figures 11, 12)",
        f"planar from {each(planar, '{:.0%}')} of the first triangles, at worst {each(worst)} turned over; median "
        f"errors smaller by {each(ratios, '{:.0f}')}", "holds in part",
        "On the rocket a third of the first triangles leave folds that smoothing cannot undo. And the equations as "
        "printed have the minimum zero where all points fall together: two points have to be held.",
        (*planar, *map(float, worst), *ratios),
    )  # fmt: skip


def _multilevel(embedded: dict[str, Embeddings]) -> Claim:
    found = [embedded[name] for name in ("rocket", "square")]
    turned = [int(f.turned[MULTILEVEL][0]) for f in found]
    errors = [float(f.errors[MULTILEVEL][0]) for f in found]
    better = [float(np.median(f.errors[BFS])) / e for f, e in zip(found, errors, strict=True)]
    layout = [e / float(f.errors[LAYOUT][0]) for f, e in zip(found, errors, strict=True)]
    return Claim(
        "multilevel", "8", "A multilevel embedding is a promising direction",
        f"patches joined two by two: {each(turned)} triangles turned over, errors {each(errors, '{:.0e}')} from the "
        "same angles", "holds",
        f"The errors of BFS-Embedding are {each(better, '{:.0f}')} times as large in the median, those of the "
        f"least-squares layout, which is one linear system, smaller by {each(layout, '{:.0f}')}.",
        (*map(float, turned), *errors),
    )  # fmt: skip


def _fixed_point() -> Claim:
    growth = []
    for name in ("square", "ellipse"):
        c = case(name)
        options = FixedPointOptions(max_steps=5, embedding="layout", loops=True)
        result = boundary_fixed_point(c.piece, c.weights, perturbed_boundary(c, 1e-7), options)
        away = np.abs(result.boundaries - c.truth[np.unique(c.piece.boundary)]).max(axis=1)
        growth.append(float((away[-1] / away[1]) ** (1 / (len(away) - 2))))
    return Claim(
        "fixed-point", "6", "Boundary-Fixed-Point converges, very slowly, from an almost accurate guess",
        f"from errors of 1e-7 the error grows by {each(growth, '{:.1f}')} in each step (grid, ellipse)", "fails",
        "The mesh is a fixed point, but a repelling one; so with the paper's embedding, too, with and without loop "
        "equations. The tube's own Jacobian is square and singular: its equations have no solution unless the "
        "inner cotangents are exact.",
        tuple(growth),
    )  # fmt: skip


def _substitution() -> Claim:
    c = case("rocket")
    result = substitution(c.piece, c.weights, perturbed_boundary(c, 1e-3))
    ellipse = case("ellipse")
    polygon = np.exp(2j * np.pi * np.arange(len(ellipse.piece.longest_loop)) / len(ellipse.piece.longest_loop))
    order = np.argsort(ellipse.piece.longest_loop)
    far = substitution(ellipse.piece, ellipse.weights, polygon[order])
    angle_method = 3 * c.corners.counts.m
    return Claim(
        "substitution", "6", "Substituting the interior needs the full w x n_B matrix; not pursued",
        f"{result.stored} numbers for the rocket, {result.stored / angle_method:.1f} times the angle method's, and a "
        f"dense Jacobian of {result.jacobian_entries}; {len(result.residuals) - 1} Gauss-Newton steps from errors of "
        f"1e-3, {len(far.residuals) - 1} on the ellipse from a regular polygon", "holds in part",
        "The storage is as the paper says; the iteration is far better than it feared, holes included. "
        "Since b in (5) is known, the boundary positions even satisfy linear equations.",
        (float(result.stored), float(result.jacobian_entries), len(result.residuals) - 1, len(far.residuals) - 1),
    )  # fmt: skip


def _any_diagonal() -> Claim:
    moved = []
    for c in (case("square"), case("ellipse"), case("rocket")):
        (i, j), n = c.piece.edges.T, c.piece.n_vertices
        matrix = np.diag(np.random.default_rng(0).standard_normal(n))
        matrix[i, j] = matrix[j, i] = -3.0 * c.weights
        found = recover_angles(c.piece, -matrix[i, j])
        moved.append(max(distance(found.z, c.truth), abs(found.scale / 3 - 1)))
    return Claim(
        "diagonal", "7", "In A = cL + D any diagonal D needs no change",
        f"c = 3, D normal (seed 0): positions and c to {each(moved, '{:.0e}')}, with the products of sines", "holds",
        "Equations (1) and (2) use entries off the diagonal only.", tuple(moved),
    )  # fmt: skip


def _unknown_factor() -> Claim:
    roots = wheel_roots(np.array(WHEEL))
    return Claim(
        "false-roots", "abstract, 7", "With c one unknown more, the matrix determines the mesh as before",
        f"a wheel of five triangles has {len(roots) - 1} other exact solutions, with the paper's c at "
        f"{roots[-1][0]:.4f}", "fails",
        "With c known the angles are the only solution of (1)-(3). With c unknown the equations are as many as the "
        "unknowns less h, and have other roots; with the products of sines and no hole they have none.",
        (float(len(roots)), roots[-1][0]),
    )  # fmt: skip


def _anisotropy() -> Claim:
    c = case("ellipse")
    points, triangles = np.column_stack([c.truth.real, c.truth.imag]), c.piece.triangles
    kx, ky = 4.0, 1.0
    given = _entries(Mesh(points, triangles), kx, ky) / np.sqrt(kx * ky)
    apart = [
        float(np.abs(_entries(Mesh(points * [factor, 1.0], triangles), 1, 1) - given).max())
        for factor in (np.sqrt(ky / kx), np.sqrt(kx / ky))
    ]
    return Claim(
        "anisotropy", "7", "Equation (9) gives the matrix of the Laplacian with x dilated by the root of K_x / K_y",
        f"Figure 5, K_x / K_y = 4: entries differ by {apart[0]:.0e} with x contracted, by {apart[1]:.1f} dilated",
        "fails",
        "It is contracted, and the factor is the root of K_x K_y. The recovered mesh has no orientation, so that "
        "undoing it needs one from outside.", tuple(apart),
    )  # fmt: skip


def _entries(mesh: Mesh, kx: float, ky: float) -> NDArray[np.float64]:
    """(n, n) the matrix of div(K grad) by gradients of the basis functions, dense."""
    p = mesh.points[mesh.triangles]
    edge = np.roll(p, -2, axis=1) - np.roll(p, -1, axis=1)  # facing each corner
    area = 0.5 * np.abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
    turned = np.stack([-edge[..., 1], edge[..., 0]], axis=-1) * np.sqrt([kx, ky])
    local = np.einsum("tid,tjd->tij", turned, turned) / (4 * area)[:, None, None]
    matrix = np.zeros((len(mesh.points),) * 2)
    np.add.at(matrix, (mesh.triangles[:, :, None], mesh.triangles[:, None, :]), local)
    return matrix


def perturbed_boundary(c: Case, size: float) -> NDArray[np.complex128]:
    """The true boundary with noise, relative to the diameter; always the same."""
    boundary = np.unique(c.piece.boundary)
    noise = np.random.default_rng(0).standard_normal((len(boundary), 2)) @ np.array([1, 1j])
    return c.truth[boundary] + size * abs(complex(np.ptp(c.truth.real), np.ptp(c.truth.imag))) * noise
