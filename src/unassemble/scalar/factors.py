"""Factors c of pieces that share vertices: there is one, but each piece by itself has its own, and errors move it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, gammaincc, ndtr

from ..cells.judge.within_errors import GAP
from ..planar.cotangent import left_by_all
from ..planar.deviations import factor_deviations
from ..planar.hinged import Hinged
from ..planar.hinges import groups, join, rings
from ..planar.piece import PieceMesh, refined_together
from ..planar.polish import PolishOptions
from ..tolerances import ALIKE, CHANCE, CONFIDENCE, LARGEST_NOISE, MAGNIFIED, ROUNDED
from ..topology import Topology
from .noise import Noise, with_vanished

_UNTOLD = 1e100  # standard deviation of log c where entries do not tell c
_NOT_TOGETHER = "the polish of all pieces that share vertices did not converge, and each was fitted by itself"


@dataclass(frozen=True, eq=False)
class Factors:
    """What the entries of each piece by itself say of c, and which pieces were fitted with one c.

    Attributes
    ----------
    own : (pieces,) float64
        c of each piece by itself.
    deviation : (pieces,) float64
        Standard deviation of log c, over that of typical errors of the entries; those that have vanished are exact.
        1e100 where the entries of a piece do not tell c, infinite where it does not matter.
    group : (pieces,) int64
        Label of the pieces that hang together by vertices.
    fitted : (pieces,) int64
        Label of the pieces that have one c, as far as errors explain that their own differ.
    closings : (pieces,) int64
        Equations by which rings of pieces, fitted together, hold these; at the first piece of each group.
    apart : dict of int to str
        Why groups, by the first piece of each, were not fitted together though errors explain that factors differ.
    """

    own: NDArray[np.float64]
    deviation: NDArray[np.float64]
    group: NDArray[np.int64]
    fitted: NDArray[np.int64]
    closings: NDArray[np.int64]
    apart: dict[int, str] = field(default_factory=dict)

    @classmethod
    def of(cls, topology: Topology, meshes: Sequence[PieceMesh]) -> Factors:
        """Those of pieces that were fitted one by one."""
        n = len(meshes)
        group = groups(topology) if len(topology.hinges) else np.arange(n)
        own = np.array([mesh.scale for mesh in meshes])
        return cls(
            own, np.full(n, np.inf), np.asarray(group, dtype=np.int64), np.arange(n), np.zeros(n, dtype=np.int64)
        )

    @property
    def count(self) -> int:
        """How many were fitted."""
        return len(np.unique(self.fitted))

    @property
    def together(self) -> NDArray[np.bool_]:
        """(pieces,) those that were fitted with others."""
        return np.bincount(self.fitted)[self.fitted] > 1

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """(pieces,) the first piece of each one's group."""
        return np.unique(self.group, return_index=True)[1][self.group]

    @property
    def differences(self) -> NDArray[np.float64]:
        """(pieces,) of their own factors from those of the first pieces of their groups, relative."""
        return np.abs(self.own / self.own[self.first] - 1)


