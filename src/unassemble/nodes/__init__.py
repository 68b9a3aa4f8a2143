"""From rows to nodes: which rows are one node's, and what bodies and structures have in common from there on."""

from .anchoring import Request as Request
from .grouping import by_first_row as by_first_row
from .nodal import nodal_matrix as nodal_matrix
from .numbering import NodeNumbering as NodeNumbering
from .rounded import Known as Known, known_to as known_to, with_exact_sums as with_exact_sums
from .shape import SOFT as SOFT, shape as shape
from .unknowns import find_numbering as find_numbering, given_numbering as given_numbering
