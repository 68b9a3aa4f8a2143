"""Parts put together to one mesh."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..elements.surface import boundary_loops
from .parts import Part, reversal


class JoinedParts:
    """Parts put together in the numbering of the matrix, those that are mirrored turned over."""

    def __init__(self, parts: Sequence[Part], placed: Sequence[NDArray], n: int):
        self.points = np.full((n, 2), np.nan)
        self.component = np.full(n, -1, dtype=np.int64)
        self.blocks: dict[str, NDArray[np.int64]] = {}
        self.piece: dict[str, NDArray[np.int64]] = {}  # of each cell
        for label in range(len(parts))[::-1]:  # the first part at a hinge comes last
            part, z = parts[label], placed[label]
            self.points[part.piece.vertices] = np.column_stack([z.real, z.imag])
            self.component[part.piece.vertices] = label
            a, b, c = z[part.piece.triangles].T
            mirrored = (np.conj(b - a) * (c - a)).imag.sum() < 0
            for kind, cells in part.blocks.items():
                own = part.piece.vertices[cells[:, reversal(kind)] if mirrored else cells]
                piece, name = np.full(len(own), label), kind.name
                self.blocks[name] = np.concatenate([own, self.blocks.get(name, own[:0])])
                self.piece[name] = np.concatenate([piece, self.piece.get(name, piece[:0])])

    def fields(self) -> dict[str, Any]:
        """Cells and boundary under the names that results have."""
        fields: dict[str, Any] = {}
        for name, cells in self.blocks.items():
            corners = 3 if name.startswith("triangle") else 4
            fields["triangles" if corners == 3 else "quads"] = np.ascontiguousarray(cells[:, :corners])
            if cells.shape[1] > corners:
                fields["mid_nodes"] = np.ascontiguousarray(cells[:, corners:])
        boundary, offsets = boundary_loops(self.blocks)
        return fields | {"boundary": boundary, "boundary_offsets": offsets}
