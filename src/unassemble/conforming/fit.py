"""One part from its entries to positions of all nodes, polished to the level that the entries allow.

Positions of corners come from the conformal pencil, whatever the element (theory: any conforming element). Where cells
are straight, coordinates are determined by those of corners, z = P z_c, and the form M restricted to such fields,
P' M P, is the one of linear elements on the corners: with quadratic or cubic triangles that of P1, exactly. So one
problem of the size of the corners serves all orders, and its null space is that of linear elements.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.reference import planar_rules
from ..errors import GeometryError
from ..planar.conformal import conformal_map
from ..planar.piece import PieceMesh, refined
from ..planar.polish import count_flipped
from ..scalar.solving import Task
from ..tolerances import ALIKE, CERTIFIED, ROUNDED
from ..topology.keys import distinct
from .assembly import AssembledEntries
from .parts import Part
from .sets import pairs_of

_SMALL = 200  # nodes of a part whose equations are counted by their rank
_ALIKE = 1.01  # ratio of misfits of rules between which only rounding or noise decides


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted(PieceMesh):
    """A part with positions: of corners where it is straight, else of all nodes."""

    part: Part
    weights: NDArray[np.float64]  # (e,) -A_ij of the part's edges
    entries: AssembledEntries  # what its entries are for given parameters
    rule: dict[str, str]  # quadrature of each kind of cell
    straight: bool

    @property
    def nodes(self) -> NDArray[np.complex128]:
        """(n,) positions of all nodes."""
        return self.entries.nodes(self.z)

    @cached_property
    def freedom(self) -> int:
        """Entries less unknowns, c among these; that others vanish was supposed. -1 where unknowns stay free.

        The entries of a curved cell that a short rule integrates depend on each other, which shows in small meshes.
        """
        n, stored = self.entries.n, self.weights != 0
        if not self.straight and n <= _SMALL:
            with np.errstate(all="ignore"):
                columns = self.entries.jacobian(self.z, np.ones(len(stored))).matrix.toarray()
                slopes = np.column_stack([columns, self.entries.weights(self.z)])[stored]
            size = np.linalg.svd(slopes, compute_uv=False) if np.isfinite(slopes).all() else np.zeros(1)
            if np.count_nonzero(size > ALIKE * size[0]) < 2 * n - 3:
                return -1
        return int(np.count_nonzero(stored)) - (2 * n - 3)

    @cached_property
    def misfit(self) -> NDArray[np.float64]:
        """(e,) what is left of the weights; not finite where cells have no area."""
        with np.errstate(invalid="ignore", over="ignore"):
            return self.weights - self.scale * self.entries.weights(self.z)

    @property
    def size(self) -> float:
        """Root mean square of the misfit, relative to c."""
        size = float(np.sqrt(np.mean((self.misfit / self.scale) ** 2)))
        return size if np.isfinite(size) else np.inf


def fitted(part: Part, weights: NDArray, errors: NDArray[np.float64], task: Task) -> Fitted:
    """Positions of a part.

    Straight cells first; where they do not fit, all nodes move, from there. Of quadratures the first that fits, or the
    one that fits best.

    `weights` (e,): -A_ij of the part's edges; `errors` (e,): their standard deviations over that of typical entries,
    where that is known.

    Raises GeometryError, SolverError.
    """
    scale, noise = task.scale, task.noise
    z, c = corner_positions(part, weights, scale)
    starts = list(by_rule(part, weights, z, c))
    least = min(start.size for start in starts)
    starts.sort(key=lambda start: max(start.size, _ALIKE * least))
    if not task.options.refine:
        return starts[0]
    left = 2 * noise.sigma * float(np.sqrt(np.mean(errors**2))) / abs(c) if noise else 0.0

    def polished(start: Fitted) -> Fitted:
        own = errors if noise else None
        return refined(start.entries, weights, start, scale=scale, rounding=noise is None, noise=own)

    best = polished(starts[0])
    for start in starts[1:]:
        if best.size <= max(ROUNDED, left):
            break
        best = min(best, polished(start), key=lambda one: one.size)
    if part.degree == 1 or best.size <= max(CERTIFIED**0.5, left):
        return best
    nodes = best.nodes
    for rule in _rules(part, straight=False):
        trial = polished(_with_rule(part, weights, nodes, c, rule, straight=False))
        if not count_flipped(trial.entries, trial.z) and _spread_out(trial) < _spread_out(best):
            best = trial
        if best.size <= max(ROUNDED, left):
            break
    return best


def _spread_out(fit: Fitted) -> float:
    """What is left, over the root of the equations to spare; infinite without any."""
    return fit.size / float(np.sqrt(fit.freedom)) if fit.freedom > 0 else np.inf


def by_rule(part: Part, weights: NDArray, z: NDArray, c: float) -> Iterator[Fitted]:
    """Positions (corners,) of straight cells, and c, with every quadrature."""
    return (_with_rule(part, weights, z, c, rule, straight=True) for rule in _rules(part, straight=True))


def _with_rule(part: Part, weights: NDArray, z: NDArray, c: float, rule: dict[str, str], *, straight: bool) -> Fitted:
    entries = AssembledEntries(
        part, {kind: planar_rules(kind)[rule[kind.name]] for kind in part.blocks}, straight=straight
    )
    return Fitted(z, c, part=part, weights=weights, entries=entries, rule=rule, straight=straight)


def _rules(part: Part, *, straight: bool) -> Iterator[dict[str, str]]:
    """Quadratures by kind of cell; on straight triangles the first is exact, and one order serves all others."""
    names = {kind.name: list(planar_rules(kind)) for kind in part.blocks}
    for kind in part.blocks:
        if kind.simplex and (straight or kind.degree == 1):
            names[kind.name] = names[kind.name][:1]
    for k in range(max(map(len, names.values()))):
        yield {name: next(islice(some, min(k, len(some) - 1), None)) for name, some in names.items()}


def _among_corners(part: Part, weights: NDArray) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Pairs of corners, lexicographic, and the weights of L restricted to straight cells."""
    if part.degree == 1:
        return part.edges, weights
    n, c = part.n, part.n_corners
    i, j = part.edges.T
    sums = np.bincount(part.edges.ravel(), np.repeat(weights, 2), n)
    place = np.concatenate([i, j, np.arange(n)]), np.concatenate([j, i, np.arange(n)])
    whole = sp.csr_array((np.concatenate([-weights, -weights, sums]), place), shape=(n, n))
    to_nodes = part.from_corners()
    reduced = sp.csr_array(to_nodes.T @ (whole @ to_nodes))
    pairs = [pairs_of(c, cells[:, : kind.corners]).ravel() for kind, cells in part.blocks.items()]
    keys = distinct(np.concatenate(pairs))
    edges = np.column_stack([keys // c, keys % c])
    return edges, -np.asarray(reduced[edges[:, 0], edges[:, 1]]).ravel()


def corner_positions(part: Part, weights: NDArray, scale: float | None) -> tuple[NDArray[np.complex128], float]:
    """Positions of corners up to a similarity, and c."""
    edges, weights = _among_corners(part, weights)
    unit = float(np.sign(weights.sum()) * np.median(np.abs(weights[weights != 0]))) if weights.any() else 0.0
    if not unit:
        raise GeometryError("the off-diagonal entries add up to zero, those of a Laplacian cannot")
    # Half the energy alone is definite, and from there the cluster of holomorphic maps is seen as one.
    corners = replace(part.piece, vertices=part.piece.vertices[: part.n_corners], edges=edges)
    found = conformal_map(corners, weights, scale=scale, unit=unit, first_shift=0.0)
    return found.z, found.scale
