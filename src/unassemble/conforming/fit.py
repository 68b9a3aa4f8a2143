"""One part from its entries to positions of all nodes, polished to the level that the entries allow.

Positions of corners come from the conformal pencil, whatever the element (theory: any conforming element). Where cells
are straight, coordinates are determined by those of corners, z = P z_c, and the form M restricted to such fields,
P' M P, is the one of linear elements on the corners: with quadratic or cubic triangles that of P1, exactly. So one
problem of the size of the corners serves all orders, and its null space is that of linear elements.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.reference import planar_rules
from ..errors import GeometryError, SolverError
from ..planar.conformal import ConformalOptions, conformal_map
from ..planar.deviations import covariances
from ..planar.normal import distant_pair
from ..planar.polish import errors_of_one_size, polish
from ..scalar.solving import Task
from ..tolerances import AGREED, CERTIFIED, LAST_DIGITS, LITTLE, ROUNDED
from ..topology.keys import distinct
from .assembly import Entries
from .parts import Part
from .sets import pairs_of

_ALIKE = 1.01  # ratio of misfits of rules between which only rounding or noise decides


@dataclass(frozen=True, eq=False)
class Fitted:
    """A part with positions."""

    part: Part
    weights: NDArray[np.float64]  # (e,) -A_ij of the part's edges
    entries: Entries  # what its entries are for given parameters
    z: NDArray[np.complex128]  # (entries.n,) positions of corners where the part is straight, else of all nodes
    scale: float  # c
    rule: dict[str, str]  # quadrature of each kind of cell
    straight: bool
    # (e,) standard deviations of the entries' errors, up to a common factor, for which z is the least-squares solution
    spread: NDArray[np.float64]
    misfit: NDArray[np.float64]  # (e,) what is left of the weights
    notes: tuple[str, ...] = ()

    @property
    def nodes(self) -> NDArray[np.complex128]:
        """(n,) positions of all nodes."""
        return self.entries.nodes(self.z)

    @property
    def freedom(self) -> int:
        """Entries less unknowns, c among these; that others vanish was supposed."""
        return int(np.count_nonzero(self.weights)) - (2 * self.entries.n - 3)

    @property
    def size(self) -> float:
        """Root mean square of the misfit, relative to c."""
        return float(np.sqrt(np.mean((self.misfit / self.scale) ** 2)))


def fitted(
    part: Part, weights: NDArray, *, scale: float | None, noise: NDArray[np.float64] | None, refine: bool
) -> Fitted:
    """Positions of a part.

    Straight cells first; where they do not fit, all nodes move, from there.

    `weights` (e,): -A_ij of the part's edges; `scale`: c, where it is known; `noise` (e,): standard deviations of the
    entries' errors, where they are known; `refine`: whether to polish.

    Raises GeometryError, SolverError.
    """
    z, c = corner_positions(part, weights, scale)
    trials = []  # with straight sides: the quadrature that fits best, of those that fit alike the first
    for trial in by_rule(part, weights, z, c, noise):
        trials.append(trial)
        if trial.size <= AGREED:
            break
    least = min(trial.size for trial in trials)
    straight = next((trial for trial in trials if trial.size <= max(AGREED, _ALIKE * least)), trials[0])
    if part.degree == 1 or not refine or straight.size < max(CERTIFIED**0.5, _left_by(noise, c)):
        return _settled(straight, scale, noise) if refine else straight
    straight, curved = _polished(straight, scale, noise), None
    for rule in _rules(part, straight=False):
        trial = _polished(_with_rule(part, weights, straight.nodes, c, noise, rule, straight=False), scale, noise)
        if not trial.entries.flipped(trial.z) and (curved is None or trial.size < curved.size):
            curved = trial
        if curved is not None and curved.size < max(ROUNDED, _left_by(noise, c)):
            break
    if curved is None or curved.freedom <= 0:
        return straight
    better = curved.size / np.sqrt(curved.freedom) < straight.size / np.sqrt(straight.freedom)
    return curved if better else straight


def _settled(start: Fitted, scale: float | None, noise: NDArray | None) -> Fitted:
    """Polished, with the best of those rules that are too much alike to be told apart before."""
    best = _polished(start, scale, noise)
    if best.size < LAST_DIGITS:
        return best
    for rule in _rules(best.part, straight=best.straight):
        if rule == best.rule:
            continue
        other = _with_rule(best.part, best.weights, best.z, best.scale, noise, rule, straight=best.straight)
        if LITTLE * other.size < best.size and not np.array_equal(other.misfit, best.misfit):
            other = _polished(other, scale, noise)
            best = other if other.size < _ALIKE / 2 * best.size else best
    return best


def _left_by(noise: NDArray | None, c: float) -> float:
    """Misfit that noise may leave."""
    return 0.0 if noise is None else 2 * float(np.sqrt(np.mean(noise**2))) / abs(c)


def by_rule(
    part: Part, weights: NDArray, z: NDArray, c: float, noise: NDArray[np.float64] | None = None
) -> Iterator[Fitted]:
    """Positions (corners,) of straight cells, and c, with every quadrature."""
    return (_with_rule(part, weights, z, c, noise, rule, straight=True) for rule in _rules(part, straight=True))


def _with_rule(
    part: Part, weights: NDArray, z: NDArray, c: float, noise: NDArray | None, rule: dict[str, str], *, straight: bool
) -> Fitted:
    entries = Entries(part, {kind: planar_rules(kind)[rule[kind.name]] for kind in part.blocks}, straight=straight)
    spread = entries.roundings(z) if noise is None else noise
    with np.errstate(invalid="ignore", over="ignore"):  # cells without an area; see `flipped`
        misfit = weights - c * entries.weights(z)
    return Fitted(part, weights, entries, z, c, rule, straight, spread, misfit)


def _rules(part: Part, *, straight: bool) -> Iterator[dict[str, str]]:
    """Quadratures by kind of cell; on straight triangles the first is exact, and one order serves all others."""
    names = {kind.name: list(planar_rules(kind)) for kind in part.blocks}
    for kind in part.blocks:
        if kind.simplex and (straight or kind.degree == 1):
            names[kind.name] = names[kind.name][:1]
    for k in range(max(map(len, names.values()))):
        yield {name: next(islice(some, min(k, len(some) - 1), None)) for name, some in names.items()}


def _polished(start: Fitted, scale: float | None, noise: NDArray | None) -> Fitted:
    """Gauss-Newton; where it cannot be done the part stays as it is, with a note.

    Unless the noise is known, errors are taken to be those of assembly, or, where the misfit is beyond that and more
    likely to be such, of one size.
    """
    entries, weights = start.entries, start.weights
    if entries.flipped(start.z) or not start.spread.min() > np.finfo(float).eps ** 2 * start.spread.max():
        return replace(start, notes=("no polish: cells are flat or turned over",))
    try:
        # Relative to the largest: squares of 1e-15, of what vanished beside noise of 1e-12, are too much to factorise.
        found = polish(entries, weights, start.z, scale=scale, spread=start.spread / start.spread.max())
        spread = start.spread
        misfit = weights - found.scale * entries.weights(found.z)
        if noise is None and errors_of_one_size(misfit / found.scale, spread):
            spread = np.ones(len(weights))
            found = polish(entries, weights, found.z, scale=scale, spread=spread)
            misfit = weights - found.scale * entries.weights(found.z)
    except SolverError as error:
        return replace(start, notes=(f"no polish: {error}",))
    if not np.isfinite(misfit).all():
        return replace(start, notes=("the polish did not stay finite and was left out",))
    notes = () if found.converged else (f"the polish did not converge: its last step was {found.last_step:.0e} long",)
    return replace(start, z=found.z, scale=found.scale, spread=spread, misfit=misfit, notes=notes)


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
    options = ConformalOptions(first_shift=0.0)
    corners = replace(part.piece, vertices=part.piece.vertices[: part.n_corners], edges=edges)
    found = conformal_map(corners, weights, scale=scale, unit=unit, options=options)
    return found.z, found.scale


def deviations_of(n: int, fits: Sequence[Fitted], placed: Sequence[NDArray], task: Task) -> NDArray[np.float64]:
    """(n, 2) standard deviations in the final frame, NaN for rows of no cell.

    `placed` sequence of (k,): nodes of each part in that frame.
    """
    result = np.full((n, 2), np.nan)
    tensor = task.placement.tensor
    for fit, z in list(zip(fits, placed, strict=True))[::-1]:
        z = np.asarray(tensor.to_laplacian(z)) if tensor else z
        parameters = z[: fit.entries.n]
        sigma = float(np.sqrt(np.mean(fit.spread**2)))
        spread = fit.spread / sigma
        if task.noise is None:
            sigma *= float(np.linalg.norm(fit.misfit / fit.spread)) / np.sqrt(max(fit.freedom, 1))
        covariance = covariances(
            fit.entries.jacobian(parameters, spread),
            fit.entries.weights(parameters) / spread,
            z,
            distant_pair(parameters),
            free_scale=task.scale is None,
            stretch=tensor.root if tensor else None,
            nodes=fit.entries.nodes,
        )
        result[fit.part.piece.vertices] = sigma / abs(fit.scale) * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result