def fitted_together(
    topology: Topology,
    weights: NDArray,
    meshes: list[PieceMesh],
    noise: Noise | None,
    scale: float | None,
    *,
    refine: bool,
) -> tuple[list[PieceMesh], Factors]:
    """Fit pieces that share vertices with one c, and as they hold each other, where errors of the entries ask for it.

    Parameters
    ----------
    topology : Topology
    weights : (e,) float64
        -A_ij of each edge.
    meshes : list of PieceMesh
        Each piece by itself.
    noise : Noise, optional
        Without it the misfit of the entries tells how large their errors are.
    scale : float, optional
        c, where it is known.
    refine : bool
        Whether anything is fitted; it is only found out otherwise what errors explain.
    """
    factors = Factors.of(topology, meshes)
    if not (len(topology.hinges) and (noise or factors.differences.max() > ROUNDED)):
        return meshes, factors
    errors = with_vanished(topology) if noise is None else noise.on(topology)
    several = np.flatnonzero(np.bincount(factors.group)[factors.group] > 1)
    if scale is None:
        factors.deviation[several] = _deviations(topology, meshes, several, errors)
    meshes = list(meshes)
    for label in np.unique(factors.group[several]):
        inside = np.flatnonzero(factors.group == label)
        c, sigma = _common(topology, weights, meshes, factors, inside, noise, scale)
        if c is None:
            continue
        if sum(topology.pieces[p].n_vertices for p in inside) > PolishOptions().direct_limit:
            factors.apart[inside[0]] = "they have too many vertices to be fitted together"
            continue
        if not refine:
            factors.fitted[inside] = inside[0]
            continue
        pieces, own = [topology.pieces[p] for p in inside], [replace(meshes[p], scale=c) for p in inside]
        joined = hinged(topology, inside, [mesh.z for mesh in own], GAP * sigma / abs(c))
        if joined is None and scale is not None:
            continue
        together = refined_together(pieces, weights, own, joined, scale, rounding=noise is None, noise=errors)
        if together is None:  # each by itself is a better guess than all on their way somewhere
            factors.apart[inside[0]] = _NOT_TOGETHER
            for p in inside:
                meshes[p] = replace(meshes[p], notes=(*meshes[p].notes, _NOT_TOGETHER))
            continue
        factors.closings[inside[0]] = joined.closings if joined else 0
        factors.fitted[inside] = inside[0]
        for p, mesh in zip(inside, together, strict=True):
            meshes[p] = mesh
    return meshes, factors


def hinged(
    topology: Topology, inside: NDArray[np.int64], positions: list[NDArray], error: float = 0.0
) -> Hinged | None:
    """A group of pieces joined at the vertices that they share, if rings of them hold each other."""
    pieces = [topology.pieces[p] for p in inside]
    some = replace(topology, pieces=tuple(pieces))
    closed = max(ALIKE, error)
    return Hinged.of(pieces, join(some, positions, closed=closed)) if rings(some) > 0 else None


