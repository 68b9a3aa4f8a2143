"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from ..nodes import Request as Request
from .recover import serve_body as serve_body
from .verdict import against_body as against_body
