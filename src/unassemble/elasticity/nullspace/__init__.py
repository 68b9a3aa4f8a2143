"""From rows with known nodes and directions to positions: the null space of the identities."""

from .atlas import PATCH as PATCH
