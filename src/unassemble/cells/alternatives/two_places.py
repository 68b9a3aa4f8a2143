"""Vertices that have two places between neighbours that stay.

Let h have a right angle in a cell, from a to b, and lie on the boundary elsewhere, between p and q. That right angle
gives nothing to ab. Without it, and with one between p and q instead, which gives nothing to pq, the conformal equation
of row h puts it somewhere else, or nowhere. If its cells have the same entries from there, both are meshes. On grids
such places are frequent.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology.faces import joined
from ..alike import as_cell
from .corners import Alternative, OrientedMesh

_NEARLY_RIGHT = 1e-3  # cosine of an angle that is worth a closer look
_FLAT = 1e-9  # twice the area of a triangle over the square of its longest side

Cell = tuple[int, ...]
Pair = tuple[int, int]


@dataclass
class _Place:
    """What is around a vertex.

    Attributes
    ----------
    openings : list of (int, int)
        The vertices before and after it along the boundary, each time that it passes.
    cells : list of tuple of int
        Counter-clockwise, each beginning with the vertex.
    ends : list of int
        Far ends of its edges.
    weights : list of float
        Theirs.
    """

    openings: list[Pair]
    cells: list[Cell]
    ends: list[int]
    weights: list[float]


def two_places(stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, agree: float) -> list[Alternative]:
    """All vertices that can move with a right angle to where that leaves all entries as they are.

    Parameters are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`.
    """
    places = _places(stored, mesh, agree)
    across = [pair for here in places.values() for pair in here.openings]
    across += [(cell[-1], cell[1]) for here in places.values() for cell in here.cells]
    ways = np.array(across, dtype=np.int64).reshape(-1, 2)
    taken = set(map(tuple, ways[_borders_a_cell(mesh, ways)].tolist()))
    return [other for h, here in places.items() for other in _moved(h, here, taken, mesh.z, float(factors[h]), agree)]


def _moved(h: int, here: _Place, taken: set[Pair], z: NDArray, c: float, agree: float) -> Iterator[Alternative]:
    """Each way to move a vertex, into one of its openings; `taken` are sides with a cell on the left."""
    free = [pair for pair in here.openings if pair not in taken]
    weights = [w / c for w in here.weights]
    pulled = sum(w * complex(z[v]) for w, v in zip(weights, here.ends, strict=True))
    opened = sum(complex(z[after]) - complex(z[before]) for before, after in here.openings)
    given = _entries(here.cells, h, complex(z[h]), z)
    for cell in here.cells:
        if not _is_right_angled(cell, z, agree):
            continue
        left, right = complex(z[cell[-1]]), complex(z[cell[1]])
        kept = [old for old in here.cells if old != cell]
        for p, q in free:
            if (q, p) == (cell[1], cell[-1]):  # the same cell from behind
                continue
            # (L z)_h = -i / 2 times what the boundary leaves open about h.
            before, after = complex(z[p]), complex(z[q])
            place = (pulled - 0.5j * (opened - (after - before) + left - right)) / sum(weights)
            one, other = before - place, after - place
            if abs((one.conjugate() * other).real) > max(_NEARLY_RIGHT, agree) * abs(one) * abs(other):
                continue
            if (cell[-1], cell[1]) in taken and _is_between(place, right, left):
                continue  # on a side of the cell beyond: no mesh
            new = [(h, p, q), *([cell[1:]] if len(cell) > 3 else [])]
            if _keeps(kept, new, given, h, place, z, agree):
                yield Alternative((), (), (), (as_cell(cell),), tuple(sorted(map(as_cell, new))))


def _keeps(
    kept: list[Cell], new: list[Cell], given: dict[Pair, float], h: int, place: complex, z: NDArray, agree: float
) -> bool:
    """Whether all edges have what was `given` to them, with h in another place and new cells there.

    What faces h no other cell at h has a share in: mostly the first of these sides says that it is none.
    """
    size = max(map(abs, given.values()), default=0.0)
    for cell in kept:
        for one, other in pairwise(cell[1:]):
            u, w = complex(z[one]) - place, complex(z[other]) - place
            twice = (u.conjugate() * w).imag
            facing = (u.conjugate() * w).real / (2 * twice) if twice else np.inf
            if not abs(given.get((min(one, other), max(one, other)), 0.0) - facing) <= agree * size:
                return False
    after = _entries([*kept, *new], h, place, z)
    if not (given and after):
        return False
    return all(abs(given.get(side, 0.0) - after.get(side, 0.0)) <= agree * size for side in given.keys() | after.keys())


def _is_between(place: complex, one: complex, other: complex) -> bool:
    """Whether it lies on the segment between two points."""
    turned = (one - place).conjugate() * (other - place)
    return abs(turned.imag) <= _FLAT * abs(one - other) ** 2 and turned.real < 0


def _is_right_angled(cell: Cell, z: NDArray, agree: float) -> bool:
    """Whether it is at its first vertex."""
    one, other = complex(z[cell[1]] - z[cell[0]]), complex(z[cell[-1]] - z[cell[0]])
    return abs((one.conjugate() * other).real) <= agree * abs(one) * abs(other)


def _places(stored: OperatorMatrix, mesh: OrientedMesh, agree: float) -> dict[int, _Place]:
    """Vertices on the boundary with a right angle, of openings those between stored edges."""
    tail, head = mesh.boundary.T
    before = np.arange(len(tail)) - 1
    before[mesh.boundary_offsets[:-1]] = mesh.boundary_offsets[1:] - 1
    previous = tail[before]
    n, edges = stored.n, stored.edges
    free = joined(n, edges, tail, head) & joined(n, edges, tail, previous) & (head != previous)
    at = np.unique(tail[free])
    # Vertices all of whose openings are such: others have corners at their neighbours.
    at = np.setdiff1d(at, tail[~free])
    wanted = np.zeros(n, dtype=bool)
    wanted[at] = True
    places = {h: _Place([], [], [], []) for h in at.tolist()}
    for k in np.flatnonzero(wanted[tail]).tolist():
        places[int(tail[k])].openings.append((int(previous[k]), int(head[k])))
    for cell in mesh.cells_at(wanted):
        for turn, vertex in enumerate(cell):
            if wanted[vertex]:
                places[vertex].cells.append((*cell[turn:], *cell[:turn]))
    for k, turn in zip(*(index.tolist() for index in np.nonzero(wanted[edges])), strict=True):
        here = places[int(edges[k, turn])]
        here.ends.append(int(edges[k, 1 - turn]))
        here.weights.append(-float(stored.entries[k]))
    return {h: here for h, here in places.items() if any(_is_right_angled(cell, mesh.z, agree) for cell in here.cells)}


def _borders_a_cell(mesh: OrientedMesh, ways: NDArray) -> NDArray[np.bool_]:
    """Whether there is a cell on the left of each way (k, 2) from a vertex to another."""
    n, polygons = len(mesh.z), mesh.polygons
    tail = np.concatenate([mesh.triangles.ravel(), polygons.vertices])
    head = np.concatenate([np.roll(mesh.triangles, -1, axis=1).ravel(), polygons.following])
    begun = np.zeros(n, dtype=bool)
    begun[ways[:, 0]] = True
    sides = begun[tail]
    return np.isin(ways @ [n, 1], tail[sides] * n + head[sides])


def _entries(cells: list[Cell], h: int, place: complex, z: NDArray) -> dict[Pair, float]:
    """What cells give to edges, with h in some place; nothing if one is turned over or flat."""
    found: dict[Pair, float] = defaultdict(float)
    for three in ((cell[0], *pair) for cell in cells for pair in pairwise(cell[1:])):
        at = [place if v == h else complex(z[v]) for v in three]
        sides = [at[k - 1] - at[k - 2] for k in range(3)]  # facing the corners
        twice = (sides[0].conjugate() * sides[1]).imag
        if not twice > _FLAT * max(abs(side) for side in sides) ** 2:
            return {}
        for k in range(3):
            one, other = three[k - 1], three[k - 2]
            found[min(one, other), max(one, other)] -= (sides[k - 1].conjugate() * sides[k - 2]).real / (2 * twice)
    return found