def _deviations(
    topology: Topology, meshes: Sequence[PieceMesh], some: NDArray[np.int64], errors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Of some pieces: standard deviations of log c for `errors` (e,) of the entries."""
    pieces = [topology.pieces[p] for p in some]
    spreads = [errors[piece.edge_rows] for piece in pieces]
    deviation = factor_deviations(pieces, [meshes[p].z for p in some], spreads)
    return np.minimum(deviation / np.abs([meshes[p].scale for p in some]), _UNTOLD)


def _common(
    topology: Topology,
    weights: NDArray,
    meshes: Sequence[PieceMesh],
    factors: Factors,
    inside: NDArray[np.int64],
    noise: Noise | None,
    scale: float | None,
) -> tuple[float | None, float]:
    """The mean of the factors of some pieces, or None where errors do not explain that they differ; and their size."""
    if scale is not None:
        return scale, noise.sigma if noise else 0.0
    c, deviation = factors.own[inside], factors.deviation[inside]
    if not np.isfinite(c).all() or (c * c[0] <= 0).any():
        return None, 0.0
    ratio = np.log(c / c[0])
    mean = float(np.average(ratio, weights=deviation**-2))
    misfit, freedom = (ratio - mean) / deviation, len(inside) - 1
    sigma = noise.sigma if noise else 0.0
    if noise:
        explained = _explained(misfit / noise.sigma, freedom)
    else:
        apart = float(misfit @ misfit)
        left, spare = _left(topology, weights, meshes, inside)
        sigma = float(np.sqrt((apart + left) / (freedom + spare)))
        explained = sigma <= LARGEST_NOISE * np.abs(c).min()
        if spare:
            explained &= left > 0 and fdtrc(freedom, spare, (apart / freedom) / (left / spare)) >= CONFIDENCE
    return float(c[0] * np.exp(mean)) if explained else None, sigma


def _left(
    topology: Topology, weights: NDArray, meshes: Sequence[PieceMesh], inside: NDArray[np.int64]
) -> tuple[float, int]:
    """Sum of squares of what some pieces, each with its c, leave of their entries; and how many these have to spare."""
    pieces = [topology.pieces[p] for p in inside]
    scales = np.array([meshes[p].scale for p in inside])
    left = left_by_all(pieces, weights, [meshes[p].z for p in inside], scales)
    with np.errstate(all="ignore"):  # not finite at flat triangles
        return float(np.sum(left**2)), sum(piece.redundancy for piece in pieces)


def _explained(misfit: NDArray, freedom: int) -> bool:
    """Whether numbers of standard deviation 1, with their mean taken off, are not improbably large."""
    largest = 2 * len(misfit) * float(ndtr(-np.abs(misfit).max()))
    return min(float(gammaincc(freedom / 2, misfit @ misfit / 2)), largest) >= CONFIDENCE


def discord(topology: Topology, factors: Factors, backward_error: float, noise: Noise | None = None) -> str | None:
    """What is wrong where pieces share vertices but not c, errors of the entries being allowed for.

    Parameters
    ----------
    topology : Topology
    factors : Factors
    backward_error : float
        Of the entries.
    noise : Noise, optional
        Their errors.
    """
    difference, together = factors.differences, factors.together
    # A null vector that is not polished may be off by more than the entries; noise has been asked how much it explains.
    allowed = max(ALIKE, 0.0 if noise else MAGNIFIED * backward_error)
    apart = np.where(together, 0.0, difference)
    if apart.max() > allowed:
        more = f", more than {noise} explains" if noise else ""
        why = factors.apart.get(int(factors.first[apart.argmax()]))
        more = f"; errors of the entries explain that, but {why}" if why else more
        return f"pieces that share vertices have different factors c: {_named(topology, factors, apart)}{more}"
    if not noise or not difference.max() > ALIKE:
        return None
    # The first piece of each group tells c, and others confirm it to within their errors; so do rings that close. What
    # may be something else has to agree itself: neither pieces that are beyond doubt nor other groups vouch for it.
    others = together & (np.arange(len(difference)) != factors.first)
    unproved = others & _to_be_confirmed(topology, factors.group)
    agree = np.where(unproved, np.log(np.minimum(noise.sigma * factors.deviation, 1.0)), 0.0)
    chance = np.bincount(factors.first, agree, len(agree))
    chance += factors.closings * np.log(min(GAP * noise.sigma / float(np.abs(factors.own).max()), 1.0))
    # No loose piece vouches for another one: what may be read otherwise agrees by itself, or closes rings.
    alone, in_ring = _readable_otherwise(topology), _shared(topology) > 1
    own = agree + np.where(in_ring, (chance - np.bincount(factors.first, agree, len(agree)))[factors.first], 0.0)
    rough = (unproved & alone & (own > np.log(CHANCE))).any()
    if rough or (chance[factors.first[unproved]] > np.log(CHANCE)).any():
        return (
            f"{noise} explains that pieces which share vertices have different "
            f"factors c by themselves ({_named(topology, factors, difference)}), but they agree too roughly, or are "
            "too few, for a certificate"
        )
    return None


def _named(topology: Topology, factors: Factors, difference: NDArray[np.float64]) -> str:
    """The factor of the first piece of a group, and the one that differs most from it."""
    worst = int(difference.argmax())
    return " and ".join(
        f"{factors.own[p]:.6g} in piece {p}, of row {topology.pieces[p].vertices.min()}"
        for p in (int(factors.first[worst]), worst)
    )


def _to_be_confirmed(topology: Topology, group: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(pieces,) those that may be something else, as far as the entries of each by itself go.

    A piece with entries to spare tells c. One that hangs by a single vertex on pieces of which one does so can only be
    read in itself, and no other way if nothing has vanished and no triangle may be a hole.
    """
    spare = np.array([piece.redundancy > 0 for piece in topology.pieces])
    told = np.bincount(group, spare) > 0
    return np.asarray(~told[group] | (_readable_otherwise(topology) | (_shared(topology) > 1)) & ~spare)


def _readable_otherwise(topology: Topology) -> NDArray[np.bool_]:
    """(pieces,) those without an entry to spare in which entries have vanished, or a triangle may be a hole."""
    rows = np.zeros(len(topology.edges), dtype=bool)
    rows[topology.vanished] = True
    return np.array(
        [
            piece.redundancy <= 0 and bool(rows[piece.edge_rows].any() or piece.enclosed.any())
            for piece in topology.pieces
        ]
    )


def _shared(topology: Topology) -> NDArray[np.int64]:
    """(pieces,) how many vertices each has in common with others."""
    return np.array([np.count_nonzero(topology.multiplicity[piece.vertices] > 1) for piece in topology.pieces])
