"""Edge lengths of curved surfaces: a convex program, and what the lengths say."""

from .flat import could_be_planar, flattened, perhaps_planar, unless_planar
from .heron import angles, areas_cotangents, heron, longest_step
from .program import solve_metric
from .realise import realised
from .recover import recover_surface
from .verdict import length_deviations

__all__ = [
    "angles",
    "areas_cotangents",
    "could_be_planar",
    "flattened",
    "heron",
    "length_deviations",
    "longest_step",
    "perhaps_planar",
    "realised",
    "recover_surface",
    "solve_metric",
    "unless_planar",
]
