"""Scalar matrices with a mass term, A = c L + s M: areas of triangles, and squared lengths of edges, from entries."""

from .areas import areas_of_mass
from .fit import MetricFit, MetricOptions, fit_metric
from .metric import Metric, Skeleton

__all__ = ["Metric", "MetricFit", "MetricOptions", "Skeleton", "areas_of_mass", "fit_metric"]
