"""Faces of a graph: from its short cycles where these settle it, else from a planar embedding."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .cycles import chordless_four_cycles, not_faces, three_cycles
from .drawn import from_cycles, from_rotation
from .faces import FaceComplex, around
from .keys import distinct
from .planarity import rotation_system, too_many


def face_complexes(n: int, edges: NDArray) -> Iterator[FaceComplex]:
    """Drawings of a planar graph on the sphere, the likeliest first.

    Where the graph is not tri-connected it has many. A mesh has nearly all of its short cycles as faces: first the
    surface that they make by themselves, then an embedding in which all of them are faces, or all but those on edges
    with more than two 3-cycles, last any.

    `edges` (e, 2): pairs i < j in lexicographic order; at least one.
    """
    if too_many(n, edges):  # and may have very many cycles
        return
    # 3-cycles and chordless 4-cycles, (m, 3) and (m, 4), that may all be faces: no edge lies on more than two of them.
    triangles, opposite = three_cycles(n, edges)
    count = np.bincount(opposite.ravel(), minlength=len(edges))
    if (count > 2).any():
        face = ~not_faces(n, edges, triangles, opposite)
        triangles, opposite = triangles[face], opposite[face]
        count = np.bincount(opposite.ravel(), minlength=len(edges))
    quads = chordless_four_cycles(n, edges, count < 2)
    if len(quads):
        sides = around(n, edges, quads) >> 1
        count = count + np.bincount(sides.ravel(), minlength=len(edges))
        quads = quads[(count[sides] <= 2).all(axis=1)]
    # The same for drawings with the same faces, mirrored or not: sums over each face of a number for each edge.
    number, seen = np.random.default_rng(0).integers(1 << 62, size=len(edges)).astype(np.uint64), set[bytes]()
    for drawing in _drawings(n, edges, triangles, quads):
        blocks = drawing.split()
        sums = np.zeros(len(blocks.size), dtype=np.uint64)
        np.add.at(sums, blocks.face, np.repeat(number, 2))
        if (name := np.sort(sums).tobytes()) not in seen:
            seen.add(name)
            yield drawing


def _drawings(n: int, edges: NDArray, triangles: NDArray, quads: NDArray) -> Iterator[FaceComplex]:
    surface = from_cycles(n, edges, triangles, quads)
    if surface is not None:
        yield surface
    drawing = _with_faces(n, edges, [triangles, quads])
    if drawing is None:
        sides = around(n, edges, triangles) >> 1
        crowded = (np.bincount(sides.ravel(), minlength=len(edges)) > 2)[sides].any(axis=1)
        drawing = _with_faces(n, edges, [triangles[~crowded], quads])
    if drawing is not None:
        yield drawing
    rotation = rotation_system(n, edges)
    if rotation is not None:
        yield from_rotation(n, edges, *rotation)


def _with_faces(n: int, edges: NDArray, cycles: list[NDArray]) -> FaceComplex | None:
    """A drawing in which given cycles, (m_k, k) each, are faces; None if there is none, or no cycle is given.

    Each cycle gets a hub, and each of its edges a midpoint joined to the hub: the hub must lie on one side of the
    cycle, and all midpoints on its rim see it.
    """
    if not sum(map(len, cycles)):
        return None
    sides = [around(n, edges, c) >> 1 for c in cycles]
    rim = distinct(np.concatenate([s.ravel() for s in sides]))
    midpoint = np.full(len(edges), -1)
    midpoint[rim] = n + np.arange(len(rim))
    hub = n + len(rim)
    spokes = []
    for s in sides:
        spokes.append(np.column_stack([midpoint[s.ravel()], hub + np.repeat(np.arange(len(s)), s.shape[1])]))
        hub += len(s)
    halves = np.column_stack([edges[rim].ravel(), np.repeat(midpoint[rim], 2)])
    plain = np.delete(edges, rim, axis=0)
    rotation = rotation_system(hub, np.concatenate([plain, halves, *spokes]))
    if rotation is None:
        return None
    tail, head = rotation
    tail, head = tail[tail < n], head[tail < n]
    # Back from midpoints to the far ends.
    on_rim = head >= n
    ends = edges[rim[head[on_rim] - n]]
    head = head.copy()
    head[on_rim] = ends.sum(axis=1) - tail[on_rim]
    return from_rotation(n, edges, tail, head)
