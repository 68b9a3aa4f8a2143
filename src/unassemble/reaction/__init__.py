"""Scalar matrices with a mass term, A = c L + s M: areas of triangles, and squared lengths of edges, from entries."""

from .fit import fit_metric
from .metric import Metric, Skeleton, areas_of_mass

__all__ = ["Metric", "Skeleton", "areas_of_mass", "fit_metric"]
