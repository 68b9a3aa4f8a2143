"""Edge lengths of curved surfaces: a convex program, and what the lengths say."""

from .flat import flattened
from .realise import realised
from .recover import recover_surface

__all__ = ["flattened", "realised", "recover_surface"]
