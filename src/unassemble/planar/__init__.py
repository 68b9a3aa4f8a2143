"""Scalar matrices in the plane: conformal null vector, unknown scale, polish, error bars, gauge."""

from .conformal import conformal_map as conformal_map, estimate_scale as estimate_scale
from .cotangent import edge_weights as edge_weights, weight_gradient as weight_gradient
from .deviations import covariances as covariances
from .frame import canonical_frame as canonical_frame, collinear as collinear, fit_similarity as fit_similarity
from .hinges import join as join
from .normal import WeightJacobian as WeightJacobian
from .pencil import ConformalPencil as ConformalPencil, ShiftedSearch as ShiftedSearch
from .piece import PieceMesh as PieceMesh, collapsed as collapsed, refined as refined
from .polish import CAREFUL as CAREFUL, PolishOptions as PolishOptions, count_flipped as count_flipped, polish as polish
