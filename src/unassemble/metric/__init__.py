"""Edge lengths of curved surfaces: a convex program, and what the lengths say."""

from .flat import could_be_planar, flattened, perhaps_planar, unless_planar
from .realise import realised
from .recover import recover_surface

__all__ = ["could_be_planar", "flattened", "perhaps_planar", "realised", "recover_surface", "unless_planar"]
