"""Where each piece is put: by known positions, by a direction, or in the canonical frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..options import Direction, FrameOptions
from ..planar.frame import Similarity, canonical_frame, collinear, fit_similarity
from ..planar.hinges import groups, join
from ..reductions import ConstantTensor
from ..topology import Piece, Topology
from ..words import words_of
from .notes import piece_notes, topology_notes

Anchor = tuple[int, float, float]


@dataclass(frozen=True)
class Placement:
    """What is known of the true frame."""

    anchors: tuple[Anchor, ...] = ()  # tuple of (row, x, y)
    tensor: ConstantTensor | None = None
    # (row, row, degrees) angle, from the x axis, of the line from the first row's point to the second's
    direction: Direction | None = None
    # {"left", "right"} or None on which side of that line (with two anchors: of the line from the first to the second)
    # the centroid of the piece lies
    handed: str | None = None

    @property
    def coefficients(self) -> tuple[float, float, float] | None:
        """(kxx, kxy, kyy) of the tensor, as the certificate takes them; None where there is none."""
        return self.tensor.coefficients if self.tensor else None

    @property
    def stretch(self) -> float:
        """sqrt(det K): c div(K grad) is a Laplacian of factor c sqrt(det K), in coordinates that K stretches."""
        return self.tensor.root_determinant if self.tensor else 1.0

    @property
    def operator(self) -> str:
        """The operator's name."""
        return "anisotropic laplacian" if self.tensor else "laplacian"

    @classmethod
    def of(cls, n: int, frame: FrameOptions) -> Placement:
        """What options say of a mesh in the plane whose matrix has order n."""
        rows = [row for row, *_ in frame.anchors]
        for row, *place in frame.anchors:
            if len(place) == 3:
                raise InputError(
                    f"the anchor of row {row} has three coordinates, and this matrix belongs to a mesh in the plane: "
                    "leave out the third"
                )
        for row in rows + list(frame.direction[:2] if frame.direction else ()):
            if not 0 <= row < n:
                raise InputError(f"row {row} is not in the matrix: its rows count from 0 to {n - 1}")
        return cls(frame.anchors, frame.tensor, frame.direction, frame.handed)

    def origins(self, topology: Topology) -> NDArray[np.complex128]:
        """(number of pieces,) points that positions of each piece are found relative to; of joined pieces the same.

        The mean of the anchors, 0 where there are none: far from the origin coordinates have few digits left, which
        only the mesh as it is written should suffer from.
        """
        group = groups(topology)
        total, count = np.zeros(len(group), np.complex128), np.zeros(len(group))
        for label, piece in zip(group, topology.pieces, strict=True):
            targets = self._anchors_of(piece)[1]
            total[label] += targets.sum()
            count[label] += len(targets)
        return np.asarray((total / np.maximum(count, 1))[group])

    def apply(self, piece: Piece, z: NDArray, origin: complex = 0j) -> tuple[NDArray, list[str]]:
        """True positions of a piece, relative to a point, from its positions z (n,) in any frame of the Laplacian's.

        Returns `positions` (n,); `notes`: what is arbitrary, or does not fit.

        Raises InputError if a tensor is to be undone and the orientation is not known.
        """
        rows, targets = self._anchors_of(piece)
        targets = targets - origin
        if len(rows) >= 2:
            return self._by_anchors(piece, z, rows, targets)
        if self._directed(piece):
            assert self.direction is not None
            ends = piece.local(np.array(self.direction[:2]))
            aim = np.array([0, np.exp(1j * np.deg2rad(self.direction[2]))])
            positions, notes = self._by_anchors(piece, z, ends, aim)
            length = np.abs(positions[piece.edges[:, 0]] - positions[piece.edges[:, 1]]).mean()
            positions = (positions - positions.mean()) / length
        elif self.tensor:
            raise InputError(
                f"`tensor` cannot be undone for the piece of row {piece.vertices.min()} without its orientation: "
                "give three anchors that are not in line, or `direction` and `handed`"
            )
        else:
            frame, note = canonical_frame(z, piece.edges, piece.boundary)
            positions, notes = frame(z), [note] if note else []
        if len(rows) == 1:
            positions = positions + (targets[0] - positions[rows[0]])
        return positions, notes

    def placed(
        self,
        topology: Topology,
        positions: Sequence[NDArray],
        remarks: Sequence[Sequence[str]],
        sizes: NDArray[np.float64] | None = None,
    ) -> tuple[list[NDArray], NDArray[np.complex128], list[str]]:
        """Every piece in its final frame, relative to its origin, hinges joined.

        `positions`: of each piece, (k,) in any frame; `remarks`: on each; `sizes` (pieces,): factors of pieces of which
        less than two positions are known.

        Returns `placed`, (k,) each; `origins` (pieces,); `notes`: what is to be said.
        """
        given, notes = self.upon(topology)
        origins, placed, said = given.origins(topology), [], []
        # Points of each piece that are fixed from outside; a direction counts as two.
        known = np.array([2 if given._directed(p) else len(given._anchors_of(p)[0]) for p in topology.pieces])
        for label, piece in enumerate(topology.pieces):
            z, more = given.apply(piece, positions[label], origins[label])
            placed.append(z if sizes is None or known[label] >= 2 else sizes[label] * z)
            said.append((*remarks[label], *more))
        notes = [*piece_notes(said), *notes, *topology_notes(topology)]
        return join(topology, placed, known), origins, notes

    def upon(self, topology: Topology, known: Sequence[NDArray[np.bool_]] = ()) -> tuple[Placement, list[str]]:
        """The same without what was given of points that are not determined, and what is to be said about that.

        `known`: whether vertices of each piece are determined, (k,) bool; all are by default.
        """
        firm, notes = topology.multiplicity > 0, []
        for piece, own in zip(topology.pieces, known, strict=False):
            firm[piece.vertices[~own]] = False
        if lost := [row for row, _, _ in self.anchors if not firm[row]]:
            notes.append(f"points of rows {words_of(lost)} are not determined: their anchors were not used")
        direction = self.direction
        if direction and not (firm[list(direction[:2])].all() and any(map(self._directed, topology.pieces))):
            notes.append(
                "`direction` joins rows of different pieces, or points that are not determined: it was not used"
            )
            direction = None
        anchors = tuple(anchor for anchor in self.anchors if firm[anchor[0]])
        return replace(self, anchors=anchors, direction=direction), notes

    def _directed(self, piece: Piece) -> bool:
        return self.direction is not None and bool(np.isin(self.direction[:2], piece.vertices).all())

    def _anchors_of(self, piece: Piece) -> tuple[NDArray, NDArray]:
        """Local rows and complex targets of the anchors in a piece."""
        rows = np.array([row for row, _, _ in self.anchors], dtype=np.int64)
        targets = np.array([complex(x, y) for _, x, y in self.anchors], dtype=np.complex128)
        if not len(rows):
            return rows, targets
        here = np.isin(rows, piece.vertices)
        return (piece.local(rows[here]) if here.any() else rows[here]), targets[here]

    def _by_anchors(self, piece: Piece, z: NDArray, rows: NDArray, targets: NDArray) -> tuple[NDArray, list[str]]:
        known = self.tensor.to_laplacian(targets) if self.tensor else targets
        fits = [fit_similarity(z[rows], known, mirror=mirror) for mirror in (False, True)]
        notes = []
        if len(rows) > 2 and not collinear(known):
            frame = min(fits, key=lambda fit: fit[1])[0]
            if self.handed:
                notes.append("three or more anchors fix the mirror image; `handed` was not used")
        else:
            frame = self._of_two([fit[0] for fit in fits], piece, z, rows[:2])
            if not self.handed:
                notes.append("what was given leaves two mirror images; the choice between them is by convention")
        placed = frame(z)
        misfit = float(np.abs(placed[rows] - known).max())
        if misfit > 1e-6 * np.abs(known - known.mean()).max():
            notes.append(f"the anchors do not fit the mesh: one is missed by {misfit:.3g}")
        return (self.tensor.from_laplacian(placed) if self.tensor else placed), notes

    def _of_two(self, frames: list[Similarity], piece: Piece, z: NDArray, ends: NDArray) -> Similarity:
        """The frame that puts the centroid on the wanted side of the line between two vertices, or by convention."""
        if not self.handed:
            if self.tensor:
                raise InputError("the mirror image is open: give a third anchor that is not in line, or `handed`")
            return frames[canonical_frame(z, piece.edges, piece.boundary)[0].mirror]
        line, offset = z[ends[1]] - z[ends[0]], z.mean() - z[ends[0]]
        side = (np.conj(line) * offset).imag
        if abs(side) < 1e-9 * abs(line) * np.abs(z - z.mean()).max():
            raise InputError(
                "the piece's centroid lies on the line that `handed` refers to: "
                "choose other rows, or give three anchors that are not in line"
            )
        return frames[0] if (side > 0) == (self.handed == "left") else frames[1]
