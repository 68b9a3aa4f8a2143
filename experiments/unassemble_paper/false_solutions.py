"""Exact solutions of (1)-(4) that belong to no mesh, where c is unknown.

Without holes there are 3 m + 1 equations for 3 m angles and c: a square system, of which the mesh is one root among
others. With h holes there are h equations fewer than that, and roots come in families of h dimensions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq
from scipy.optimize import brentq

from unassemble.paper import AngleSystem

from .cases import Case, case_of
from .examples import hexagon, perforated
from .meshes import Mesh
from .tables import Cell, Table, table

WHEEL = ((3, 0), (3, 1), (2, 2), (-3, 1), (-1, -2))
"""Rim of the smallest example: five triangles about the origin."""

_SAME, _EXACT = 1e-3, 1e-12  # radians up to which angles are the mesh's (it is a double root), and an exact |F|


def shaken_hexagon(seed: int) -> Mesh:
    """19 vertices of a triangular lattice, each moved by up to a fifth of a side in x and in y."""
    mesh = hexagon(2)
    move = np.random.default_rng(seed).uniform(-1, 1, mesh.points.shape)
    return Mesh(mesh.points + 0.2 * move, mesh.triangles)


def exact_root(system: AngleSystem, x: NDArray, *, steps: int = 40) -> NDArray[np.float64] | None:
    """Where Newton's method with halved steps and dense least squares ends, if the residual is then rounding."""
    value = system.residual(x)
    for _ in range(steps):
        size = float(np.linalg.norm(value))
        if size < _EXACT:
            return x
        step = lstsq(system.jacobian(x).sparse().toarray(), -value, cond=1e-11, lapack_driver="gelsy")[0]
        for halving in range(12):
            new, _ = system.advance(x, step / 2**halving)
            value = system.residual(new)
            if np.linalg.norm(value) < size:
                break
        else:
            return None
        x = new
    return None


def least_singular_value(system: AngleSystem, x: NDArray) -> float:
    """Of J, in the unknowns of the system; the least of the rows, where there are fewer of these."""
    return float(np.linalg.svd(system.jacobian(x).sparse().toarray(), compute_uv=False)[-1])


def wheel_roots(rim: NDArray) -> list[tuple[float, NDArray[np.float64]]]:
    """All solutions of (1)-(4) with c >= 1 on a wheel: c, and the angles (k, 3) at the hub, the rim, and the rim ahead.

    The rim's entries give the angles at the hub for each c, and (4) is an equation for c alone. Around the hub, (1) and
    (3) take the cotangent of each triangle's rim angle to that of the next by a fraction of degree one; all round, a
    solution is a fixed point of their composition, of which there are at most two.
    """
    z = np.asarray(rim) @ np.array([1, 1j])
    ahead = np.roll(z, -1)
    hub, near, far = np.abs(np.angle([ahead / z, (z - ahead) / z, (ahead - z) / ahead]))
    spokes = 1 / np.tan(far) + 1 / np.tan(np.roll(near, 1))  # the two angles that face the spoke to each rim vertex

    def at_hub(c: float) -> NDArray[np.float64]:
        return np.arctan2(1.0, c / np.tan(hub))

    grid = np.linspace(1 + 1e-3, 4, 500)
    sign = np.sign([at_hub(c).sum() - 2 * np.pi for c in grid])
    factors = [1.0]
    for k in np.flatnonzero(sign[1:] != sign[:-1]):
        factors.append(float(brentq(lambda c: at_hub(c).sum() - 2 * np.pi, grid[k], grid[k + 1], xtol=1e-15)))
    found = [(1.0, np.column_stack([hub, near, far]))]
    for c in factors[1:]:
        around = np.eye(2)
        for cotangent, spoke in zip(1 / np.tan(at_hub(c)), c * spokes, strict=True):
            # cot far = spoke - cot near', and cot near = (1 - cot hub cot far) / (cot hub + cot far).
            around = np.array([[-cotangent, 1], [1, cotangent]]) @ np.array([[-1, spoke], [0, 1]]) @ around
        (p, q), (r, s) = around
        for x in np.roots([r, s - p, -q]):
            if abs(x.imag) < 1e-12 and (angles := _around(float(x.real), at_hub(c), c * spokes)).min() > 0:
                found.append((c, angles))
    return found


