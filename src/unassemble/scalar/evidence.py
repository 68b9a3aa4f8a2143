"""What a misfit looks like: noise of some size, a term that the model lacks, or a wrong entry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import norm  # whose squares do not overflow

from ..certificate import Certificate
from ..planar.terms import Term, lacking_term
from ..tolerances import CERTIFIED, CHANCE, LARGEST_NOISE, SUMMED
from .solving import Solved


@dataclass(frozen=True, eq=False)
class MisfitEvidence:
    """What can be said about a misfit beyond its size."""

    # standard deviation of independent errors of one size in the entries that would leave this misfit; None where there
    # are no more entries than unknowns, and where the misfit is no noise
    noise: float | None
    suspects: NDArray[np.int64]  # (k, 2) entries that hold much of the misfit, which cannot be chance
    # a term that the model lacks, where it cannot be chance that it explains so much of the misfit
    term: Term | None = None


NONE = np.empty((0, 2), dtype=np.int64)

_SPARE = 10  # entries beyond the unknowns, of fewer chance may give one much of the misfit
_OF_ALL, _OF_MEAN = 0.15, 25.0  # squared misfit of an entry that stands out: of the sum, and in units of the mean


def weigh(solved: Solved, certificate: Certificate, *, search: bool) -> MisfitEvidence:
    """Evidence on a finished mesh; wrong entries are looked for if `search`.

    Unless their noise is known, errors of the size that rounding has where there are slivers do not stand out.
    """
    noise = None
    if (freedom := solved.freedom) > 0:
        noise = float(norm(certificate.differences, check_finite=False) / np.sqrt(freedom))
    suspects = _standing_out(solved) if search else NONE
    term = None
    if noise and solved.linear and certificate.backward_error > CERTIFIED and not len(certificate.flipped):
        term = _term(solved, noise)
    return MisfitEvidence(None if term else noise, suspects, term)


def _term(solved: Solved, noise: float) -> Term | None:
    """What the model lacks, as the piece tells in which chance is least likely; no entry is blamed for that."""
    if not noise <= LARGEST_NOISE * np.abs(solved.scales).min() or (solved.noise and solved.noise.digits):
        return None
    found = []
    for piece, (weights, _, mesh) in zip(solved.topology.pieces, solved.fits, strict=True):
        term = lacking_term(piece, weights, mesh.z, mesh.scale, mesh.spread, free_scale=solved.task.free_scale)
        found += [] if term is None else [term]
    least = min(found, key=lambda term: term.probability, default=None)
    return least if least and least.probability * len(found) < CHANCE else None


def pooled_noise(solved: Solved) -> float:
    """Common factor of the standard deviations of the entries' errors, in the norms that the pieces were fitted in."""
    left = []
    for weights, model, mesh in solved.fits:
        misfit = weights - mesh.scale * model.weights(mesh.z)
        left.append(misfit if mesh.spread is None else misfit / mesh.spread)
    return float(norm(np.concatenate(left), check_finite=False) / np.sqrt(max(solved.freedom, 1)))


def _standing_out(solved: Solved) -> NDArray[np.int64]:
    """(k, 2) at most one entry of each piece: that which holds much of the squared misfit, more than chance gives it.

    Of a wrong entry's error its own misfit is the part that the positions do not follow.
    """
    gone = np.zeros(len(solved.topology.edges), dtype=bool)
    gone[solved.topology.vanished] = True  # these are exact
    found = [NONE]
    for piece, (weights, model, mesh), spare in zip(solved.topology.pieces, solved.fits, solved.spare, strict=True):
        with np.errstate(all="ignore"):  # flat triangles
            left = weights / mesh.scale - model.weights(mesh.z)
            rounding = model.roundings(mesh.z)
            squares = (left / (rounding if mesh.spread is None else mesh.spread)) ** 2
            if spare < _SPARE or (solved.noise is None and norm(left / rounding, check_finite=False) <= SUMMED):
                continue
        squares[gone[piece.edge_rows]] = 0.0
        most = squares.max()
        if np.isfinite(squares).all() and most > _OF_ALL * squares.sum() and most > _OF_MEAN * squares.mean():
            found.append(solved.matrix.edges[piece.edge_rows[[squares.argmax()]]])
    return np.concatenate(found)
