"""Faces of drawings with one part turned over: which of two such drawings is the mesh's only the numbers tell."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np

from ...topology.faces import FaceComplex
from ...topology.turning_over import turns
from .outlines import Outlines

_LONGEST = 8  # edges of a face that may be a cell
_MOST_TURNS = 100


@dataclass(frozen=True, eq=False)
class CrossedFaces(Outlines):
    """Faces that one part turned over makes of two, each with half-edges of both."""

    @classmethod
    def of(cls, drawing: FaceComplex) -> CrossedFaces:
        """Those of few edges, of a drawing none of whose faces passes a vertex twice."""
        found = {
            frozenset(halves): (_along(drawing, vertices, halves), halves)
            for turn in islice(turns(drawing), _MOST_TURNS)
            for vertices, halves in zip(turn.new, turn.halves, strict=True)
            if len(set(vertices)) == len(vertices) <= _LONGEST
        }
        faces = list(found.values())
        size = np.array([len(vertices) for vertices, _ in faces], dtype=np.int64)
        vertices, halves = (np.array([k for face in faces for k in face[part]], dtype=np.int64) for part in (0, 1))
        return cls(size, vertices, np.column_stack([np.repeat(np.arange(len(faces)), size), halves]))

    @classmethod
    def none(cls) -> CrossedFaces:
        """No faces."""
        return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 2), np.int64))


def _along(drawing: FaceComplex, vertices: tuple[int, ...], halves: tuple[int, ...]) -> tuple[int, ...]:
    """The vertices in the direction of most of their half-edges."""
    steps = set(zip(vertices, vertices[1:] + vertices[:1], strict=True))
    ends = zip(drawing.tail[[*halves]].tolist(), drawing.head[[*halves]].tolist(), strict=True)
    return vertices if 2 * len(steps.intersection(ends)) >= len(vertices) else vertices[::-1]
