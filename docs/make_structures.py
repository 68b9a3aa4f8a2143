"""Draw the gallery of structures: element matrices by Pynite, supports eliminated, and what comes back.

python docs/make_structures.py
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from Pynite import FEModel3D

from unassemble import recover


def model_on(points: np.ndarray) -> FEModel3D:
    model = FEModel3D()
    model.add_material("steel", 200e9, 77e9, 0.3, 7850)
    model.add_section("tube", 1e-2, 1e-4, 2e-4, 2.5e-4)
    for k, x in enumerate(points):
        model.add_node(str(k), *map(float, x))
    return model


def add_members(model: FEModel3D, ends: list[tuple[int, int]], *, pinned: bool = False) -> None:
    for k, (i, j) in enumerate(ends):
        model.add_member(str(k), str(i), str(j), "steel", "tube", rotation=20.0)
        if pinned:
            model.def_releases(str(k), Rxi=True, Ryi=True, Rzi=True, Ryj=True, Rzj=True)


def mast() -> tuple[FEModel3D, np.ndarray]:
    """A lattice mast with two arms: legs, rings and braces."""
    heights = np.linspace(0, 30, 14)
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    levels = [np.column_stack([(3 - 0.08 * h) * corners, np.full(4, h)]) for h in heights]
    arms = np.array([[8.0, 0, 26], [-8.0, 0, 26]])
    points = np.vstack([*levels, arms])
    around = [(k, (k + 1) % 4) for k in range(4)]
    ends = [(4 * h + a, 4 * h + b) for h in range(1, len(levels)) for a, b in around]
    ends += [(4 * h + a, 4 * h + 4 + a) for h in range(len(levels) - 1) for a in range(4)]
    ends += [(4 * h + (a, b)[h % 2], 4 * h + 4 + (b, a)[h % 2]) for h in range(len(levels) - 1) for a, b in around]
    right, left = len(points) - 2, len(points) - 1
    ends += [(right, 4 * h + k) for h in (10, 12) for k in (0, 3)] + [
        (left, 4 * h + k) for h in (10, 12) for k in (1, 2)
    ]
    model = model_on(points)
    add_members(model, ends)
    return model, points


def vault() -> tuple[FEModel3D, np.ndarray]:
    """A barrel vault of shells on two rows of columns."""
    angle, along = np.linspace(0.15 * np.pi, 0.85 * np.pi, 15), np.linspace(0, 12, 13)
    roof = np.array([[5 * np.cos(a), y, 4 + 4 * np.sin(a)] for y in along for a in angle])
    n, m = len(angle), len(along)
    feet = np.array([[x, y, 0.0] for y in along[::4] for x in (roof[0, 0], roof[n - 1, 0])])
    points = np.vstack([roof, feet])
    model = model_on(points)
    for k, (r, c) in enumerate((r, c) for r in range(m - 1) for c in range(n - 1)):
        corners = (r * n + c, r * n + c + 1, r * n + n + c + 1, r * n + n + c)
        model.add_quad(str(k), *map(str, corners), 0.12, "steel")
    tops = [(r * n, r * n + n - 1) for r in range(0, m, 4)]
    middle = []
    for k, top in enumerate(node for pair in tops for node in pair):
        foot, head = points[len(roof) + k], points[top]
        middle.append((foot + head) / 2)
        model.add_node(str(len(points) + k), *map(float, middle[-1]))
    columns = [(len(points) + k, len(roof) + k) for k in range(len(middle))]
    columns += [(len(points) + k, top) for k, top in enumerate(node for pair in tops for node in pair)]
    add_members(model, columns)
    return model, np.vstack([points, middle])


def dome() -> tuple[FEModel3D, np.ndarray]:
    """Bars of a dome, joints in rings."""
    rings = [(0.0, 1)] + [(0.12 * np.pi * k, 6 * k) for k in range(1, 5)]
    points, first = [], [0]
    for tilt, count in rings:
        turn = 2 * np.pi * np.arange(count) / count
        points += [(10 * np.sin(tilt) * np.cos(t), 10 * np.sin(tilt) * np.sin(t), 10 * np.cos(tilt)) for t in turn]
        first.append(len(points))
    ends = set()
    for start, stop in pairwise(first[1:]):
        ends |= {tuple(sorted((k, start + (k - start + 1) % (stop - start)))) for k in range(start, stop)}
    place = np.array(points)
    for (a, b), (c, d) in pairwise(pairwise(first)):
        for k in range(c, d):  # to the nearest two of the ring above
            away = np.linalg.norm(place[a:b] - place[k], axis=1)
            ends |= {(a + int(near), k) for near in np.argsort(away)[:2] if away[near] < 1.4 * away.min()}
    model = model_on(place)
    add_members(model, sorted(ends), pinned=True)
    return model, place


def matrix_of(model: FEModel3D, points: np.ndarray, unknowns: int) -> tuple[sp.csr_array, np.ndarray]:
    """Elements added up, nodes at random, without the unknowns of the lowest nodes; and where the others are."""
    order = 6 * len(points)
    matrix = np.zeros((order, order))
    for kind, corners in (("members", "ij"), ("quads", "ijmn")):
        for element in getattr(model, kind).values():
            nodes = np.array([int(getattr(element, f"{corner}_node").name) for corner in corners])
            rows = (6 * nodes[:, None] + np.arange(6)).ravel()
            matrix[np.ix_(rows, rows)] += np.asarray(element.Ke())
    kept = np.flatnonzero(points[:, 2] > points[:, 2].min() + 1e-9)
    kept = np.random.default_rng(0).permutation(kept)
    rows = (6 * kept[:, None] + np.arange(unknowns)).ravel()
    return sp.csr_array((matrix + matrix.T)[np.ix_(rows, rows)] / 2), points[kept]


def main() -> None:
    for name, (make, unknowns) in {"mast": (mast, 6), "vault": (vault, 6), "dome": (dome, 3)}.items():
        matrix, truth = matrix_of(*make(), unknowns)
        found = recover(matrix)
        known = found.node_status == 0
        a, b = (x[known] - x[known].mean(axis=0) for x in (found.points, truth))
        factor = (a * b).sum() / (a * a).sum() if found.operator == "truss" else 1.0
        error = np.linalg.norm(factor * a - b, axis=1).max() / np.linalg.norm(np.ptp(b, axis=0))
        kinds = ", ".join(f"{len(cells)} {kind}" for kind, cells in found.cells.items())
        print(f"{name}: {matrix.shape[0]} rows, {found.operator}, {kinds}, {found.status}, error {error:.0e}")
        found.plot(Path(__file__).parent / "_static" / f"structure-{name}.png")


if __name__ == "__main__":
    main()
