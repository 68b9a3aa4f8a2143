"""Scalar matrices in the plane: conformal null vector, unknown scale, polish, error bars, gauge."""

from .conformal import conformal_map, estimate_scale
from .cotangent import edge_weights, weight_gradient
from .deviations import covariances
from .frame import canonical_frame, collinear, fit_similarity
from .hinges import join
from .normal import WeightJacobian
from .pencil import ConformalPencil, ShiftedSearch
from .piece import PieceMesh, collapsed, refined
from .polish import CAREFUL, PolishOptions, count_flipped, polish

__all__ = [
    "CAREFUL",
    "ConformalPencil",
    "PieceMesh",
    "PolishOptions",
    "ShiftedSearch",
    "WeightJacobian",
    "canonical_frame",
    "collapsed",
    "collinear",
    "conformal_map",
    "count_flipped",
    "covariances",
    "edge_weights",
    "estimate_scale",
    "fit_similarity",
    "join",
    "polish",
    "refined",
    "weight_gradient",
]
