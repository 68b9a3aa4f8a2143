"""Edge lengths of curved surfaces: a convex program, and what the lengths say."""

from .flat import (
    could_be_planar as could_be_planar,
    flattened as flattened,
    perhaps_planar as perhaps_planar,
    unless_planar as unless_planar,
)
from .heron import angles as angles, areas_cotangents as areas_cotangents, heron as heron, longest_step as longest_step
from .program import solve_metric as solve_metric
from .realise import realised as realised
from .recover import recover_surface as recover_surface
from .verdict import VARYING as VARYING, Found as Found, length_deviations as length_deviations
