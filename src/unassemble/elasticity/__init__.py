"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from ..nodes import Request
from .recover import serve_body

__all__ = [
    "Request",
    "serve_body",
]