def _around(cotangent: float, hub: NDArray, spokes: NDArray) -> NDArray[np.float64]:
    """(k, 3) angles, from the cotangent of the last triangle's near angle."""
    rows = []
    for angle, spoke in zip(hub, spokes, strict=True):
        far = np.arctan2(1.0, spoke - cotangent)
        near = np.pi - angle - far
        rows.append((angle, near, far))
        cotangent = 1 / np.tan(near)
    return np.array(rows)


def random_angles(example: Case, rng: np.random.Generator) -> NDArray[np.float64]:
    """(3m,) angles, those of each triangle in random shares (Dirichlet, 3) of pi."""
    return np.pi * rng.dirichlet(np.full(3, 3.0), len(example.piece.triangles)).ravel()


def wheel_table() -> Table:
    """Angles in degrees triangle by triangle: at the hub, at the first and at the second rim vertex; c at the end."""
    roots = wheel_roots(np.array(WHEEL))
    columns = ("rim vertices", "the mesh", *("another solution" for _ in roots[1:]))
    rows = [
        [f"{p}, {q}", *(", ".join(f"{np.degrees(x):.3f}" for x in angles[k]) for _, angles in roots)]
        for k, (p, q) in enumerate(zip(WHEEL, (*WHEEL[1:], WHEEL[0]), strict=True))
    ]
    return table("false-wheel", columns, [*rows, ["c", *(f"{c:.6f}" for c, _ in roots)]])


def rate_table(seeds: int = 160, hexagons: int = 20, starts: int = 20) -> Table:
    """How often a solve that converges ends at no mesh.

    Random starts on hexagons: seeds 0 and following for the meshes, the mesh's seed + 1000 for its starts. The
    paper's method on shaken lattices, seeds 0 and following: to |F| = 1e-6 within 20,000 products, and from there to an
    exact root by dense Newton.
    """
    rows: list[list[Cell]] = [["19-vertex hexagons, random starts", "unknown", *_from_random_starts(hexagons, starts)]]
    for what, scale_free, sines, holes, count in (
        ("unknown", True, False, 0, seeds),
        ("known", False, False, 0, seeds // 4),
        ("unknown, sine products", True, True, 0, seeds // 4),
        ("unknown", True, False, 1, seeds // 8),
    ):
        name = "8 x 8 shaken lattices" if not holes else "9 x 9 with a hole"
        rows.append([f"{name}, from pi/3", what, *_from_equal_angles(scale_free, sines, holes, count)])
    columns = ("meshes and starts", "c", "solves", "exact roots reached", "other roots", "largest angle error",
               "largest c", "least singular value of J at other roots")  # fmt: skip
    return table("false-rate", columns, rows)


def _from_random_starts(hexagons: int, starts: int) -> list[Cell]:
    found: list[tuple[AngleSystem, NDArray, NDArray]] = []
    for seed in range(hexagons):
        example = case_of(shaken_hexagon(seed), "hexagon")
        system, rng = example.system(unknowns="angles"), np.random.default_rng(1000 + seed)
        for _ in range(starts):
            root = exact_root(system, system.pack(random_angles(example, rng)))
            if root is not None:
                found.append((system, root, example.angles))
    return [hexagons * starts, *_judged(found)]


def _from_equal_angles(scale_free: bool, sines: bool, holes: int, seeds: int) -> list[Cell]:
    found: list[tuple[AngleSystem, NDArray, NDArray]] = []
    for seed in range(seeds):
        example = case_of(perforated(8 + (holes > 0), holes, seed=seed), "lattice")
        run = example.run("1.1^-i", scale_free=scale_free, sines=sines, max_products=20_000)
        if not run.result.converged:
            continue
        system = replace(example.system(scale_free=scale_free, sines=sines), unknowns="angles")
        c = float(run.result.x[-1]) if scale_free else 1.0
        root = exact_root(system, system.pack(run.angles, c))
        if root is not None:
            found.append((system, root, example.angles))
    return [seeds, *_judged(found)]


def _judged(found: list[tuple[AngleSystem, NDArray, NDArray]]) -> list[Cell]:
    other = [(s, x, a) for s, x, a in found if np.abs(s.angles(x)[: a.size] - a).max() > _SAME]
    if not other:
        return [len(found), 0, None, None, None]
    errors = [float(np.abs(s.angles(x)[: a.size] - a).max()) for s, x, a in other]
    return [
        len(found), len(other), max(errors), f"{max(s.factor(x) for s, x, _ in other):.5f}",
        min(least_singular_value(s, x) for s, x, _ in other),
    ]  # fmt: skip
