"""Terms that a model lacks, looked for in what a fitted mesh leaves of its entries.

Independent errors of the entries have no part in common with a fixed vector but by chance. So a misfit of which the
entries of a mass matrix, or of a coefficient that varies in space, explain more than chance would is no noise, however
small it is: the score test (C. R. Rao, 1948), with the level of the noise estimated from the same misfit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from ..errors import SolverError
from ..topology import Piece
from .cotangent import areas, edge_weights, halves
from .normal import NormalEquations, WeightJacobian, distant_pair
from .polish import PolishOptions

MASS, COEFFICIENT, ONE_SIGN = "mass", "coefficient", "one sign"


@dataclass(frozen=True)
class Term:
    """A term that explains a misfit."""

    # {"mass", "coefficient", "one sign"} entries of a mass matrix; of a coefficient that varies in space; all off by
    # one number. Densities and coefficients are quadratic polynomials.
    name: str
    share: float  # part of the sum of squares that it explains
    probability: float  # that independent normal errors have as much in common with all the terms looked for


def lacking_term(
    piece: Piece, weights: NDArray, z: NDArray, scale: float, spread: NDArray | None, *, free_scale: bool
) -> Term | None:
    """The term that explains most of a misfit; None where there are too few entries to spare, or too many vertices.

    `weights` (e,): -A_ij; `z` (n,): the fitted mesh; `scale`: c; `spread` (e,): standard deviations of the weights up
    to a factor; 1 by default; `free_scale`: whether c was fitted.
    """
    freedom = len(weights) - 2 * piece.n_vertices + 4 - free_scale
    if freedom < 3 or piece.n_vertices > PolishOptions().most_vertices:
        return None
    names, terms = _terms(piece, z)
    count = min(len(names), freedom // 3)  # of few entries the first ones only
    spread = np.ones(len(weights)) if spread is None else spread
    fitted = edge_weights(piece, z) / spread
    terms = terms[:, :count] / spread[:, None]
    try:
        jacobian = WeightJacobian(piece, z, spread)
        equations = NormalEquations(jacobian, distant_pair(z), corrected=True)
        both = np.column_stack([weights / scale / spread - fitted, terms, fitted])
        both -= jacobian.forward(equations.fitted(jacobian, both))  # what displacements cannot explain of these
        equations.release()
    except SolverError:
        return None
    if free_scale and (size := float(np.linalg.norm(both[:, -1]))) > 0:  # less what a change of scale explains
        direction = both[:, -1] / size
        both -= direction[:, None] * (direction @ both)
    misfit, columns = both[:, 0], both[:, 1:-1]
    total = float(misfit @ misfit)
    if not total > 0:
        return None
    share = _explained(misfit, columns) / total
    ratio = (share / count) / max((1 - share) / (freedom - count), np.finfo(float).tiny)
    kinds = {name: np.flatnonzero(names[:count] == name) for name in dict.fromkeys(names[:count].tolist())}
    # Several terms explain more than one does, without being the likelier ones: compared for each of them.
    shares = {name: _explained(misfit, columns[:, chosen]) / total for name, chosen in kinds.items()}
    name = max(shares, key=lambda key: (shares[key] / len(kinds[key])) / max(1 - shares[key], np.finfo(float).eps))
    return Term(name, share, float(fdtrc(count, freedom - count, ratio)))


def _explained(misfit: NDArray, columns: NDArray) -> float:
    """Part of the sum of squares of a misfit (e,) that combinations of columns (e, k) explain."""
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    basis = left[:, values > 1e-6 * values.max(initial=0.0)]  # terms that hardly differ here count once
    return float(np.sum((misfit @ basis) ** 2))


def _terms(piece: Piece, z: NDArray) -> tuple[NDArray, NDArray[np.float64]]:
    """Names (k,) and entries (e, k) of terms, as weights."""
    corners = z[piece.triangles]
    area = np.abs(areas(piece, z)) / 2
    middle = corners.mean(axis=1)
    middle = (middle - middle.mean()) / (np.abs(middle - middle.mean()).max(initial=0.0) or 1.0)
    x, y = middle.real, middle.imag

    def summed(values: NDArray) -> NDArray[np.float64]:
        return np.bincount(piece.opposite.ravel(), values.ravel(), len(piece.edges)).astype(np.float64)

    size = np.broadcast_to(area[:, None], corners.shape) / area.mean()
    powers = (x, y, x * x, x * y, y * y)
    mass = [summed(size * factor[:, None]) for factor in (np.ones_like(x), *powers)]
    varying = [summed(halves(piece, z) * factor[:, None]) for factor in powers]
    names = np.array([*([MASS] * len(mass)), *([COEFFICIENT] * len(varying)), ONE_SIGN])
    return names, np.column_stack([*mass, *varying, np.ones(len(piece.edges))])
