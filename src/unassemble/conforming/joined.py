"""Parts put together to one mesh."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..certify import Certificate
from ..certify_elements import certify_elements
from ..elements.surface import fields_of
from ..matrix import OperatorMatrix
from ..scalar.placement import Placement
from ..topology import Topology
from .fit import Fitted
from .parts import reversal


class JoinedParts:
    """Parts put together in the numbering of the matrix, those that are mirrored turned over."""

    def __init__(self, topology: Topology, fits: Sequence[Fitted], placement: Placement):
        """Parts are the pieces of the topology."""
        n = topology.n_vertices
        self.points = np.full((n, 2), np.nan)  # of each about its origin
        self.component = topology.component
        self.blocks: dict[str, NDArray[np.int64]] = {}
        self._piece: dict[str, NDArray[np.int64]] = {}  # of each cell
        self._topology, self._fits, self._tensor = topology, fits, placement.tensor
        self._stretch = placement.stretch
        nodes, remarks = [fit.nodes for fit in fits], [fit.notes for fit in fits]
        self.placed, self.origins, self.notes = placement.placed(topology, nodes, remarks)
        for label in range(len(fits))[::-1]:  # the first part at a hinge comes last
            part, z = fits[label].part, self.placed[label]
            self.points[part.piece.vertices] = np.column_stack([z.real, z.imag])
            a, b, c = z[part.piece.triangles].T
            mirrored = (np.conj(b - a) * (c - a)).imag.sum() < 0
            for kind, cells in part.blocks.items():
                own = part.piece.vertices[cells[:, reversal(kind)] if mirrored else cells]
                piece, name = np.full(len(own), label), kind.name
                self.blocks[name] = np.concatenate([own, self.blocks.get(name, own[:0])])
                self._piece[name] = np.concatenate([piece, self._piece.get(name, piece[:0])])

        shift = self.origins[self.component]
        self.written = self.points + np.column_stack([shift.real, shift.imag])

    def held(self, matrix: OperatorMatrix, points: NDArray) -> Certificate:
        """The mesh with these points against the matrix."""
        if self._tensor:  # div(K grad) is a Laplacian in coordinates that K stretches
            z = self._tensor.to_laplacian(points @ [1, 1j])
            points = np.column_stack([z.real, z.imag])
        scale = np.array([fit.scale for fit in self._fits])
        factors = {name: scale[piece] for name, piece in self._piece.items()}
        rules = {name: rule for fit in self._fits for name, rule in fit.rule.items()}
        return certify_elements(matrix.edges, matrix.entries, points, self.blocks, factors, rules)

    def fields(self) -> dict[str, Any]:
        """What results say of the mesh, under the names that they have for it."""
        return fields_of(self.blocks) | {
            "points": self.written,
            "component": self.component,
            "hinges": self._topology.hinges,
            "scale": np.array([fit.scale for fit in self._fits]) / self._stretch,
            "n_holes": sum(fit.part.n_holes for fit in self._fits),
            "quadrature": ", ".join(dict.fromkeys(rule for fit in self._fits for rule in fit.rule.values())),
            "straight": all(fit.straight for fit in self._fits),
        }
