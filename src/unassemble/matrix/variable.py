"""What a MATLAB file holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class Variable:
    """A variable of a MATLAB file.

    Attributes
    ----------
    name : str
    shape : tuple of int
    sparse : scipy sparse array or None
        The value of a sparse variable, its index arrays still to be checked.
    fields : tuple of Variable
        Of a structure with one element.
    """

    name: str
    shape: tuple[int, ...]
    sparse: Any = None
    fields: tuple[Variable, ...] = ()
