"""Frames, shells, plates and trusses, their element matrices by Pynite, and where their nodes are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from Pynite import FEModel3D
from scipy.spatial import Delaunay

from unassemble import RecoveryError, recover

SPACE, PLANE, PLATE = range(6), (0, 1, 5), (2, 3, 4)


@dataclass(frozen=True)
class Built:
    """A matrix, node by node in the order of `unknowns`, and what it was assembled on."""

    matrix: sp.csr_array
    points: np.ndarray
    members: np.ndarray
    unknowns: tuple[int, ...]

    @property
    def block(self) -> int:
        return len(self.unknowns)

    def only(self, unknowns, dim: int) -> Built:
        """Some of the unknowns of each node, in these coordinates."""
        rows = (self.block * np.arange(len(self.points))[:, None] + np.array(unknowns)).ravel()
        return Built(self.matrix[rows][:, rows], self.points[:, :dim], self.members, tuple(unknowns))

    def clamped(self, held) -> Built:
        """Without all unknowns of the held nodes."""
        kept = np.flatnonzero(~held)
        rows = (self.block * kept[:, None] + np.arange(self.block)).ravel()
        place = np.full(len(held), -1)
        place[kept] = np.arange(len(kept))
        members = place[self.members]
        return Built(self.matrix[rows][:, rows], self.points[kept], members[(members >= 0).all(axis=1)], self.unknowns)

    def permuted(self, seed: int = 0) -> Built:
        """Nodes in random order."""
        order = np.random.default_rng(seed).permutation(len(self.points))
        rows = (self.block * order[:, None] + np.arange(self.block)).ravel()
        place = np.argsort(order)
        return Built(self.matrix[rows][:, rows], self.points[order], place[self.members], self.unknowns)

    def with_springs(self, rows, others=None, share: float = 0.2) -> Built:
        """Equal springs at unknowns, to the ground or to others, as stiff as a share of a typical diagonal entry."""
        stiffness = np.full(len(rows), share * self.matrix.diagonal()[rows].mean())
        ends = [rows] if others is None else [rows, others]
        matrix = self.matrix
        for one in ends:
            for other in ends:
                values = stiffness if one is other else -stiffness
                matrix = matrix + sp.csr_array((values, (one, other)), shape=matrix.shape)
        return replace(self, matrix=sp.csr_array(matrix))

    def condensed(self, rows) -> tuple[sp.csr_array, np.ndarray]:
        """Without some unknowns, statically condensed; and which rows are left."""
        kept = np.setdiff1d(np.arange(self.matrix.shape[0]), rows)
        full = self.matrix.toarray()
        left = full[np.ix_(kept, kept)] - full[np.ix_(kept, rows)] @ np.linalg.solve(
            full[np.ix_(rows, rows)], full[np.ix_(rows, kept)]
        )
        left = np.where(np.abs(left) < 1e-15 * np.abs(left).max(), 0, left)
        return sp.csr_array((left + left.T) / 2), kept

    def by_component(self) -> sp.csr_array:
        rows = np.arange(self.matrix.shape[0]).reshape(-1, self.block).T.ravel()
        return self.matrix[rows][:, rows]


def model_on(points) -> FEModel3D:
    model = FEModel3D()
    model.add_material("steel", 200e9, 77e9, 0.3, 7850)
    for k, x in enumerate(np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])):
        model.add_node(str(k), *map(float, x))
    return model


def assembled(model: FEModel3D, points, members=()) -> Built:
    """Element matrices added up."""
    rows, columns, values = [], [], []
    for kind, corners in (("members", "ij"), ("quads", "ijmn"), ("plates", "ijmn")):
        for element in getattr(model, kind).values():
            nodes = np.array([int(getattr(element, f"{corner}_node").name) for corner in corners])
            dofs = (6 * nodes[:, None] + np.arange(6)).ravel()
            rows.append(np.repeat(dofs, len(dofs)))
            columns.append(np.tile(dofs, len(dofs)))
            values.append(np.asarray(element.Ke()).ravel())
    order = 6 * len(points)
    place = np.concatenate(rows), np.concatenate(columns)
    matrix = sp.csr_array((np.concatenate(values), place), shape=(order, order))
    return Built(
        (matrix + matrix.T) / 2, np.asarray(points), np.asarray(members, dtype=np.int64).reshape(-1, 2), tuple(SPACE)
    )


def add_members(
    model: FEModel3D, ends, seed: int, *, turned: bool = True, pinned: bool = False, equal: bool = False
) -> None:
    """Members of different sections, or of equal ones, turned about their axes."""
    rng = np.random.default_rng(seed)
    for k, (i, j) in enumerate(ends):
        factor = 1.0 if equal else rng.uniform(1, 3)
        model.add_section(str(k), 1e-2 * factor, 1e-4 * factor, 2e-4 * factor, 2.5e-4)
        angle = float(rng.uniform(0, 90)) if turned else 0.0
        model.add_member(str(k), str(i), str(j), "steel", str(k), rotation=angle)
        if pinned:
            model.def_releases(str(k), Rxi=True, Ryi=True, Rzi=True, Ryj=True, Rzj=True)


def grid(counts) -> tuple[np.ndarray, np.ndarray]:
    """Points of a lattice of unit steps, and pairs of neighbours."""
    points = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, len(counts)).astype(float)
    place = np.arange(len(points)).reshape(counts)
    near = [
        np.stack([place.take(range(k - 1), a).ravel(), place.take(range(1, k), a).ravel()], 1)
        for a, k in enumerate(counts)
    ]
    return points, np.concatenate(near)


def frame(counts=(4, 3, 3), seed: int = 0, off: float = 0.4) -> Built:
    """A building of rigid joints, out of plumb; of equal members in one that is not."""
    points, ends = grid(counts)
    points = 3 * points + np.random.default_rng(seed).uniform(-off, off, points.shape)
    model = model_on(points)
    add_members(model, ends, seed, turned=off > 0, equal=off == 0)
    return assembled(model, points, ends)


def plane_frame(counts=(5, 4), seed: int = 0, off: float = 0.4) -> Built:
    points, ends = grid(counts)
    points = 3 * points + np.random.default_rng(seed).uniform(-off, off, points.shape)
    model = model_on(points)
    add_members(model, ends, seed, turned=False, equal=off == 0)
    return assembled(model, points, ends).only(PLANE, 2)


def grillage(counts=(4, 3), seed: int = 0, off: float = 0.4) -> Built:
    """Beams in a plane that bend and twist out of it."""
    points, ends = grid(counts)
    points = 3 * points + np.random.default_rng(seed).uniform(-off, off, points.shape)
    model = model_on(points)
    add_members(model, ends, seed, turned=False, equal=off == 0)
    return assembled(model, points, ends).only(PLATE, 2)


def truss(d: int, n: int, seed: int = 0) -> Built:
    """Bars along the edges of random simplices; joints have displacements only."""
    points = np.random.default_rng(seed).random((n, d))
    cells = Delaunay(points).simplices
    pairs = np.concatenate([cells[:, pair] for pair in combinations(range(d + 1), 2)])
    ends = np.unique(np.sort(pairs, axis=1), axis=0)
    model = model_on(points)
    add_members(model, ends, seed, pinned=True)
    return assembled(model, points, ends).only(range(d), d)


def curved(u, v):
    return np.column_stack([2 * np.cos(u), 2 * np.sin(u), 3 * v])


def flat(u, v):
    """A plane across no axis."""
    turn = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
    return np.column_stack([u, v, 0 * u]) @ turn


def shell(shape=curved, counts=(9, 7), thickness: float = 0.02) -> Built:
    """Quadrilaterals over a rectangle in parameters, all of them flat."""
    u, v = (part.ravel() for part in np.meshgrid(*(np.linspace(0, 2, k) for k in counts), indexing="ij"))
    points = shape(u, v)
    model = model_on(points)
    for k, corners in enumerate(cells_of(counts)):
        model.add_quad(str(k), *map(str, corners), thickness, "steel")
    return assembled(model, points)


def vault(counts=(7, 5)) -> Built:
    """A barrel of flat quadrilaterals on columns under its corners: members and shells in one matrix."""
    u, v = (part.ravel() for part in np.meshgrid(np.linspace(0, np.pi, counts[0]), np.arange(counts[1]), indexing="ij"))
    points = np.column_stack([3 * np.cos(u), 1.5 * v, 3 + 2 * np.sin(u)])
    corners = np.flatnonzero((points[:, 2] < 3 + 1e-9) & np.isin(v, (0, counts[1] - 1)))
    ends = np.column_stack([len(points) + np.arange(len(corners)), corners])
    points = np.concatenate([points, points[corners] * (1, 1, 0)])
    model = model_on(points)
    for k, around in enumerate(cells_of(counts)):
        model.add_quad(str(k), *map(str, around), 0.1, "steel")
    add_members(model, ends, 0, turned=False)
    return assembled(model, points, ends)


def plate(counts=(9, 8), seed: int = 0, off: float = 0.2) -> Built:
    """A flat plate that only bends: one displacement and two rotations."""
    u, v = (part.ravel() for part in np.meshgrid(*(np.arange(k, dtype=float) for k in counts), indexing="ij"))
    points = np.column_stack([u, v]) + np.random.default_rng(seed).uniform(-off, off, (len(u), 2))
    model = model_on(points)
    for k, corners in enumerate(cells_of(counts)):
        model.add_quad(str(k), *map(str, corners), 0.2, "steel")
    return assembled(model, points).only(PLATE, 2)


def cells_of(counts) -> np.ndarray:
    """Corners of the cells of a grid, in order around each."""
    place = np.arange(np.prod(counts)).reshape(counts)
    return np.stack([place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]], -1).reshape(-1, 4)


def error(found, true, *, scaled: bool = False) -> float:
    """Largest error relative to the diameter, after translation; of determined nodes."""
    known = np.isfinite(found).all(axis=1)
    x, y = found[known] - found[known].mean(axis=0), true[known] - true[known].mean(axis=0)
    factor = (x * y).sum() / (x * x).sum() if scaled else 1.0
    return float(np.linalg.norm(factor * x - y, axis=1).max() / np.linalg.norm(np.ptp(true, axis=0)))


def sound(matrix, true, **options) -> bool:
    """Whether a certificate is given; if so, rows of displacements are where they say, as closely, piece by piece."""
    try:
        found = recover(matrix, **options)
    except RecoveryError:
        return False
    if not found.certified:
        return False
    rows = np.flatnonzero(np.isin(found.direction_of_row, range({"plate": 1, "plane frame": 2}.get(found.operator, 3))))
    free_size = found.operator in ("truss", "elasticity", "structure")
    points, piece = found.points[found.node_of_row[rows]], found.component[found.node_of_row[rows]]
    for one in range(found.n_components):
        assert error(points[piece == one], true[rows][piece == one], scaled=free_size) < (found.position_error or 1e-6)
    return True


def rows_per_node(given) -> np.ndarray:
    return np.repeat(given.points, given.block, axis=0)
